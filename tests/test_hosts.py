"""The same answers in all programs that contain sagline: one table, one test.

A new host is a function of `HOSTS`: it computes some of the answers of `expected`, by the names of its result.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import fmpy
import mujoco
import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.files.c_programs import Program
from tests.linuxcnc import Module, World
from tests.share.programs import answers_in_node
from tests.tiers import extended

ACCURACY: Final = 1e-12  # m
ANGLES: Final = np.array([0.03, -0.04, 0.05])  # rotations about the fixed axes x, y, z [rad]
Answers = dict[str, Array]


def poses_of(robot: sl.Robot) -> sl.Pose:
    """Two poses in the test box of a robot."""
    assert robot.test_box is not None
    low, high = robot.test_box.low, robot.test_box.high
    positions = np.array([0.5 * low + 0.5 * high, 0.6 * low + 0.4 * high])
    return sl.Pose.from_euler(positions, *ANGLES[::-1])


def expected(robot: sl.Robot, pose: sl.Pose) -> Answers:
    """Lengths off the drums [m] and tensions [N] at poses, and positions [m] at these lengths."""
    plan = sl.inverse(robot, pose)
    assert plan.feasible.all()
    return {
        "length": plan.unstrained_length,
        "position": sl.forward(robot, plan.unstrained_length, near(pose)).pose.position,
        "chord_tension": plan.chord_tension,
        "frame_end_tension": plan.state.cables.frame_end_tension,
    }


def near(pose: sl.Pose) -> sl.Pose:
    """Start of the forward solution, 1 cm away."""
    return sl.Pose(pose.position + 0.01, pose.matrix)


PLAIN: Final = """
import sys
import numpy as np
import sagline as sl
from tests.test_hosts import expected, poses_of
robot = sl.load_robot(sys.argv[1])
assert sl.backend() == "python"
np.savez(sys.argv[2], **expected(robot, poses_of(robot)))
"""


def plain_python(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The kernels as Python, without a compiler."""
    words = [sys.executable, "-c", PLAIN, robot.name, str(folder / "found.npz")]
    root, environment = Path(__file__).parents[1], {**os.environ, "SAGLINE_BACKEND": "python"}
    subprocess.run(words, check=True, cwd=root, env=environment)
    return dict(np.load(folder / "found.npz"))


def c_source(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The source of `export_c`."""
    program = Program(robot, folder, forward=True)
    inverse = program.inverse(pose)
    forward = program.forward(inverse.found, near(pose))
    assert not inverse.status.any()
    assert not forward.status.any()
    return {"length": inverse.found, "chord_tension": inverse.tension, "position": forward.found[:, :3]}


def web_assembly(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The package for JavaScript, in node."""
    found = answers_in_node(robot, pose, expected(robot, pose)["length"])
    position = np.array([each["rest"]["position"] for each in found])
    names = {"length": "length", "chord_tension": "tension"}
    return {"position": position} | {name: np.array([each[key] for each in found]) for name, key in names.items()}


def unit_of_co_simulation(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """Units of `export_fmu` at rest, after a simulated time of 20 ms."""
    found = []
    for k in range(len(pose)):
        unit = str(sl.export_fmu(robot, folder / f"unit{k}.fmu", start=pose[k]))
        found.append(fmpy.simulate_fmu(unit, stop_time=0.02, step_size=0.01, output_interval=0.01)[-1])
    axes = {"length": range(robot.cable_count), "tension": range(robot.cable_count), "position": "xyz"}
    table = {name: np.array([[row[f"{name}_{axis}"] for axis in each] for row in found]) for name, each in axes.items()}
    return {"length": table["length"], "position": table["position"], "frame_end_tension": table["tension"]}


def linuxcnc(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The module of `export_linuxcnc`."""
    module, found = Module(robot, folder), []
    for position in pose.position:
        code, length, tension = module.inverse(position, ANGLES)
        back, again, _ = module.forward(length, World())
        assert (code, back) == (0, 0)
        found.append((length, tension, again))
    columns = (np.array(column) for column in zip(*found, strict=True))
    return dict(zip(("length", "chord_tension", "position"), columns, strict=True))


def physics_engine(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The plug-in for MuJoCo at rest, after 20 steps."""
    found = []
    for k in range(len(pose)):
        spec = sl.mujoco.model_of(robot, pose[k])
        length = np.array(spec.plugins[0].config["unstrained_length"].split(), dtype=np.float64)
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, nstep=20)
        mujoco.mj_forward(model, data)
        found.append((length, np.array(data.sensor("tensions").data), np.array(data.body("platform").xpos)))
    columns = (np.array(column) for column in zip(*found, strict=True))
    return dict(zip(("length", "frame_end_tension", "position"), columns, strict=True))


def jax_functions(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The functions of `sagline.jax`."""
    import jax

    import sagline.jax

    jax.config.update("jax_enable_x64", True)
    inverse = [sagline.jax.inverse(robot, pose[k]) for k in range(len(pose))]
    forward = [sagline.jax.forward(robot, each.unstrained_length, near(pose[k])) for k, each in enumerate(inverse)]
    found = {
        "length": [each.unstrained_length for each in inverse],
        "frame_end_tension": [each.tension for each in inverse],
        "position": [each.position for each in forward],
    }
    return {name: np.array(rows) for name, rows in found.items()}


def torch_functions(robot: sl.Robot, pose: sl.Pose, folder: Path) -> Answers:
    """The functions of `sagline.torch`."""
    import sagline.torch

    inverse = sagline.torch.inverse(robot, pose)
    forward = sagline.torch.forward(robot, inverse.unstrained_length, near(pose))
    found = {"length": inverse.unstrained_length, "frame_end_tension": inverse.tension, "position": forward.position}
    return {name: rows.numpy() for name, rows in found.items()}


Host = Callable[[sl.Robot, sl.Pose, Path], Answers]
HOSTS: Final[tuple[Host, ...]] = (
    c_source, linuxcnc, physics_engine, unit_of_co_simulation, plain_python, web_assembly,
    jax_functions, *([torch_functions] if find_spec("torch") else []),
)  # fmt: skip
QUICK: Final = (c_source, linuxcnc, physics_engine)  # in the first tier, with the first robot
ROBOTS: Final = ("article-prototype", "ipanema-3-pulleys")


def cases() -> list[object]:
    """Hosts and robots, in both tiers."""
    every = [(host, name) for name in ROBOTS for host in HOSTS]
    first = [(host, ROBOTS[0]) for host in QUICK]
    return [pytest.param(*case, marks=[] if case in first else extended) for case in every]


@pytest.mark.parametrize(("host", "name"), cases())
def test_all_hosts_give_the_same_answers(host: Host, name: str, tmp_path: Path) -> None:
    robot = sl.load_robot(name)
    pose = poses_of(robot)
    right, found = expected(robot, pose), host(robot, pose, tmp_path)
    assert found.keys() >= {"length", "position"}
    # a tension may differ by the effect of a length that differs by the accuracy
    effect = ACCURACY * robot.cables.axial_stiffness / right["length"]
    for item, values in found.items():
        limit = ACCURACY if item in ("length", "position") else np.maximum(effect, ACCURACY * right[item])
        excess = np.abs(values - right[item]) / limit
        assert excess.max() <= 1.0, f"{item}: {excess.max():.2g} times the accuracy"
