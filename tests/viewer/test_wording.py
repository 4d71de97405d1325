"""Notation of numbers and names."""

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.snapshot import METHODS, MODELS, Settings, depends_on_history, model_name, snapshot_at
from sagline.viewer.tension_scale import ForceUnit, number_text


@pytest.mark.parametrize("value", [-0.04, -1e-300, -0.0, 0.0, 0.049])
def test_numbers_rounded_to_zero_have_no_sign(value: float) -> None:
    assert number_text(value, ".1f") == "0.0"


def test_nan_is_a_dash() -> None:
    assert number_text(np.nan, ".1f") == number_text(np.inf, ".3f") == "–"


def test_forces_of_a_robot_keep_one_unit() -> None:
    assert ForceUnit.up_to(2000.0).written(31.27) == "31.3 N"
    assert ForceUnit.up_to(1.2e6).written(363541.3) == "363.54 kN"
    assert ForceUnit.up_to(1.2e6).written(-1e-9) == "0.00 kN"


def test_choices_have_the_names_in_the_readings() -> None:
    robot = sl.load_robot("article-suspended")
    pose = sl.Pose([0.5, 0.2, 2.0], np.eye(3))
    assert all(model_name(model) == name for name, model in MODELS.items())
    for name, method in METHODS.items():
        snapshot = snapshot_at(robot, pose, Settings(mass=50.0, tension=method), None)
        assert snapshot.origin == f"catenary (exact), {name}"


def test_by_default_tensions_do_not_depend_on_the_path() -> None:
    assert not depends_on_history(Settings(mass=1.0).tension)
    assert not depends_on_history(next(iter(METHODS.values())))
    (name,) = (name for name, method in METHODS.items() if depends_on_history(method))
    assert name.startswith("Closest (")
