from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from sagline.cli.main import app
from sagline.files.robot_file import load_robot
from sagline.kinematics.forward import forward
from sagline.robot.pose import Pose

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
    assert "Assumed: cables: linear density and axial stiffness of a 4 mm steel rope" in stderr
    assert "Lost: The pulley of chain 1 (radius 0.02 m), whose axis is not vertical" in stderr
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


def test_a_preset_becomes_a_mujoco_model(tmp_path: Path) -> None:
    out = tmp_path / "cogiro.xml"
    code, _, _ = run("cogiro", "--format", "mjcf", "--out", str(out), "--at", "0.5", "-0.25", "2")
    model = mujoco.MjModel.from_xml_path(str(out))
    assert (code, model.ntendon) == (0, 8)
    np.testing.assert_array_equal(model.body("platform").pos, [0.5, -0.25, 2.0])


@pytest.mark.parametrize(
    ("name", "said"), [("cogiro", "0.4 mm away"), ("article-mixed", "19 mm away"), ("fast", "400 mm away")]
)
def test_what_straight_tendons_cost_is_told(name: str, said: str, tmp_path: Path) -> None:
    robot = load_robot(name)
    assert robot.test_box is not None
    pose = Pose.from_euler(0.5 * (robot.test_box.low + robot.test_box.high), 0.0, 0.0, 0.0)
    out = tmp_path / "model.xml"
    _, _, stderr = run(name, "--format", "mjcf", "--out", str(out))
    told = [line for line in stderr.splitlines() if line.startswith("Lost: Sag and weight of the cables")]
    assert len(told) == 1
    assert told[0].endswith(f"sagging cables of these lengths hold the platform {said}.")
    model = mujoco.MjModel.from_xml_path(str(out))  # from the file itself
    rests = forward(robot, model.tendon_lengthspring[:, 1], start=pose)
    away = np.linalg.norm(rests.pose.position - pose.position)
    number, unit = said.split()[:2]
    assert away == pytest.approx(float(number) * {"mm": 1e-3, "m": 1.0}[unit], rel=0.05)


def test_caspr_files_are_recognized(tmp_path: Path) -> None:
    code, _, stderr = run(str(tmp_path))
    assert (code, "0 CASPR files of bodies" in " ".join(stderr.split())) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--linear-density", "20 g/m"], "--axial-stiffness is missing; allowed: both or none"),
        (
            ["--linear-density", "20 g", "--axial-stiffness", "1"],
            "--linear-density is '20 g'; allowed: a number in kg/m",
        ),
        (["--linear-density", "-1", "--axial-stiffness", "1"], "linear_density is -1 kg/m"),
        (["--format", "mjcf"], "--at is missing; allowed: X Y Z in m"),
        (["--format", "mjcf", "--at", "9", "9", "9"], "swing at (9, 9, 9) m is no tensions within the limits"),
    ],
)
def test_bad_input_writes_nothing(wirex: Path, tmp_path: Path, arguments: list[str], message: str) -> None:
    out = tmp_path / ("out.xml" if "mjcf" in arguments else "out.yaml")
    code, stdout, stderr = run(str(wirex), "--out", str(out), *arguments)
    assert (code, stdout, out.exists()) == (2, "", False)
    assert message in " ".join(stderr.split())


@pytest.mark.parametrize(
    ("name", "form", "told"),
    [
        ("x.yaml", "mjcf", "x.yaml: is no name for a MuJoCo model. Let it end in .xml"),
        ("x.txt", "mjcf", "is no name for a MuJoCo model"),
        ("x.txt", "robot", "x.txt: is no name for a robot file. Let it end in .yaml"),
        ("x.xml", "robot", "is no name for a robot file"),
        ("x", "robot", "is no name for a robot file"),
    ],
)
def test_the_ending_is_that_of_the_format(tmp_path: Path, name: str, form: str, told: str) -> None:
    code, stdout, stderr = run("cogiro", "--out", str(tmp_path / name), "--format", form)
    assert (code, stdout, list(tmp_path.iterdir())) == (2, "", [])
    assert told in " ".join(stderr.split())


def test_the_source_is_not_overwritten(wirex: Path) -> None:
    code, _, stderr = run(str(wirex), "--out", str(wirex))
    assert (code, wirex.read_text()) == (2, WIREX)
    assert "is the file to convert" in stderr
