"""Numbers of docs/winches.md: the errors without a pulley model, and the errors of the straight formula for pulleys."""

import re
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.core.arrays import Array
from tests.examples.test_commands import lines_of
from tests.tiers import extended
from tools.pages.snippets import BLOCK, executed

pytestmark = extended
ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "winches.md").read_text(encoding="utf-8")
PROSE = re.sub(r"\s+", " ", PAGE)
ROBOTS = ("cogiro", "article-prototype", "ipanema-1", "expo2015-lucia")
PULLEYS = sl.Winch(0.05)
RISING = sl.Winch(0.05, dead_cable=3.0, dead_rise=3.0)


def is_stated(*parts: str) -> bool:
    """True if one sentence of the page has all the parts."""
    return any(all(part in sentence for part in parts) for sentence in re.split(r"[.:;] ", PROSE))


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Any]]:
    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path_factory.mktemp("example"))
        yield runpy.run_path(str(ROOT / "examples" / "pulleys_left_out.py"))


def test_the_table_has_the_numbers_of_the_example(example: dict[str, Any]) -> None:
    rows = [re.split(r" *\| *", line)[1:-1] for line in PAGE.splitlines() if re.match(r"\| (position|`)", line)]
    head = next(row for row in rows if row[0].startswith("position error"))
    table = {row[0].strip("`"): row[1:] for row in rows if row[0].strip("`") in ROBOTS}
    assert head[1:] == list(example["left_out"])
    assert list(table) == list(example["found"]) == list(ROBOTS)
    for name, cells in table.items():
        assert cells == [f"{row.mean():.1f}, {row.max():.0f}" for row in example["found"][name]]
    assert {row.size for rows in example["found"].values() for row in rows} == {405}
    assert is_stated("405 level")
    assert Path("pulleys_left_out.png").stat().st_size > 10_000


def test_the_commands_lead_from_homing_to_poses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The code blocks of the page, and then its commands, in a folder with the files of `sagline examples`."""
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["examples", "--out", "."]).exit_code == 0
    page = (ROOT / "docs" / "winches.md").read_text(encoding="utf-8")
    commands = next(found for found in BLOCK.finditer(page) if found["kind"] == "sh")
    executed(page[: commands.start()], "winches.md")
    lines = lines_of(commands["text"])
    assert [words[0] for words in lines] == ["track", "encoder", "forward"]
    for words in lines:
        result = CliRunner().invoke(app, [*words, "--no-figures"] if words[0] == "track" else words)
        assert result.exit_code == 0, result.output
    plan = sl.load_plan("output/my-robot-catenary.nc")
    counts = np.loadtxt("counts.csv", delimiter=",", skiprows=1)[:, 1:]
    np.testing.assert_array_equal(counts, sl.encoder_counts(plan))
    found = np.loadtxt("output/my-robot-poses.csv", delimiter=",", skiprows=1, usecols=(1, 2, 3))
    np.testing.assert_allclose(found[[0, -1]], plan.state.pose.position[[0, -1]], atol=2e-5)  # at rest


def test_twice_the_radius_costs_about_twice_as_much(example: dict[str, Any]) -> None:
    for narrow, wide, _dead in example["found"].values():
        assert wide.mean() == pytest.approx(2.0 * narrow.mean(), rel=0.03)


def box(name: str) -> tuple[sl.Robot, sl.Pose, sl.Pose]:
    """A robot, the poses of the example, and the middle of its box."""
    robot = sl.load_robot(name)
    assert robot.test_box is not None
    low, high = robot.test_box.low, robot.test_box.high
    grid = np.stack(np.meshgrid(*map(np.linspace, low, high, (9, 9, 5))), axis=-1).reshape(-1, 3)
    return robot, sl.Pose.from_euler(grid, 0.0, 0.0, 0.0), sl.Pose.from_euler(0.5 * (low + high), 0.0, 0.0, 0.0)


def straight_formula(robot: sl.Robot, pose: sl.Pose, tension: Array) -> tuple[Array, Array]:
    """Wrap angles and lengths if the cables leave the pulleys as straight cables and then sag.

    The angle is that of the line from the center of the pulley to the platform end, less the angle between this line
    and the radius to the point of tangency. The cable after the pulley is stretched by the tension at the exit.
    """
    winches = robot.winches
    assert winches is not None
    along = pose.transform(robot.platform_anchors) - robot.frame_anchors
    radius = winches.pulley_radius
    across, drop = np.hypot(along[..., 0], along[..., 1]) - radius, -along[..., 2]
    wrap = 0.5 * np.pi + np.arctan2(drop, across) + np.arcsin(radius / np.hypot(across, drop))
    span, rise = across + radius * np.cos(wrap), -drop - radius * np.sin(wrap)
    free = sl.Catenary().from_tension(robot.cables, span, rise, tension)
    strain = free.frame_end_tension / robot.cables.axial_stiffness
    return wrap, free.unstrained_length + (radius * wrap + winches.dead_cable) / (1.0 + strain)


def off_by(name: str, winch: sl.Winch, *, zeroed: bool = False) -> tuple[float, float]:
    """Largest error of the platform [um] at lengths by the straight formula, and of the wrap angle [deg]."""
    robot, poses, home = box(name)
    real = robot.replace(winches=winch)
    plan, at_home = sl.inverse(real, poses), sl.inverse(real, home)
    wrap, lengths = straight_formula(real, poses, plan.chord_tension)
    if zeroed:
        lengths = lengths + (at_home.unstrained_length - straight_formula(real, home, at_home.chord_tension)[1])
    found = sl.forward(real, lengths, start=poses)
    assert found.solved.all()
    error = np.linalg.norm(found.pose.position - poses.position, axis=1).max()
    assert plan.wrap_angle is not None
    return float(1e6 * error), float(np.degrees(np.abs(wrap - plan.wrap_angle).max()))


def test_the_error_of_the_straight_formula_is_that_on_the_page() -> None:
    without = [off_by(name, PULLEYS) for name in ROBOTS]
    assert is_stated("angle", f"{max(angle for _, angle in without):.1f}°")
    assert is_stated(f"most {max(error for error, _ in without):.1f} µm", "exact position")
    rising = {name: off_by(name, RISING)[0] for name in ROBOTS}
    soft = rising.pop("article-prototype")
    assert is_stated(f"{1e-3 * soft:.2f} mm on the prototype", f"most {1e-3 * max(rising.values()):.2f} mm")
    zeroed = max(off_by(name, RISING, zeroed=True)[0] for name in ROBOTS)
    assert is_stated("at home", f"{zeroed:.0f} µm")
