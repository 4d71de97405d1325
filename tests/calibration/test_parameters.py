"""Parameters of a calibration and their priors."""

import numpy as np
import pytest

import sagline as sl
from sagline import InvalidValueError
from sagline.calibration.parameters import Parameters, checked_unknowns, parameters_of
from tests.calibration.synthetic import usual_sensors, with_drums
from tests.refusal import refused

COGIRO = with_drums(pulley_radius=0.04)


def asked(robot: sl.Robot, *unknowns: str | sl.Unknown, sensors: sl.Sensors | None = None) -> Parameters:
    return parameters_of(robot, unknowns, sensors or usual_sensors(), counted=True)


def test_priors_come_from_the_call_then_the_robot_file_then_the_defaults() -> None:
    told = COGIRO.replace(tolerances={"frame_anchors": [0.01, 0.02, 0.03], "mass": 2.0})
    own = asked(told, "frame_anchors", "mass", "center_of_mass")
    np.testing.assert_array_equal(own.prior_deviation[:24], np.tile([0.01, 0.02, 0.03], 8))
    assert own.prior_deviation[24] == 2.0  # kg: tolerances have units
    np.testing.assert_array_equal(own.stated, [True] * 25 + [False] * 3)
    np.testing.assert_array_equal(own.prior_deviation[25:], 0.05)
    over = asked(told, sl.Unknown("frame_anchors", deviation=0.5), sl.Unknown("mass", deviation=0.1))
    np.testing.assert_array_equal(over.prior_deviation[:24], 0.5)
    assert over.prior_deviation[24] == pytest.approx(0.1 * told.mass)  # relative, as in the unknown
    assert over.stated.all()


def test_assumed_values_have_wider_priors() -> None:
    known, guessed = (
        asked(COGIRO.replace(assumed=assumed), "center_of_mass", "mass")
        for assumed in ({}, {"center_of_mass": "nobody says"})
    )
    np.testing.assert_array_equal(known.prior_deviation[:3], 0.05)
    np.testing.assert_array_equal(guessed.prior_deviation[:3], 0.2)
    assert guessed.prior_deviation[3] == known.prior_deviation[3]
    assert not guessed.stated.any()


@pytest.mark.parametrize(("name", "value"), [("axial_stiffness", 1e4), ("pulley_radius", 1e-3)])
def test_cables_share_a_parameter_only_with_equal_values_and_priors(name: str, value: float) -> None:
    assert asked(COGIRO, name).labels == (name,)
    each = value * np.arange(1, 9)
    apart = asked(COGIRO.replace(tolerances={name: each}), name)
    assert apart.labels == tuple(f"{name}[{k}]" for k in range(8))
    np.testing.assert_array_equal(apart.prior_deviation, each)
    with refused(f"unknown: {name}", "shared", kind=InvalidValueError):
        asked(COGIRO.replace(tolerances={name: each}), sl.Unknown(name, shared=True))


@pytest.mark.parametrize("name", ["load_cell_gain", "load_cell_bias"])
def test_a_parameter_without_a_sensor_or_a_prior_is_refused(name: str) -> None:
    blind = sl.Sensors(position_deviation=1e-3)
    with refused(f"unknown: {name}", "observed by no reading", "load cells in the log", kind=InvalidValueError):
        asked(COGIRO, name, sensors=blind)
    assert asked(COGIRO, sl.Unknown(name, deviation=0.2), sensors=blind).prior_deviation[0] == 0.2
    assert asked(COGIRO.replace(tolerances={name: 0.1}), name, sensors=blind).prior_deviation[0] == 0.1


@pytest.mark.parametrize("item", [np.ones(3), np.ones((3, 3)), 1, None, ["mass"]])
def test_items_that_are_no_unknowns_are_refused(item: object) -> None:
    with refused("unknown", kind=InvalidValueError):
        checked_unknowns([item], usual_sensors(), counted=False)  # type: ignore[list-item]
