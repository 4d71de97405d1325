import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sagline import Pose, forward, load_robot
from sagline.cli.main import app
from tests.tiers import extended

WIREX = """<models version="0.32"><robot name="swing" motionpattern="3T"><geometry>
<chain><base x="-1" y="-1" z="2" radius="0.02" a13="1" a31="-1" a33="0"/><platform x="0" y="0" z="0"/></chain>
<chain><base x="1" y="-1" z="2" radius="0.02"/><platform x="0" y="0" z="0"/></chain>
<chain><base x="0" y="1" z="2" radius="0.02"/><platform x="0" y="0" z="0"/></chain>
</geometry><platform mass="3"/></robot></models>"""


def run(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["convert", *arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def wirex(tmp_path: Path) -> Path:
    file = tmp_path / "swing.wcrfx"
    file.write_text(WIREX)
    return file


def test_a_wirex_file_becomes_a_robot_file(wirex: Path, tmp_path: Path) -> None:
    out = tmp_path / "swing.yaml"
    code, stdout, stderr = run(str(wirex), "--out", str(out))
    assert (code, stdout) == (0, "")
    assert re.search(r"^Assumed: cables: .*\b4 mm\b", stderr, re.MULTILINE)
    assert re.search(r"^Lost: .*\bchain 1\b.*\b0\.02 m\b", stderr, re.MULTILINE)
    robot = load_robot(out)
    assert robot.winches is not None
    assert robot.winches.pulley_radius.tolist() == [0.0, 0.02, 0.02]
    np.testing.assert_array_equal(robot.frame_anchors, [[-1, -1, 2], [1, -1, 2], [0, 1, 2]])
    assert (robot.mass, "cables" in robot.assumed) == (3.0, True)


def test_without_a_file_the_text_goes_to_stdout(wirex: Path, tmp_path: Path) -> None:
    _, stdout, _ = run(str(wirex), "--linear-density", "20 g/m", "--axial-stiffness", "50 kN")
    file = tmp_path / "from_stdout.yaml"
    file.write_text(stdout)
    cables = load_robot(file).cables
    np.testing.assert_allclose(cables.linear_density, [0.02] * 3, rtol=1e-15)
    np.testing.assert_allclose(cables.axial_stiffness, [50e3] * 3, rtol=1e-15)


@extended
def test_a_preset_becomes_a_mujoco_model(tmp_path: Path) -> None:
    import mujoco

    out = tmp_path / "cogiro.xml"
    code, _, _ = run("cogiro", "--format", "mjcf", "--out", str(out), "--at", "0.5", "-0.25", "2")
    model = mujoco.MjModel.from_xml_path(str(out))
    assert (code, model.ntendon) == (0, 8)
    np.testing.assert_array_equal(model.body("platform").pos, [0.5, -0.25, 2.0])


@extended
@pytest.mark.parametrize(
    ("name", "said"), [("cogiro", "0.4 mm away"), ("article-mixed", "19 mm away"), ("fast", "400 mm away")]
)
def test_the_error_of_straight_tendons_is_printed(name: str, said: str, tmp_path: Path) -> None:
    import mujoco

    robot = load_robot(name)
    assert robot.test_box is not None
    pose = Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.0, 0.0, 0.0)
    out = tmp_path / "model.xml"
    _, _, stderr = run(name, "--format", "mjcf", "--out", str(out))
    told = [line for line in stderr.splitlines() if line.startswith("Lost: Sag ")]
    assert len(told) == 1
    assert told[0].endswith(f" {said}.")
    model = mujoco.MjModel.from_xml_path(str(out))  # computed from the file
    rests = forward(robot, model.tendon_lengthspring[:, 1], start=pose)
    away = np.linalg.norm(rests.pose.position - pose.position)
    number, unit = said.split()[:2]
    assert away == pytest.approx(float(number) * {"mm": 1e-3, "m": 1.0}[unit], rel=0.05)


@pytest.mark.parametrize(
    ("name", "form", "ending"),
    [
        ("x.yaml", "mjcf", ".xml"),
        ("x.txt", "mjcf", ".xml"),
        ("x.txt", "robot", ".yaml"),
        ("x.xml", "robot", ".yaml"),
    ],
)
def test_the_file_name_has_the_suffix_of_the_format(tmp_path: Path, name: str, form: str, ending: str) -> None:
    code, stdout, stderr = run("cogiro", "--out", str(tmp_path / name), "--format", form)
    assert (code, stdout, list(tmp_path.iterdir())) == (2, "", [])
    assert f"{tmp_path / name}: " in stderr
    assert f" {ending}," in stderr


def test_the_source_is_not_overwritten(wirex: Path) -> None:
    code, _, _ = run(str(wirex), "--out", str(wirex))
    assert (code, wirex.read_text()) == (2, WIREX)
