"""Numbers of docs/vibration.md, computed again."""

import re
from pathlib import Path

import numpy as np
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from tests.tiers import extended

pytestmark = extended

PAGE = (Path(__file__).parents[2] / "docs" / "vibration.md").read_text()
ROW = re.compile(r"^\| ([\d.]+) \| ([\d.]+) \| (\d+) % \|", re.MULTILINE)


def middle_of(robot: sl.Robot) -> sl.Pose:
    assert robot.test_box is not None
    return sl.Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))


def middle_state() -> sl.Equilibrium:
    robot = sl.load_robot("cogiro")
    return sl.inverse(robot, sl.Pose([0.0, 0.0, 2.0], np.eye(3))).state


def test_modes_with_cable_mass_nearest_to_the_massless_modes() -> None:
    """For each massless mode, the mode with cable mass of the largest mass-weighted overlap."""
    state = middle_state()
    massless, found = sl.modes(state), sl.vibration(state, up_to=20.0)
    rows = [(float(low), float(high), int(share)) for low, high, share in ROW.findall(PAGE)]
    assert [round(x, 3) for x in massless.frequency] == [row[0] for row in rows]
    mass = np.linalg.inv(massless.shape @ massless.shape.T)
    shares = found.shape.T @ mass @ massless.shape
    most = np.argmax(shares**2, axis=0)
    assert [round(x, 3) for x in found.frequency[most]] == [row[1] for row in rows]
    assert (100 * shares[most, np.arange(6)] ** 2).round().astype(int).tolist() == [row[2] for row in rows]


def test_the_peak_is_lower_by_the_printed_ratio() -> None:
    state = middle_state()
    frequency = np.linspace(3.5, 4.2, 351)
    answer = sl.frequency_response(state, frequency, sl.Damping(modal_damping=0.01))
    heavy, light = np.abs(answer.compliance[:, 2, 2]).max(), np.abs(answer.massless_compliance[:, 2, 2])
    assert f"at {frequency[np.argmax(light)]:.2f} Hz" in PAGE
    assert f"is {heavy / light.max():.2f} times" in PAGE.replace("\n", " ")


def test_string_frequencies_of_the_presets(snapshot: SnapshotAssertion) -> None:
    assert re.findall(r"[^.]*these six[^.]*\.", " ".join(PAGE.split())) == snapshot
    robots = [sl.load_robot(name) for name in sl.robot_names()]
    above = [sl.modes(sl.inverse(robot, middle_of(robot)).state).above_strings for robot in robots]
    assert all(flags.any() for flags in above)
    assert any(flags.all() for flags in above)
