"""Models of MuJoCo with cables: several robots, bodies of any kind, MJCF in another process, and refused input."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import sagline as sl
from sagline.mujoco.plugin import LIBRARY, library
from tests.mujoco.test_rest_and_motion import COGIRO, middle, pose_of, started
from tests.refusal import refused
from tests.tiers import extended

MIXED = sl.load_robot("article-mixed")
PLACE = (0.3, 0.2, 1.5)
LOAD = '<inertial pos="0 0 0" mass="50" diaginertia="1 1 1"/>'
EMPTY = "<mujoco><worldbody/></mujoco>"


def two_bodies() -> Any:
    text = f'<body name="one" pos="0.3 0.2 1.5"><freejoint name="first"/>{LOAD}</body>'
    text += f'<body name="two" pos="0 0 2" euler="0 0 5"><freejoint/>{LOAD}</body>'
    return mujoco.MjSpec.from_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")


def test_two_robots_in_one_model_move_as_each_alone() -> None:
    both = two_bodies()
    sl.mujoco.attach(both, MIXED, body="one", prefix="one/")
    sl.mujoco.attach(both, COGIRO, body="two", prefix="two/")
    model, data = started(both)
    data.ctrl[:] = 2e-3 * np.sin(np.arange(16.0))
    mujoco.mj_step(model, data, nstep=50)
    for k, (robot, name) in enumerate(((MIXED, "one"), (COGIRO, "two"))):
        alone = two_bodies()
        sl.mujoco.attach(alone, robot, body=name)
        single, found = started(alone)
        found.ctrl[:] = data.ctrl[8 * k : 8 * k + 8]
        mujoco.mj_step(single, found, nstep=50)
        np.testing.assert_array_equal(data.sensor(f"{name}/tensions").data, found.sensor("tensions").data)
        np.testing.assert_array_equal(data.body(name).xpos, found.body(name).xpos)
        assert data.actuator(f"{name}/winch_7").force[0] == found.sensor("tensions").data[7]


@pytest.mark.filterwarnings("ignore:Attach conflict")
def test_mujoco_itself_can_attach_a_robot_under_other_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log there
    base, robot = mujoco.MjSpec(), sl.mujoco.model_of(MIXED, PLACE)
    base.attach(robot, prefix="left/", frame=base.worldbody.add_frame())
    _, data = started(base)
    assert np.abs(data.qacc).max() < 1e-10
    assert data.sensor("left/tensions").data.min() > 1.0


@pytest.mark.parametrize("joints", ["", '<joint name="roll" type="ball"/>', '<joint type="slide" axis="1 0 1"/>'])
def test_the_wrench_of_cables_acts_on_a_body_of_any_kind(joints: str) -> None:
    cart = '<joint name="x" type="slide" axis="1 0 0"/><joint name="yaw" axis="0 0 1"/>'
    load = f'<body name="load" pos="0.1 0 0.5" euler="5 0 0">{joints}{LOAD}</body>'
    text = f'<body name="cart" pos="0.3 0.2 1">{cart}{LOAD}{load}</body>'
    spec = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
    chords = np.linalg.norm(MIXED.frame_anchors - (0.4, 0.2, 1.5), axis=1)
    lengths = chords * (1.0 - 2e-3 * np.arange(8.0))
    sl.mujoco.attach(spec, MIXED, body="load", unstrained_length=lengths)
    model, data = started(spec)
    w, x, y, z = data.body("load").xquat
    pose = sl.Pose.from_quaternion(np.array(data.body("load").xpos), (x, y, z, w))
    ends = pose.transform(MIXED.platform_anchors)
    chord = ends - MIXED.frame_anchors
    span = np.hypot(chord[:, 0], chord[:, 1])
    state = sl.Catenary().from_length(MIXED.cables, span, chord[:, 2], lengths, MIXED.gravity)
    forces = -np.column_stack(
        (chord[:, :2] * (state.horizontal_tension / span)[:, None], state.vertical_force)
    )  # on the platform
    expected, along = np.zeros(model.nv), np.zeros((3, model.nv))
    for force, end in zip(forces, ends, strict=True):
        mujoco.mj_jac(model, data, along, None, end, data.body("load").id)
        expected += along.T @ force
    np.testing.assert_allclose(data.qfrc_passive, expected, rtol=1e-9, atol=1e-9)
    assert np.abs(expected).max() > 10.0


def test_a_file_names_the_plug_in_in_another_process(tmp_path: Path) -> None:
    robot = sl.load_robot("ipanema-3-pulleys")
    (tmp_path / "robot.xml").write_text(sl.mujoco.model_of(robot, middle(robot)).to_xml(), encoding="utf-8")
    code = (
        "import sys, mujoco\n"
        f"mujoco.mj_loadPluginLibrary({str(library())!r})\n"
        "model = mujoco.MjModel.from_xml_path('robot.xml')\n"
        "data = mujoco.MjData(model)\n"
        "data.ctrl[:] = 0.002\n"
        "mujoco.mj_step(model, data, nstep=30)\n"
        "assert 'sagline' not in sys.modules and 'numba' not in sys.modules\n"
        "print(*map(repr, map(float, data.sensordata)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    model, data = started(mujoco.MjSpec.from_file(str(tmp_path / "robot.xml")))
    data.ctrl[:] = 0.002
    mujoco.mj_step(model, data, nstep=30)
    assert [float(each) for each in done.stdout.split()] == data.sensordata.tolist()
    assert data.sensordata.min() > 1.0


@extended
@pytest.mark.parametrize("compiler", ["gcc", f"{sys.executable} -m ziglang cc -mcpu=baseline"])
def test_compilers_build_the_plug_in(compiler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", compiler)
    place = sl.mujoco.build_plugin(tmp_path / "new" / "plugins")
    assert place == tmp_path / "new" / "plugins" / LIBRARY
    assert [each.name for each in place.parent.iterdir()] == [LIBRARY]
    (tmp_path / "robot.xml").write_text(sl.mujoco.model_of(MIXED, PLACE).to_xml(), encoding="utf-8")
    code = f"import mujoco\nmujoco.mj_loadPluginLibrary({str(place)!r})\n"
    code += "data = mujoco.MjData(model := mujoco.MjModel.from_xml_path('robot.xml'))\n"
    code += "mujoco.mj_forward(model, data); print(abs(data.qacc).max())"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert float(done.stdout) < 1e-10


WRONG = {  # pattern in the file, replacement, and part of the message
    "a short list": (r'(linear_density" value=)"[^"]*"', r'\1"0.1 0.2"', "linear_density has 2 numbers; give 1, or 1"),
    "no anchors": (r'<config key="frame_anchors"[^>]*>', "", "frame_anchors has 0 numbers; give 3, or 3 for each"),
    "a word": (r'(axial_stiffness" value=)"[^"]*"', r'\1"stiff"', "axial_stiffness is not a list of numbers"),
    "not a number": (r'(axial_stiffness" value=)"[^"]*"', r'\1"nan"', "axial_stiffness of cable 0 is nan; give a numb"),
    "a negative density": (r'(linear_density" value=)"[^"]*"', r'\1"-1"', "linear_density of cable 0 is -1"),
    "a negative loss": (r'(loss_time" value=)"[^"]*"', r'\1"-1"', "loss_time or air_damping of cable 0 is -1"),
    "no length": (r'(unstrained_length" value=)"[^"]*"', r'\1""', "unstrained_length is not a list of numbers"),
    "a length of zero": (r'(unstrained_length" value=)"\S+', r'\1"0', "unstrained_length of cable 0 is 0; give a num"),
    "slanted gravity": (r"<option ", '<option gravity="1 0 -9.81" ', "gravity is not along -z"),
    "a missing winch": (r'<plugin name="winch_3"[^>]*>', "", "7 actuators for 8 cables; give one for each cable"),
    "no body": (r'<plugin instance="cables"/>', "", "0 bodies name the instance"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_numbers_in_a_file_are_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log there
    pattern, instead, message = WRONG[case]
    text, count = re.subn(pattern, instead, sl.mujoco.model_of(MIXED, PLACE).to_xml())
    assert count == 1
    with pytest.raises(ValueError, match=r"sagline\.cables: ") as caught:
        mujoco.MjModel.from_xml_string(text)
    assert message in str(caught.value)


def test_a_body_is_needed_that_the_model_has() -> None:
    with refused("body", "'load'", "a body of the model: one, two"):
        sl.mujoco.attach(two_bodies(), MIXED, body="load")
    with refused("body", "'world'", "a body of the model: one, two"):
        sl.mujoco.attach(two_bodies(), MIXED, body="world")
    with refused("body", "'load'", "a body of the model: none has a name"):
        sl.mujoco.attach(mujoco.MjSpec.from_string(EMPTY), MIXED, body="load")


def test_names_are_used_once() -> None:
    spec = two_bodies()
    sl.mujoco.attach(spec, MIXED, body="one")
    with refused("prefix", "gives the name cables", "a new name"):
        sl.mujoco.attach(spec, COGIRO, body="two")


def test_the_gravity_is_that_of_the_robot() -> None:
    spec = two_bodies()
    spec.option.gravity = (0.0, 0.0, -1.62)
    with refused("spec: gravity", "(0, 0, -1.62) m/s^2", "(0, 0, -9.81) m/s^2, as the robot has"):
        sl.mujoco.attach(spec, MIXED, body="one")


def test_a_model_that_does_not_compile_is_refused() -> None:
    spec = two_bodies()
    spec.body("two").add_body(name="massless").add_joint()
    with refused("spec", allowed="a model that compiles"):
        sl.mujoco.attach(spec, MIXED, body="one")


def test_a_robot_needs_a_pose_that_its_cables_hold() -> None:
    with refused("article-mixed at (0.3, 0.2, 9) m", allowed="a pose that the cables can hold"):
        sl.mujoco.model_of(MIXED, (0.3, 0.2, 9.0))
    spec = two_bodies()
    spec.body("one").pos = (0.3, 0.2, 9.0)
    with refused("article-mixed at (0.3, 0.2, 9) m", allowed="a pose that the cables can hold"):
        sl.mujoco.attach(spec, MIXED, body="one")
    _, data = started(sl.mujoco.model_of(MIXED, (0.3, 0.2, 9.0), unstrained_length=np.full(8, 12.0)))
    assert np.isfinite(data.qacc).all()
    assert pose_of(data).position[2] == 9.0


def test_guides_slanted_axes_and_modal_damping_are_refused() -> None:
    guides = sl.Winch(guides=[(9.0, 9.0, 3.0)])
    with refused("winches: guides", "given", "None for MuJoCo"):
        sl.mujoco.model_of(COGIRO.replace(winches=guides), (0.0, 0.0, 2.0))
    slanted = sl.Winch(0.05, swivel_axis=[[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]] * 4)
    with refused():
        sl.mujoco.model_of(COGIRO.replace(winches=slanted), (0.0, 0.0, 2.0))
    with refused("damping: modal_damping", "0.01", "0 in time"):
        sl.mujoco.model_of(COGIRO, (0.0, 0.0, 2.0), damping=sl.Damping(modal_damping=0.01))
