"""Verdicts on curves: by hand for weightless cables, and compared with a fine grid for two sagging ones."""

from __future__ import annotations

import numpy as np
import pytest

from sagline.kernels.cable.states import LOOSEST
from sagline.kernels.codes import POSE_INFEASIBLE, POSE_SOLVED
from sagline.kernels.tension import bracket
from sagline.kernels.tension.least_change import Demand
from tests.kernels.cable.curves import pulls_of, random_curves
from tests.kernels.compiled import from_python, memory
from tests.kernels.tension.demands import change_from, demand_of, weightless

NODES = bracket.NODES
decide = from_python(bracket.decide_feasibility)


def test_weightless_cables_by_hand() -> None:
    low, high = np.ones(2), np.full(2, 2.0)
    for right, expected, shortfall in (
        ([1.5, 1.2], POSE_SOLVED, 0.0),
        ([5.0, 0.5], POSE_INFEASIBLE, np.hypot(3.0, 0.5)),
        ([2.0, 1.0], POSE_SOLVED, 0.0),  # on the boundary itself
        ([2.0 + 1e-6, 1.0], POSE_INFEASIBLE, 1e-6),
    ):
        demand = demand_of(np.eye(2), np.array(right), 2)
        status, proved, enough, by_one = decide(weightless(low, high), demand, NODES, change_from(low, 2), memory(5000))
        assert status == expected
        assert enough == pytest.approx(shortfall, abs=1e-12)
        assert proved == pytest.approx(shortfall, abs=1e-12)
        assert by_one == (expected == POSE_INFEASIBLE)


def test_no_force_is_sufficient_if_moments_are_infeasible() -> None:
    matrix = np.array([[1.0, 1.0], [1.0, -1.0]])  # two cables up at x = -1 and x = 1
    change = change_from(np.ones(2), 2)
    demand = demand_of(matrix, np.array([2.0, 5.0]), 1)
    status, proved, enough, by_one = decide(
        weightless(np.zeros(2), np.full(2, 2.0)), demand, NODES, change, memory(5000)
    )
    assert (status, by_one) == (POSE_INFEASIBLE, True)
    assert proved == enough == np.inf
    np.testing.assert_allclose(change.direction, [0.0, 1.0])


def test_one_sagging_cable_reaches_the_range_of_its_curve() -> None:
    # one row: tau - sag_force(tau), which is not monotonic; its range is known from a fine grid
    rng = np.random.default_rng(7)
    verdicts: list[bool] = []
    nearest: list[bool] = []
    for _ in range(150):
        curves = random_curves(rng, 1)
        low, high = float(curves.cables.low[0]), float(curves.cables.high[0])
        hanging = rng.uniform(-2, 2)
        tensions = np.geomspace(max(low, curves.cables.half_weight[0] / LOOSEST), high, 4000)
        reached = tensions - hanging * pulls_of(curves, 0, tensions)
        bend = np.abs(np.diff(reached)).max()
        right = rng.uniform(reached.min() - 0.2 * np.ptp(reached), reached.max() + 0.2 * np.ptp(reached))
        if min(abs(right - reached.min()), abs(right - reached.max())) < bend:
            continue  # too close for the grid
        demand = Demand(np.ones((1, 1)), np.full((1, 1), hanging), np.array([right]), 1, abs(right))
        change = change_from(np.array([low]), 1)
        status, proved, enough, _ = decide(curves, demand, NODES, change, memory(5000))
        inside = reached.min() < right < reached.max()
        verdicts.append(bool(inside))
        assert status == (POSE_SOLVED if inside else POSE_INFEASIBLE)
        if inside:
            tau = change.tau[0]
            assert tau - hanging * pulls_of(curves, 0, change.tau)[0] == pytest.approx(right, rel=1e-8)
        else:
            distance = max(reached.min() - right, right - reached.max())
            # slack curves have tensions without an improving step, so the sufficient force is not the least one
            assert proved - bend <= distance <= enough + bend
            nearest.append(bool(enough <= distance + bend))
    assert np.mean(nearest) > 0.9
    assert 30 < sum(verdicts) < len(verdicts) - 30
