"""Texts of the panels."""

import re
from dataclasses import replace

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import readout
from sagline.viewer.page import home_pose
from sagline.viewer.robot_scene import ACTUAL, INFEASIBLE, PLATFORM, REST, WANTED
from sagline.viewer.snapshot import MissingWrench, Settings, snapshot_at
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.timeline import COLORS

ROBOT = sl.load_robot("article-suspended")
SCALE = TensionScale.of(ROBOT)


def cells(html: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", html)
    return [[re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)] for row in rows if "<td" in row]


def test_the_table_has_the_numbers_of_every_cable() -> None:
    snapshot = snapshot_at(ROBOT, sl.Pose([1.0, 0.5, 2.0], np.eye(3)), Settings(mass=50.0), None)
    plan = sl.inverse(ROBOT, sl.Pose([1.0, 0.5, 2.0], np.eye(3)))
    frequency = sl.modes(plan.state).frequency
    html = readout.numbers_html(snapshot, SCALE, frequency)
    rows = cells(html)
    assert [row[0].split()[-1] for row in rows] == [str(i) for i in range(8)]
    told = np.array([[float(cell) for cell in row[1:]] for row in rows])
    cables = plan.state.cables
    limits = np.minimum(cables.chord_tension - 25.0, 2000.0 - cables.chord_tension)
    columns = (cables.chord_tension, cables.frame_end_tension, cables.unstrained_length, 1e3 * cables.sag, limits)
    for column, (values, places) in enumerate(zip(columns, (1, 1, 4, 1, 1), strict=True)):
        assert told[:, column] == pytest.approx(values, abs=0.5001 * 10.0**-places)
    assert ", ".join(f"{value:.2f}" for value in frequency) + " Hz" in re.sub("<[^>]*>", "", html)


def test_the_verdict_names_the_cable_that_is_nearest_to_its_limit() -> None:
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    tension = sl.inverse(ROBOT, pose).chord_tension
    margins = np.minimum(tension - 25.0, 2000.0 - tension)
    text = readout.verdict(snapshot_at(ROBOT, pose, Settings(mass=50.0), None))
    assert f"{tension.min():.1f} to {tension.max():.1f} N" in text
    nearest = int(np.argmin(margins))
    told = dict(re.findall("<dt>(.*?)</dt><dd>(.*?)</dd>", text))
    assert told["Nearest limit"].startswith(f"{margins.min():.1f} N ")
    assert f"cable {nearest}, lower" in told["Nearest limit"]
    extra = float(sl.capacity_margin(sl.inverse(ROBOT, pose).state))
    assert told["Spare force"].startswith(f"{extra:.1f} N")


def test_a_margin_of_zero_is_shown_as_a_reached_limit() -> None:
    robot = sl.load_robot("article-mixed")
    pose = sl.Pose([0.0, 0.0, 3.0], np.eye(3))
    tension = sl.inverse(robot, pose).chord_tension
    at = ", ".join(str(i) for i in np.flatnonzero(np.abs(tension - 25.0) < 1e-6))
    assert at == "1, 3, 5, 7"
    assert f"cables {at}</dd>" in readout.verdict(snapshot_at(robot, pose, Settings(mass=50.0), None))


@pytest.mark.parametrize(
    ("away", "told"),
    [(3e-13, "at"), (2e-6, "2 μm from"), (1.5e-3, "1.5 mm from")],
)
def test_rounding_is_not_shown_as_a_distance(away: float, told: str) -> None:
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    rest = sl.Pose([1.0, 0.5, 2.0 + away], np.eye(3))
    snapshot = replace(snapshot_at(ROBOT, pose, Settings(mass=50.0), None), rest=rest)
    text = readout.verdict(snapshot).replace("\u00a0", " ").replace("\u202f", " ").replace("\u00b5", "μ")
    assert dict(re.findall("<dt>(.*?)</dt><dd>(.*?)</dd>", text))["Equilibrium"].startswith(told)


def test_only_proved_poses_are_called_infeasible() -> None:
    on_anchor = snapshot_at(
        ROBOT, sl.Pose(ROBOT.frame_anchors[0] - ROBOT.platform_anchors[0], np.eye(3)), Settings(mass=50.0), None
    )
    assert readout.headline(on_anchor) == "No chord"
    assert "coincide" in readout.verdict(on_anchor)


