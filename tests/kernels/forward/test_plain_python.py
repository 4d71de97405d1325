"""Forward kernels as plain Python, in which an index outside an array raises IndexError, unlike in machine code."""

import os
import subprocess
import sys

import pytest

from tests.tiers import extended

SOLVE = """
import sagline as sl
robot = sl.load_robot({name!r})
plan = sl.inverse(robot, sl.Pose.from_euler([0.2, -0.4, 2.4], 0, 0, 0))
found = sl.forward(robot, plan.unstrained_length)
print(*found.pose.position.ravel())
"""


@extended
@pytest.mark.parametrize("name", ["cogiro"])
def test_a_forward_solution_from_a_distant_start_stays_within_its_arrays(name: str) -> None:
    plain = {**os.environ, "SAGLINE_BACKEND": "python"}
    done = subprocess.run(
        [sys.executable, "-c", SOLVE.format(name=name)], env=plain, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert [float(word) for word in done.stdout.split()] == pytest.approx([0.2, -0.4, 2.4], abs=1e-9)
