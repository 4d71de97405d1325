"""One definition of admissible tensions: inverse, margin, prove, workspace and design do not contradict each other."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from tests.tiers import extended
from tests.workspaces.random_robots import CABLES, COUNTED, compare, random_robot


def of_random_robots(seed: int, robots: int, poses: int) -> Counter[str]:
    """Sum of the counters of some robots of every pattern."""
    rng, total = np.random.default_rng(seed), Counter[str]()
    for _ in range(robots):
        for pattern in CABLES:
            total += compare(random_robot(rng, pattern), poses, rng)
    return total


@pytest.mark.parametrize(
    ("seed", "robots", "poses"),
    [
        (1, 6, 15),
        pytest.param(1, 60, 50, marks=extended),
        *(pytest.param(seed, 325, 100, marks=pytest.mark.soak) for seed in range(1, 9)),
    ],
)
def test_five_functions_agree(seed: int, robots: int, poses: int) -> None:
    found = of_random_robots(seed, robots, poses)
    print(dict(found))
    assert {name: count for name, count in found.items() if name not in COUNTED} == {}
    assert found["poses"] > 3.8 * robots * poses
    assert found["solved"] > 0.08 * found["poses"]
    assert found["proved"] > 0.8 * found["poses"]
    assert found["fitting"] > 0.1 * found["poses"]
    assert found["open"] + found["borderline"] < 0.1 * found["poses"]
