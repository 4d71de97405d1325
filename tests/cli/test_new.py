"""`sagline new`: the robot file, its summary, and refusals."""

import os
import pty
import re
import subprocess
import sys
from contextlib import suppress
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cables.cable import ROPES
from sagline.cli.main import app
from sagline.cli.new import GRID, ROPE_NAMES
from sagline.robot.catalogue import Design
from sagline.robot.pose import level_grid
from tests.tiers import extended


@pytest.fixture(autouse=True)
def folder(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> FilePath:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def new(*words: str) -> Any:
    return CliRunner().invoke(app, ["new", *words], input="\n" * 9)  # default answers to all questions


def test_options_define_the_robot(folder: FilePath) -> None:
    result = new(
        *("mine.yaml", "--frame", "15 x 11 x 6 m", "--platform", "30cm x 30 cm x 0.5 m", "--mass", "50 kg"),
        *("--layout", "mixed", "--rope", "steel-6x19", "--diameter", "3 mm"),
    )
    assert result.exit_code == 0
    robot = sl.load_robot(folder / "mine.yaml")
    mixed = sl.load_robot("article-mixed")  # the same frame, platform and layout, with another order of the cables
    order = [0, 2, 4, 6, 1, 3, 5, 7]
    assert robot.frame_anchors == pytest.approx(mixed.frame_anchors[order])
    assert robot.platform_anchors == pytest.approx(mixed.platform_anchors[order])
    assert robot.inertia == pytest.approx(mixed.inertia)
    assert robot.cables.linear_density == pytest.approx(np.full(8, 0.036))  # 0.400 kg/(100 m mm^2) x 9 mm^2
    assert robot.cables.axial_stiffness == pytest.approx(np.full(8, 100e9 * 0.449 * 9e-6))
    assert robot.tension_max == pytest.approx(np.full(8, 0.356 * 1770e6 * 9e-6 / 5.0))
    assert robot.tension_min == pytest.approx(np.full(8, 0.05 * 50.0 * 9.81))


def test_the_summary_has_the_feasible_share_of_the_middle(folder: FilePath) -> None:
    result = new("mine.yaml", "--cables", "6")
    robot = sl.load_robot(folder / "mine.yaml")
    half = 0.25 * (np.array([6.0, 4.0, 3.0]) - [0.5, 0.5, 0.4])
    axes = [np.linspace(m - h, m + h, 7) for m, h in zip([0.0, 0.0, 1.5], half, strict=True)]
    places = np.array(np.meshgrid(*axes)).reshape(3, -1).T
    share = np.mean([bool(sl.inverse(robot, sl.Pose(place, np.eye(3))).feasible) for place in places])
    assert 0.0 < share < 1.0
    assert f"{100 * share:.0f} % of " in result.stdout
    assert "Advice" in result.stderr


def test_the_recommended_box_is_feasible(folder: FilePath) -> None:
    assert new("mine.yaml").exit_code == 0
    robot = sl.load_robot(folder / "mine.yaml")
    assert robot.test_box is not None
    assert sl.inverse(robot, level_grid(robot.test_box, GRID)).feasible.mean() >= 0.95


def test_the_end_of_the_input_is_an_error(folder: FilePath) -> None:
    keys = ("frame", "layout", "cables", "platform", "mass", "rope", "diameter")
    for count, key in enumerate(keys):
        result = CliRunner().invoke(app, ["new", "mine.yaml"], input="\n" * count)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"Error: --{key} ")
        assert f"Add --{key} " in result.stderr
        assert (result.stdout, result.stderr.count("\n")) == ("", 1)
        assert list(folder.iterdir()) == []
    assert CliRunner().invoke(app, ["new", "mine.yaml"], input="5 x 5 x 3 m\n" + "\n" * 6).exit_code == 0
    frame = sl.load_robot(folder / "mine.yaml").frame_size
    np.testing.assert_array_equal(frame, [5.0, 5.0, 3.0])


