"""Fronts: no candidate dominates another one of the front, and all other candidates are dominated."""

from __future__ import annotations

import pickle

import numpy as np

import sagline as sl
from sagline.optimization.design import PENALTY, _pareto_front, costs_of
from tests.optimization.pair import UNDER, apart, pair
from tests.tiers import extended


def test_a_front_contains_the_nondominated_candidates() -> None:
    random = np.random.default_rng(5)
    for size in (1, 2, 30, 200):
        costs = random.integers(0, 12, (size, 3)).astype(float)
        found = set(_pareto_front(costs).tolist())
        beaten = [((costs <= own).all(axis=1) & (costs < own).any(axis=1)).any() for own in costs]
        assert {tuple(costs[k]) for k in found} == {tuple(c) for c, b in zip(costs, beaten, strict=True) if not b}
        assert len(found) == len({tuple(costs[k]) for k in found})


def test_costs_are_finite_for_all_values() -> None:
    goals = (sl.Goal("mean_margin"), sl.Goal("largest_sag", scale=0.5))
    values = np.array([[4.0, 0.25], [np.nan, np.nan], [np.inf, np.inf], [-np.inf, 1.0]])
    costs = costs_of(values, goals, values[0])
    np.testing.assert_array_equal(costs[0], [-1.0, 0.5])
    np.testing.assert_array_equal(costs[1], [2.0 * PENALTY] * 2)
    np.testing.assert_array_equal(costs[2], [-PENALTY, PENALTY])
    np.testing.assert_array_equal(costs[3], [PENALTY, 2.0])


@extended
def test_wider_anchors_trade_margin_for_tension() -> None:
    """Two goals with a known front: a larger angle, up to 60 degrees, gives a larger margin and a larger tension."""
    goals = [sl.Goal("least_margin"), sl.Goal("largest_tension")]
    front = sl.design(pair(), [apart()], goals, poses=UNDER, model=sl.Straight(), optimizer="nsga2", evaluations=960)
    assert len(front.robots) > 10
    margin, tension = front.values.T
    order = np.argsort(margin)
    assert (np.diff(tension[order]) > 0.0).all()
    theta = np.arctan2([one.frame_anchors[0, 0] for one in front.robots], 2.0)
    np.testing.assert_allclose(margin, 10.0 * np.sin(theta), rtol=1e-9)  # all at 60 degrees or less
    np.testing.assert_allclose(tension, 5.0 / np.cos(theta), rtol=1e-9)
    assert margin[0] == margin.max()
    names = [one.name for one in front.robots]
    assert names[:2] == ["pair-front-1", "pair-front-2"]
    again = pickle.loads(pickle.dumps(front))
    assert again.text == front.text
    assert again.values.tobytes() == front.values.tobytes()
