"""The numbers of docs/vibration.md, worked out again."""

import re
from pathlib import Path

import numpy as np

import sagline as sl
from sagline.cli.values import middle_of
from sagline.statics.stiffness import mass_matrix

PAGE = (Path(__file__).parents[2] / "docs" / "vibration.md").read_text()
ROW = re.compile(r"^\| ([\d.]+) \| ([\d.]+) \| (\d+) % \|", re.MULTILINE)


def hanging() -> sl.Equilibrium:
    robot = sl.load_robot("cogiro")
    return sl.inverse(robot, sl.Pose([0.0, 0.0, 2.0], np.eye(3))).state


def test_where_the_massless_modes_are_found() -> None:
    """Of each massless mode the mode with cable mass that has most of it, by their mass-weighted overlap."""
    state = hanging()
    massless, found = sl.modes(state), sl.vibration(state, up_to=20.0)
    rows = [(float(low), float(high), int(share)) for low, high, share in ROW.findall(PAGE)]
    assert [round(x, 3) for x in massless.frequency] == [row[0] for row in rows]
    shares = found.shape.T @ mass_matrix(state) @ massless.shape
    most = np.argmax(shares**2, axis=0)
    assert [round(x, 3) for x in found.frequency[most]] == [row[1] for row in rows]
    assert (100 * shares[most, np.arange(6)] ** 2).round().astype(int).tolist() == [row[2] for row in rows]


def test_how_much_lower_the_peak_is() -> None:
    state = hanging()
    frequency = np.linspace(3.5, 4.2, 351)
    answer = sl.frequency_response(state, frequency, sl.Damping(modal_damping=0.01))
    heavy, light = np.abs(answer.compliance[:, 2, 2]).max(), np.abs(answer.massless_compliance[:, 2, 2])
    assert f"has one peak, at {frequency[np.argmax(light)]:.2f} Hz" in PAGE.replace("\n", " ")
    assert f"its height is {heavy / light.max():.2f} of the massless one" in PAGE.replace("\n", " ")


def test_strings_of_the_presets() -> None:
    assert "below the highest of these six, on some below the lowest" in PAGE
    robots = [sl.load_robot(name) for name in sl.robot_names()]
    above = [sl.modes(sl.inverse(robot, middle_of(robot)).state).above_strings for robot in robots]
    assert all(flags.any() for flags in above)
    assert any(flags.all() for flags in above)
