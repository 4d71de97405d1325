import numpy as np
import pytest
from numpy.testing import assert_allclose

from sagline.core.arrays import Array
from sagline.workspaces.grid import brackets, crossings, distance_to_box
from tests.workspaces.shapes import Counted, Level

LINES = 200


def lines(level: Level) -> tuple[Array, Array, Array, Array]:
    """From the origin along x, of lengths 1 to 3."""
    inner, outer = np.zeros((2, LINES, 3))
    outer[:, 0] = np.linspace(1.0, 3.0, LINES)
    return inner, outer, level(inner), level(outer)


def jump(low: float, high: float) -> Level:
    return lambda p: np.where(p[:, 0] <= 0.7, low, high)


@pytest.mark.parametrize("power", [0.2, 5.0])
@pytest.mark.parametrize("root", [0.05, 0.9])
def test_curved_functions_take_few_evaluations(power: float, root: float) -> None:
    counted = Counted(lambda p: root**power - p[:, 0] ** power)
    given = lines(counted.level)
    share = crossings(counted, *given)
    assert_allclose(share * given[1][:, 0], root, rtol=1e-9)
    assert len(counted.positions) < 22 * LINES


def test_jumps_and_infinite_ends_take_as_many_evaluations_as_bisection() -> None:
    for low, high in ((1.0, -1.0), (1e-6, -1e6), (np.inf, -np.inf), (np.inf, -1.0), (0.5, -np.inf)):
        counted = Counted(jump(low, high))
        given = lines(counted.level)
        share = crossings(counted, *given)
        assert_allclose(share * given[1][:, 0], 0.7, rtol=1e-11)
        assert (share * given[1][:, 0] <= 0.7).all()
        assert len(counted.asked) < 64  # 40 by bisection alone


def test_an_end_that_is_zero_is_the_crossing() -> None:
    counted = Counted(lambda p: -p[:, 0])
    assert (crossings(counted, *lines(counted.level)) == 0.0).all()
    assert not counted.asked


def test_brackets_are_found_on_both_sides_within_their_limits() -> None:
    x = np.array([-0.5, 0.5, 0.9, -0.9])  # inside below zero
    points, outward = np.zeros((2, 4, 3))
    points[:, 0], outward[:, 0] = x, 1.0
    counted = Counted(lambda p: -p[:, 0])
    limit = np.array([2.0, 2.0, 0.8, 0.8])
    found = brackets(counted, points, outward, -x, np.full(4, 0.1), limit, limit)
    assert found.found.tolist() == [True, True, False, False]
    assert found.k.tolist() == [0, 1]
    assert_allclose(found.inner[:2, 0], [-0.2, -0.4], atol=1e-15)  # 0.5 less 0.1, 0.3 and 0.9
    assert_allclose(found.outer[:2, 0], [0.4, 0.2], atol=1e-15)
    assert_allclose(found.at_inner[:2], [0.2, 0.4])
    assert np.abs(counted.positions[:, 0]).max() <= 0.9


def test_distance_to_the_box() -> None:
    directions = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.6, 0.8]])
    assert_allclose(distance_to_box(np.array([0.5, 0.0, 0.0]), directions, -np.ones(3), np.ones(3)), [0.5, 1.0, 1.25])
