"""A simulation that is read during its run is equal to one that is not, to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.dynamics.simulation.initial_conditions import initial_conditions
from sagline.dynamics.simulation.simulate import started_run
from tests.tiers import wide

PARTS = (0.03, 0.1, 0.1, 0.137, 0.3, 0.05, np.inf)  # also between records, twice, and back
EVENTS = (sl.Break(cable=1, time=0.0), sl.Break(cable=4, time=0.1), sl.Drop(mass=10.0, time=0.1234))


def state() -> sl.Equilibrium:
    return sl.inverse(sl.load_robot("cogiro"), sl.Pose.from_euler([1.0, -0.5, 2.0], 0.1, 0.0, 0.0)).state


@pytest.mark.parametrize(
    ("elements", "told"),
    wide(
        [
            (0, {}),
            (0, {"events": EVENTS, "damping": sl.Damping(loss_time=1e-3)}),
            (0, {"events": EVENTS, "integrator": "splitting", "record": 0.007}),
            (4, {"events": EVENTS[:1], "damping": sl.Damping(loss_time=1e-4)}),
        ],
        first=3,
    ),
)
def test_a_run_in_parts_agrees_with_one_run(elements: int, told: dict[str, Any]) -> None:
    mass: dict[str, Any] = {"cable_mass": "lumped", "nodes": elements} if elements else {}
    start, gust = state(), ([0.0, 0.05, 0.1], np.outer([0.0, 1.0, 0.0], [300.0, 0.0, 0.0, 0.0, 0.0, 10.0]))
    at_once = sl.simulate(start, duration=0.405, wrench=gust, **mass, **told)
    run = started_run(initial_conditions(start, None, gust, 0.405), elements, **told)
    before = 0
    for part in PARTS:
        found = run.until(part)
        count = len(found.time)
        assert found.time[-1] >= min(part, 0.405) - 1e-12
        assert count >= before
        before = count
        for name in ("time", "twist", "tensions", "length"):
            np.testing.assert_array_equal(getattr(found, name), getattr(at_once, name)[:count])
        np.testing.assert_array_equal(found.pose.position, at_once.pose.position[:count])
        np.testing.assert_array_equal(found.pose.quaternion, at_once.pose.quaternion[:count])
        np.testing.assert_array_equal(found.energy.error, at_once.energy.error[:count])
        np.testing.assert_array_equal(found.energy.removed, at_once.energy.removed[:count])
        if at_once.nodes is not None:
            assert found.nodes is not None
            np.testing.assert_array_equal(found.nodes, at_once.nodes[:count])
        known = [event for event in at_once.events if event.time <= found.time[-1]]
        assert [(e.kind, e.cable, e.time) for e in found.events] == [(e.kind, e.cable, e.time) for e in known]
    assert len(found.time) == len(at_once.time)
    np.testing.assert_array_equal(found.largest_tension, at_once.largest_tension)
    assert [e.tension_after for e in found.events] == [e.tension_after for e in at_once.events]
    assert (found.integrator, found.damping, found.step) == (at_once.integrator, at_once.damping, at_once.step)


def test_returned_results_do_not_change_later() -> None:
    run = started_run(initial_conditions(state(), None, None, 0.4), events=EVENTS[:1])
    early = run.until(0.1)
    copied = early.tensions.copy(), early.pose.position.copy(), early.largest_tension
    assert copied[2] is not None
    highest = copied[2].copy()
    run.finish()
    np.testing.assert_array_equal(early.tensions, copied[0])
    np.testing.assert_array_equal(early.pose.position, copied[1])
    np.testing.assert_array_equal(early.largest_tension, highest)
