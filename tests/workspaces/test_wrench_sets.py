"""Sets of loads: parts, sums, and refusals."""

import copy
import pickle

import numpy as np
import pytest

import sagline as sl
from sagline import InvalidValueError
from sagline.workspaces.wrench_sets import NO_LOAD, load_of
from tests.refusal import refused


def test_adding_joins_the_parts() -> None:
    box = sl.WrenchBox(force=[1.0, 2.0, 3.0], moment=4.0, center=[1, 0, 0, 0, 0, 5])
    both = box + sl.WrenchPolytope(np.ones((3, 6))) + sl.WrenchPolytope(np.zeros((2, 6))) + sl.Accelerations(1.0, 2.0)
    both = both + sl.WrenchEllipsoid(force=7.0) + sl.Accelerations(angular=0.5)
    np.testing.assert_array_equal(both.center, [1, 0, 0, 0, 0, 5])
    np.testing.assert_array_equal(both.segments, np.diag([1.0, 2.0, 3.0, 4.0, 4.0, 4.0]))
    np.testing.assert_array_equal(both.sizes, [3, 2])
    assert both.corners.shape == (5, 6)
    np.testing.assert_array_equal(both.accelerations, [1.0, 2.5])
    np.testing.assert_array_equal(both.ellipsoids, [np.diag([7.0, 7.0, 7.0, 0.0, 0.0, 0.0])])
    with pytest.raises(TypeError):
        box + 1.0  # type: ignore[operator]


def test_copies_of_a_set_have_its_type_and_are_read_only() -> None:
    box = sl.WrenchBox(force=3.0)
    for again in (pickle.loads(pickle.dumps(box)), copy.deepcopy(box)):
        assert type(again) is sl.WrenchBox
        np.testing.assert_array_equal(again.segments, box.segments)
        assert not again.segments.flags.writeable
    with pytest.raises((AttributeError, TypeError)):
        box.center = np.zeros(6)  # type: ignore[misc]


def test_no_load_is_the_point_zero() -> None:
    assert load_of(None) is NO_LOAD
    pose = sl.Pose([0, 0, 2], np.eye(3))
    robot = sl.load_robot("article-suspended")
    values = [sl.margin(robot, pose, one).value for one in (None, sl.WrenchPolytope([[0.0] * 6]), sl.WrenchBox())]
    assert values[0] == values[1] == values[2]


def test_other_objects_are_refused_by_name() -> None:
    with refused("force", "-1 N", ">= 0 N, finite", kind=InvalidValueError):
        sl.WrenchBox(force=-1.0)
    with refused("moment", "of shape (2,)", kind=InvalidValueError):
        sl.WrenchBox(moment=[1.0, 2.0])
    with refused("center", "of shape (2,)", "shape (6,)", kind=InvalidValueError):
        sl.WrenchEllipsoid(1.0, center=[0.0, 0.0])
    with refused("matrix", allowed="one of the two", kind=InvalidValueError):
        sl.WrenchEllipsoid(1.0, matrix=np.eye(6))
    with refused("corners", "of shape (0, 6)", "shape (C, 6), C >= 1", kind=InvalidValueError):
        sl.WrenchPolytope(np.zeros((0, 6)))
    with refused("linear", "-1 m/s^2", ">= 0 m/s^2, finite", kind=InvalidValueError):
        sl.Accelerations(linear=-1.0)
    with refused("wrenches", "3.0", "a WrenchSet, or None", kind=InvalidValueError):
        load_of(3.0)
