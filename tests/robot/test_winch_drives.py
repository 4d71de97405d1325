"""The catalogue of drives compared with other numbers of the data sheets: other units, efficiencies, accelerations."""

from collections.abc import Callable

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused

POUND_INCH = 0.112984829  # N m
# of the same sheet: rated and peak torque [lb in], inertia [1e-3 lb in s^2], rated angular acceleration [rad/s^2]
SHEET_SGMSH = {
    "10aa": (28.2, 84.4, 1.54, 18250.0),
    "15aa": (43.0, 130.0, 2.19, 19840.0),
    "20aa": (56.4, 169.0, 2.82, 19970.0),
    "30aa": (87.0, 260.0, 6.20, 14000.0),
    "40aa": (112.0, 336.0, 8.50, 13160.0),
    "50aa": (140.0, 422.0, 10.90, 12780.0),
}
# of the same sheet: rated torque of the motor [N m], efficiency of the gear, inertia of the gear [1e-4 kg m^2], largest
# speed at the output [1/min]
SHEET_SGMAH = {
    "a3aj1": (0.0955, 0.50, 0.028, 800.0),
    "a3aj3": (0.0955, 0.70, 0.016, 387.0),
    "a3ajc": (0.0955, 0.80, 0.007, 190.0),
    "a3aj7": (0.0955, 0.80, 0.005, 121.0),
    "a5aj1": (0.159, 0.70, 0.028, 800.0),
    "a5aj3": (0.159, 0.70, 0.018, 387.0),
    "a5ajc": (0.159, 0.80, 0.014, 190.0),
    "a5aj7": (0.159, 0.80, 0.010, 121.0),
    "01aj1": (0.318, 0.80, 0.063, 800.0),
    "01aj3": (0.318, 0.80, 0.018, 387.0),
    "01ajc": (0.318, 0.80, 0.035, 190.0),
    "01aj7": (0.318, 0.80, 0.021, 121.0),
    "02aj1": (0.637, 0.80, 0.193, 800.0),
}


@pytest.mark.parametrize("model", SHEET_SGMSH)
def test_motors_agree_with_the_sheet_in_other_units(model: str) -> None:
    rated, peak, inertia, acceleration = SHEET_SGMSH[model]
    drive = sl.winch_drive(f"yaskawa-sgmsh-{model}")
    assert drive.rated_torque == pytest.approx(rated * POUND_INCH, rel=1e-2)
    assert drive.torque_limit == pytest.approx(peak * POUND_INCH, rel=1e-2)
    assert drive.inertia == pytest.approx(1e-3 * inertia * POUND_INCH, rel=1e-2)
    assert drive.rated_torque / drive.inertia == pytest.approx(acceleration, rel=1e-2)
    assert drive.speed_limit == pytest.approx(5000.0 / 60.0 * 2.0 * np.pi)


@pytest.mark.parametrize("model", SHEET_SGMAH)
def test_geared_motors_agree_with_the_sheet(model: str) -> None:
    rated, efficiency, of_gear, fastest = SHEET_SGMAH[model]
    drive = sl.winch_drive(f"yaskawa-sgmah-{model}")
    assert drive.rated_torque == pytest.approx(rated * efficiency, rel=1e-2)
    assert drive.speed_limit / drive.gear == pytest.approx(fastest / 60.0 * 2.0 * np.pi, rel=5e-3)
    alone = {"a3": 0.0166e-4, "a5": 0.022e-4, "01": 0.036e-4, "02": 0.106e-4}[model[:2]]  # the rotors are the same
    assert drive.inertia == pytest.approx(alone + 1e-4 * of_gear, abs=0.7e-7)


def test_every_drive_has_its_source() -> None:
    names = {f"yaskawa-sgmah-{model}" for model in SHEET_SGMAH} | {f"yaskawa-sgmsh-{model}" for model in SHEET_SGMSH}
    assert set(sl.winch_drive_names()) == names
    assert all(sl.winch_drive(name).source.startswith("Yaskawa") for name in names)


def test_a_winch_has_the_drive_and_its_drum() -> None:
    drive = sl.winch_drive("yaskawa-sgmah-02aj1")
    winch = drive.winch(0.04, drum_inertia=2e-3, position_gain=20.0, counts_per_turn=8192.0)
    assert winch.inertia is not None
    assert winch.torque_limit is not None
    assert winch.inertia == pytest.approx(0.299e-4 + 2e-3 / 25.0)
    assert winch.torque_limit * winch.gear == pytest.approx(8.60)
    assert winch.position_gain == 20.0
    assert winch.drum_radius == 0.04


def test_refusals() -> None:
    drive = sl.winch_drive("yaskawa-sgmsh-10aa")
    known = "one of the 19 drives of the catalogue"
    others = "a field of Winch other than gear, inertia, torque_limit, speed_limit"
    cases: tuple[tuple[Callable[[], object], tuple[str, ...], str], ...] = (
        (lambda: sl.winch_drive("yaskawa-sgmsh-10a"), ("name", "'yaskawa-sgmsh-10a'", known), "yaskawa-sgmsh-10aa?"),
        (lambda: sl.winch_drive("x"), ("name", "'x'", known), "winch_drive_names()"),
        (lambda: drive.winch(0.0), ("drum_radius", "0 m", "> 0 m, finite"), ""),
        (lambda: drive.winch(0.05, -1.0), ("drum_inertia", "-1 kg m^2", ">= 0 kg m^2, finite"), ""),
        (lambda: drive.winch(0.05, gear=3.0), ("field", "'gear'", others), ""),
        (lambda: drive.winch(0.05, teeth=3.0), ("field", "'teeth'", others), ""),
    )
    for call, parts, hint in cases:
        with refused(*parts, kind=sl.InvalidValueError) as caught:
            call()
        assert hint in caught.value.next_step
