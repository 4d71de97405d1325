"""What the panels say."""

import re

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import readout
from sagline.viewer.course_figure import BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH, CourseFigure
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import taken_at
from sagline.viewer.tension_scale import TensionScale

ROBOT = sl.load_robot("article-suspended")
SCALE = TensionScale.of(ROBOT)


def cells(html: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(.*?)</tr>", html)
    return [[re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)] for row in rows if "<td" in row]


def test_table_holds_the_numbers_of_every_cable() -> None:
    snapshot = taken_at(ROBOT, sl.Pose([1.0, 0.5, 2.0], np.eye(3)), Settings(mass=50.0), None)
    plan = sl.inverse(ROBOT, sl.Pose([1.0, 0.5, 2.0], np.eye(3)))
    frequency = sl.modes(plan.state).frequency
    html = readout.numbers(snapshot, SCALE, frequency)
    rows = cells(html)
    assert [row[0].split()[-1] for row in rows] == [str(i) for i in range(8)]
    told = np.array([[float(cell) for cell in row[1:]] for row in rows])
    cables = plan.state.cables
    limits = np.minimum(cables.chord_tension - 25.0, 2000.0 - cables.chord_tension)
    columns = (cables.chord_tension, cables.frame_end_tension, cables.unstrained_length, 1e3 * cables.sag, limits)
    for column, (values, places) in enumerate(zip(columns, (1, 1, 4, 1, 1), strict=True)):
        assert told[:, column] == pytest.approx(values, abs=0.5001 * 10.0**-places)
    assert ", ".join(f"{value:.2f}" for value in frequency) + " Hz" in html


def test_the_verdict_names_the_cable_that_is_nearest_to_its_limit() -> None:
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    tension = sl.inverse(ROBOT, pose).chord_tension
    margins = np.minimum(tension - 25.0, 2000.0 - tension)
    text = readout.verdict(taken_at(ROBOT, pose, Settings(mass=50.0), None))
    assert f"tensions {tension.min():.4g} to {tension.max():.4g} N" in text
    assert f"margin {margins.min():.1f} N (cable {int(np.argmin(margins))})" in text
    assert f"takes {float(sl.capacity_margin(sl.inverse(ROBOT, pose).state)):.1f} N more" in text


def test_infeasible_pose_shows_dashes_and_the_reason() -> None:
    snapshot = taken_at(ROBOT, sl.Pose([7.2, 3.0, 1.5], np.eye(3)), Settings(mass=50.0), None)
    assert all(cell == "–" for row in cells(readout.numbers(snapshot, SCALE, None)) for cell in row[1:])
    assert "Not feasible" in readout.verdict(snapshot)
    assert snapshot.reason in readout.verdict(snapshot)


def test_messages_are_no_markup() -> None:
    assert "<script>" not in readout.refused("<script>alert(1)</script>")


def test_legend_names_its_ticks_in_their_places() -> None:
    found = re.findall(r"left:([\d.]+)%[^>]*>([\d.k]+)<", readout.legend(SCALE))
    assert [text for _, text in found] == ["50", "100", "200", "500", "1k", "2k"]
    values = [float(text.replace("k", "e3")) for _, text in found]
    places = 100.0 * np.log(np.array(values) / 25.0) / np.log(2000.0 / 25.0)
    assert [float(place) for place, _ in found] == pytest.approx(places, abs=0.06)


def test_course_draws_gaps_as_gaps_and_its_cursor_in_place() -> None:
    time = np.linspace(0.0, 10.0, 101)
    values = np.stack((time, 10.0 - time), axis=1)
    values[40:60, 1] = np.nan
    figure = CourseFigure.of("Length [m]", time, values)
    lines = re.findall(r'<polyline points="(.*?)"', figure.at(2.5))
    assert len(lines) == 3
    first = np.array([[float(part) for part in point.split(",")] for point in lines[0].split()])
    low, high = -0.4, 10.4
    assert first[:, 1] == pytest.approx(
        HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (time - low) / (high - low), abs=0.06
    )
    cursor = re.search(r'<line x1="([\d.]+)" x2="\1" y1="18"', figure.at(2.5))
    assert cursor is not None
    assert float(cursor[1]) == pytest.approx(LEFT + 0.25 * (WIDTH - LEFT - RIGHT))


def test_until_the_first_numbers_the_page_says_what_it_waits_for() -> None:
    assert "Getting ready" in readout.waiting()
    assert "compiles" in readout.waiting()