def test_numbers_have_correct_signs_and_fit_their_columns() -> None:
    turned = sl.Pose.from_euler([-1e-5, 0.0, 1.0], -1e-5, -1e-7, 0.0)
    text = readout.numbers_html(snapshot_at(ROBOT, turned, Settings(mass=50.0), None), SCALE, None)
    assert "-0.0" not in text
    assert "0.000, 0.000, 1.000 m" in text
    for name in sl.robot_names():
        robot = sl.load_robot(name)
        shown = readout.numbers_html(snapshot_at(robot, home_pose(robot), Settings(mass=robot.mass), None), SCALE, None)
        assert max(len(cell) for row in cells(shown) for cell in row) <= 8
        assert "e+" not in shown


def test_infeasible_pose_shows_a_compromise_or_dashes_and_the_reason() -> None:
    snapshot = snapshot_at(ROBOT, sl.Pose([7.2, 3.0, 1.5], np.eye(3)), Settings(mass=50.0), None)
    missing = MissingWrench.of(snapshot)
    assert missing is not None
    html = readout.numbers_html(snapshot, SCALE, None, missing.state)
    told = np.array([[float(cell) for cell in row[1:]] for row in cells(html)])
    assert told[:, 0] == pytest.approx(missing.state.chord_tension, abs=0.0501)
    assert np.all(told[:, 0] >= ROBOT.tension_min - 0.1)  # the limits hold, and the missing force is not balanced
    assert told[list(missing.limits), 4] == pytest.approx(0.0, abs=0.1)
    assert "compromise" in html
    assert all(cell == "–" for row in cells(readout.numbers_html(snapshot, SCALE, None)) for cell in row[1:])
    assert "Not feasible" in readout.verdict(snapshot)
    assert snapshot.reason in readout.verdict(snapshot)


def test_messages_are_escaped() -> None:
    assert "<script>" not in readout.refused("<script>alert(1)</script>")


def test_the_legend_has_its_ticks_in_their_places() -> None:
    found = re.findall(r"left:([\d.]+)%[^>]*>([\d.]+)<", readout.legend(SCALE, ROBOT))
    assert [text for _, text in found] == ["50", "100", "200", "500", "1000", "2000"]
    values = [float(text) for _, text in found]
    places = 100.0 * np.log(np.array(values) / 25.0) / np.log(2000.0 / 25.0)
    assert [float(place) for place, _ in found] == pytest.approx(places, abs=0.06)


def test_colors_of_cables_are_unique() -> None:
    other = np.array([WANTED, ACTUAL, INFEASIBLE, PLATFORM, REST])
    lines = np.array([[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in COLORS])
    scale = SCALE.colors(np.geomspace(25.0, 2000.0, 60))
    assert np.linalg.norm(lines[:, None] - other, axis=2).min() > 40.0
    assert np.linalg.norm(lines[:, None].astype(float) - scale, axis=2).min() > 40.0
    assert np.linalg.norm(lines[:, None] - lines, axis=2)[~np.eye(len(lines), dtype=bool)].min() > 40.0


def test_robots_with_pulleys_show_wraps_and_all_cable_off_the_drum() -> None:
    robot = ROBOT.replace(winches=sl.Winch(pulley_radius=[0.0] + [0.2] * 7, dead_cable=4.0, dead_rise=1.0))
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    html = readout.numbers_html(snapshot_at(robot, pose, Settings(mass=50.0), None), SCALE, None)
    plan = sl.inverse(robot, pose)
    assert plan.wrap_angle is not None
    told = cells(html)
    assert [float(row[3]) for row in told] == pytest.approx(plan.unstrained_length, abs=5.01e-5)
    assert told[0][6] == "–"
    assert [float(row[6]) for row in told[1:]] == pytest.approx(np.degrees(plan.wrap_angle[1:]), abs=0.0501)
    plain_spaces = html.replace("\N{NO-BREAK SPACE}", " ")
    assert "radius 0 m to 0.2 m, " in plain_spaces
    assert "dead cable 4 m, drawn" in plain_spaces
    assert "not known" not in readout.numbers_html(
        snapshot_at(robot.replace(winches=sl.Winch(pulley_radius=0.2)), pose, Settings(mass=50.0), None), SCALE, None
    )
    plain = readout.numbers_html(snapshot_at(ROBOT, pose, Settings(mass=50.0), None), SCALE, None)
    assert "wrap" not in plain
    assert "Pulleys" not in plain