def test_no_file_is_replaced_without_permission(folder: FilePath) -> None:
    (folder / "mine.yaml").write_text("precious")
    assert new("mine.yaml").exit_code == 2
    assert (folder / "mine.yaml").read_text() == "precious"
    assert new("mine.yaml", "--force").exit_code == 0
    assert sl.load_robot(folder / "mine.yaml").name == "mine"


def test_answers_are_not_read_as_yaml(folder: FilePath) -> None:
    assert new("mine.yaml", "--mass", "30\nname: 'evil'").exit_code == 2
    assert new("mine.yaml", "--mass", "30 \n kg").exit_code == 0
    assert not re.search(r"^ *kg", (folder / "mine.yaml").read_text(), re.MULTILINE)


@pytest.mark.parametrize(("layout", "cables"), [("top", 8), ("top", 6), ("mixed", 8), ("mixed", 7)])
def test_every_layout_is_feasible_somewhere(layout: str, cables: int) -> None:
    design = Design("x", [6.0, 4.0, 3.0], [0.5, 0.5, 0.4], 30.0, diameter=0.004, cables=cables, layout=layout)
    robot = design.robot()
    assert robot.cable_count == cables
    assert sl.inverse(robot, level_grid(design.placed(0.5), GRID)).feasible.mean() > 0.2


def test_ropes_agree_with_the_table_of_a_manufacturer() -> None:
    # 6x19 IWRC 10 mm, grade 1770, EN 12385-4: 40.0 kg/100 m, 63.0 kN
    steel = ROPES["steel-6x19"]
    assert float(steel.cable(0.010).linear_density) == pytest.approx(0.400)
    assert steel.breaking_force(0.010) == pytest.approx(63.0e3, rel=1e-3)
    # a polyethylene braid is lighter and stronger for its weight than steel
    braid = ROPES["dyneema-sk78"]
    assert braid.strength_factor / braid.density_factor > 5.0 * steel.strength_factor / steel.density_factor


def on_terminal(folder: FilePath, *answers: str) -> tuple[int, str]:
    """Output of `sagline new` on a terminal with typed answers."""
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "sagline.cli", "new", "mine.yaml"],
        cwd=folder,
        stdin=follower,
        stdout=follower,
        stderr=follower,
    )
    os.close(follower)
    os.write(leader, "".join(f"{answer}\n" for answer in answers).encode())
    text = b""
    with suppress(OSError):  # the other end is closed
        while part := os.read(leader, 65536):
            text += part
    os.close(leader)
    return process.wait(), " ".join(re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text.decode()).split())


@extended
def test_an_invalid_answer_is_refused_at_once_and_asked_again(folder: FilePath) -> None:
    code, said = on_terminal(
        folder,
        *("3 x 2", "4 x 4 x 0 m", "4 x 4 x 3 m", "bottom", "top", "7", "6", "9 x 1 x 1 m", "0.4 x 0.4 x 0.3 m"),
        *("heavy", "0 kg", "20 kg", "string", "steel-6x19", "3 kg", "0.1 mm", "3 mm"),
    )
    assert code == 0, said
    robot = sl.load_robot(folder / "mine.yaml")
    assert (robot.cable_count, robot.mass) == (6, 20.0)
    assert robot.frame_size is not None
    np.testing.assert_allclose(robot.frame_size, [4.0, 4.0, 3.0])
    wrong = re.findall(r"No: (\S+)", said)
    assert wrong == [
        *("frame", "frame[2]", "layout", "cables", "platform[0]", "mass", "mass", "rope", "diameter", "diameter"),
    ]


def test_options_are_checked_before_the_first_question(folder: FilePath) -> None:
    for option, value in (("--frame", "3 x 2"), ("--mass", "nan"), ("--cables", "eight"), ("--mass", "")):
        result = new("mine.yaml", option, value)
        assert result.exit_code == 2
        assert result.stderr.startswith("Error: ")
        assert list(folder.iterdir()) == []


def test_the_question_names_all_ropes() -> None:
    assert ", ".join(ROPES) == ROPE_NAMES
