"""Results print as short text: the verdict first, then values with units; at most 12 lines of 80 columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.results import documented_units

ROBOT = sl.load_robot("article-suspended")
HERE = (1.0, 1.0, 1.5)
PLAN = sl.inverse(ROBOT, HERE, "elastic", "minimum-norm")
PATH = sl.quintic_path([(0, 0, 1.5), (1, 1, 2), (30, 1, 2)], speed=1.5)
ALONG = sl.inverse(ROBOT, PATH)
THINGS: dict[str, Callable[[], Any]] = {
    "article-suspended: held": lambda: ROBOT,
    "two cables: 2 cables": lambda: sl.without_cables(ROBOT, *range(2, 8)).replace(name="two cables"),
    "Path:": lambda: PATH,
    "Plan of article-suspended: feasible": lambda: PLAN,
    f"Plan of article-suspended: {ALONG.feasible.sum():,} of": lambda: ALONG,
    "Confirmation of article-suspended: 1 of 1": lambda: sl.confirm(PLAN),
    "Equilibrium of article-suspended: at (1.0000": lambda: PLAN.state,
    "Equilibrium of article-suspended: 1 of 1 solved": lambda: sl.forward(ROBOT, PLAN.unstrained_length),
    "Simulation of article-suspended:": lambda: sl.simulate(PLAN, duration=0.05),
    "Vibration of article-suspended:": lambda: sl.vibration(PLAN, up_to=5.0),
    "CableState": lambda: ALONG.state.cables,
    "Stiffness of article-suspended": lambda: sl.stiffness(ALONG),
    "Modes of article-suspended": lambda: sl.modes(ALONG),
    "Linearized of article-suspended": lambda: sl.linearized(PLAN),
    "FrequencyMap of article-suspended": lambda: sl.frequency_map(ROBOT, [HERE, HERE], up_to=5.0),
    "FrequencyResponse of article-suspended": lambda: sl.frequency_response(PLAN, [1.0, 2.0]),
    "Equilibria": lambda: sl.equilibria(ROBOT, PLAN.unstrained_length, starts=3),
}


@pytest.mark.parametrize("begin", THINGS)
def test_a_result_prints_short(begin: str) -> None:
    thing = THINGS[begin]()
    text = repr(thing).replace("\N{NO-BREAK SPACE}", " ")
    assert text.startswith(begin)
    assert "array(" not in text
    assert len(text.splitlines()) <= 12
    assert max(map(len, text.splitlines())) <= 80
    assert str(thing) == repr(thing)


def test_a_plan_names_range_method_and_model() -> None:
    text = repr(PLAN).replace("\N{NO-BREAK SPACE}", " ")
    tension = PLAN.chord_tension
    for part in (f"{tension.min():.4g} N to {tension.max():.4g} N", "(minimum-norm, elastic)"):
        assert part in text
    assert "of frame-end" in repr(sl.inverse(ROBOT, HERE, tension=sl.Closest("frame_end")))
    assert f"{np.abs(sl.modes(PLAN).frequency).max():.4g}\N{NO-BREAK SPACE}Hz" in repr(sl.modes(PLAN))


def test_units_are_those_of_the_documentation() -> None:
    assert documented_units(sl.Plan, "wrench_residual") == ["N", "N m"]
    assert documented_units(sl.Plan, "chord_tension") == ["N"]  # a property
    assert documented_units(sl.Stiffness, "length_sensitivity") == ["m/m, rad/m"]
    assert documented_units(sl.Plan, "status") == []


def test_messages_do_not_contain_the_text_of_a_result() -> None:
    with pytest.raises(sl.InvalidValueError) as caught:
        sl.confirm(sl.stiffness(PLAN))  # type: ignore[arg-type]
    assert caught.value.value == "a Stiffness"
