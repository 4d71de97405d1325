import pickle
import re
from typing import Any

import numpy as np
import pytest

from sagline import Cable, InvalidValueError, Robot, Winch
from sagline.calibration.parameters import KINDS
from sagline.robot.tolerances import UNCERTAIN, Provenance, value_of
from tests.refusal import refused

# kinds of unknowns that are not fields of a robot
OUTSIDE = {"inertia", "measuring_frame", "length_scale", "clock_offset", "swivel_zero", "target"}


def four(**changes: Any) -> Robot:
    anchors = np.array([[1.0, 1, 3], [-1, 1, 3], [-1, -1, 3], [1, -1, 3]])
    winches = Winch(0.05, dead_cable=[2.0, 2, 2, 3], drum_radius=0.06, length_zero=4.0, load_cell_gain=1.1)
    cables = Cable(0.05, [1e5, 1e5, 1e5, 2e5])
    return Robot("four", anchors, np.zeros((4, 3)), cables, 10.0, motion_pattern="3T", winches=winches, **changes)


def test_names_units_and_shapes_are_those_of_calibrated_parameters() -> None:
    assert list(UNCERTAIN) == [name for name in KINDS if name not in OUTSIDE]
    for name, what in UNCERTAIN.items():
        kind = KINDS[name]
        assert (what.unit, what.each, what.axes) == (kind.unit, kind.each, len(kind.axes) == 3), name
        assert what.share or not kind.logarithmic, name


@pytest.mark.parametrize("name", UNCERTAIN)
def test_a_tolerance_has_the_shape_of_its_field(name: str) -> None:
    robot, what = four(), UNCERTAIN[name]
    value = value_of(robot, name)
    assert value is not None
    assert what.shape(4) == value.shape
    ways: list[Any] = [0.5, np.arange(1.0, 1.0 + value.size).reshape(value.shape)] + [[0.1, 0.2, 0.3]] * what.axes
    for given in ways:
        found = robot.replace(tolerances={name: given}).tolerances[name]
        np.testing.assert_array_equal(found, np.broadcast_to(given, value.shape))
        assert found.shape == value.shape
        assert not found.flags.writeable


@pytest.mark.parametrize("name", UNCERTAIN)
@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, "x", None, [1.0, 2.0], np.ones((5, 3)), np.ones((4, 4, 3))])
def test_a_wrong_tolerance_is_named(name: str, wrong: Any) -> None:
    with pytest.raises(InvalidValueError) as caught:
        four(tolerances={name: wrong})
    assert re.fullmatch(rf"tolerances: {name}(\[\d+\])?", caught.value.item)
    assert len(str(caught.value)) < 300
    if isinstance(wrong, float) and wrong == 0.0:  # a standard error can be zero
        assert four(calibration=Provenance("", "2026-01-01", {name: wrong})).calibration is not None
        return
    with pytest.raises(InvalidValueError) as caught:
        four(calibration=Provenance("", "2026-01-01", {name: wrong}))
    assert re.fullmatch(rf"calibration: standard_error: {name}(\[\d+\])?", caught.value.item)


@pytest.mark.parametrize("wrong", ["frame_anchors", 3, None, [("mass", 1.0)], {"masss": 1.0}, {3: 1.0}, {"target": 1}])
def test_other_objects_are_refused(wrong: Any) -> None:
    with pytest.raises(InvalidValueError) as caught:
        four(tolerances=wrong)
    assert caught.value.item.startswith("tolerances")
    with pytest.raises(InvalidValueError) as caught:
        four(calibration=Provenance("", "2026-01-01", wrong))
    assert caught.value.item.startswith("calibration: standard_error")


def test_an_infinite_tolerance_means_unknown() -> None:
    assert np.isinf(four(tolerances={"mass": np.inf}).tolerances["mass"])


@pytest.mark.parametrize("wrong", ["yesterday", "", "2026-13-01", None, 20260301])
def test_an_invalid_date(wrong: Any) -> None:
    with refused("calibration: date", kind=InvalidValueError) as caught:
        Provenance("log.csv", wrong)
    assert "ISO 8601" in str(caught.value)


def test_tolerances_and_calibration_stay_with_the_robot() -> None:
    made = Provenance("winches.csv", "2026-03-01T10:00:00+00:00", {"mass": 0.1, "frame_anchors": 1e-3}, "rainy")
    robot = four(tolerances={"frame_anchors": [0.1, 0.2, 0.3], "mass": 1.0}, calibration=made)
    for other in (pickle.loads(pickle.dumps(robot)), robot.replace(tension_min=5.0)):
        assert list(other.tolerances) == ["frame_anchors", "mass"]
        np.testing.assert_array_equal(other.tolerances["frame_anchors"], [[0.1, 0.2, 0.3]] * 4)
        known = other.calibration
        assert known is not None
        assert (known.log, known.date, known.note) == (made.log, made.date, made.note)
        np.testing.assert_array_equal(known.standard_error["frame_anchors"], np.full((4, 3), 1e-3))
        assert not known.standard_error["mass"].flags.writeable


@pytest.mark.parametrize("name", UNCERTAIN)
def test_a_replaced_value_loses_its_standard_error(name: str) -> None:
    errors: Any = dict.fromkeys(UNCERTAIN, 0.1)
    robot = four(calibration=Provenance("", "2026-01-01", errors))
    part, _, inner = UNCERTAIN[name].place.partition(".")
    new = np.asarray(value_of(robot, name)) * 1.01 + 0.01
    other = robot.replace(**{part: getattr(robot, part).replace(**{inner: new}) if inner else new})
    assert other.calibration is not None
    assert set(other.calibration.standard_error) == set(UNCERTAIN) - {name}
    assert robot.calibration is not None
    assert set(robot.calibration.standard_error) == set(UNCERTAIN)
    again = robot.replace(mass=11.0, calibration=robot.calibration)  # the caller provides them
    assert again.calibration is not None
    assert "mass" in again.calibration.standard_error


def test_removed_winches_lose_their_standard_errors() -> None:
    robot = four(calibration=Provenance("", "2026-01-01", {"drum_radius": 1e-4, "mass": 0.1}))
    bare = robot.replace(winches=None).calibration
    assert bare is not None
    assert list(bare.standard_error) == ["mass"]
