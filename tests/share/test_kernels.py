"""Kernels of shared pages in node: WebAssembly and native C are equal to the last bit and agree with the library."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.robot.reach import bounds
from sagline.share.machine import courses_at, model_data
from sagline.share.packing import MODULE
from sagline.statics.tables import chord_geometry, pose_rows
from sagline.viewer.snapshot import Snapshot
from tests.share.programs import Rows, compiled_kernels, in_node, in_program, linked_program, patterns
from tests.tiers import extended
from tools.translate import wasm

UPDATES = 60.0  # per second, at least

pytestmark = extended


def frame_end_limited() -> sl.Robot:
    """Frame-end limits, with a lower limit above the least tension of many cables."""
    robot = sl.load_robot("ipanema-2-pulleys")
    return robot.replace(name="frame-end", tension_limits_of="frame_end")


def planar() -> sl.Robot:
    """Three degrees of freedom, four cables, no upper limits."""
    frame = [[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0], [-3.0, 0.0, 4.0], [3.0, 0.0, 4.0]]
    platform = [[-0.2, 0.0, 0.1], [0.2, 0.0, 0.1], [-0.2, 0.0, -0.1], [0.2, 0.0, -0.1]]
    return sl.Robot(
        name="planar", frame_anchors=frame, platform_anchors=platform, cables=sl.Cable(0.05, 1e5), mass=10.0,
        inertia=np.eye(3),
        motion_pattern="1R2T", plane_normal=[0.0, 1.0, 0.0], tension_min=[20.0, 20.0, 20.0, 20.0],
    )  # fmt: skip


ROBOTS = {name: sl.load_robot(name) for name in sl.robot_names()}
ROBOTS |= {"frame-end": frame_end_limited(), "planar": planar()}
CHOSEN = ("article-mixed", "falcon-7", "cogiro", "fast", "ipanema-2-pulleys", "frame-end", "planar")


def poses(robot: sl.Robot, count: int) -> sl.Pose:
    """Poses in the box around the frame, half of them in the test box, slightly rotated."""
    rng = np.random.default_rng(7)
    low, high = bounds(robot)
    inside = (low, high) if robot.test_box is None else (robot.test_box.low, robot.test_box.high)
    position = np.concatenate([rng.uniform(*box, (count // 2, 3)) for box in ((low, high), inside)])
    moved = np.hstack((position, rng.normal(0.0, 0.1, position.shape))) @ robot.freedom.T @ robot.freedom
    pose = sl.Pose(moved[:, :3], Rotation.from_rotvec(moved[:, 3:]).as_matrix())
    return pose[np.flatnonzero(np.isfinite(chord_geometry(robot, pose)[:, 2]).all(axis=1))]


def rows_of(plan: sl.Plan) -> Rows:
    """Poses, lengths that differ from the planned ones by up to 1 mm, and chord tensions; NaN if infeasible."""
    rng = np.random.default_rng(8)
    lengths = np.where(plan.feasible[:, None], plan.unstrained_length, 1.0)
    lengths = lengths + rng.uniform(-1e-3, 1e-3, lengths.shape)
    tension = np.nan_to_num(plan.chord_tension, nan=-1.0)
    columns = zip(pose_rows(plan.state.pose), lengths, tension, strict=True)
    return [{"pose": p.tolist(), "given": g.tolist(), "drawn": d.tolist()} for p, g, d in columns]


def test_the_module_of_the_package_is_current(tmp_path: Path) -> None:
    folder = tmp_path / wasm.MODULE.parent
    folder.mkdir(parents=True)
    wasm.build(tmp_path)
    assert (tmp_path / wasm.MODULE).read_bytes() == MODULE.read_bytes(), "renew it: python -m tools.build"


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled_kernels(tmp_path_factory.mktemp("native"))


@pytest.mark.parametrize("name", CHOSEN)
def test_wasm_and_native_c_are_bit_equal(name: str, native: Path, tmp_path: Path) -> None:
    machine, rows = model_data(ROBOTS[name]), rows_of(sl.inverse(ROBOTS[name], poses(ROBOTS[name], 40)))
    program = linked_program(native, machine["kernels"], tuple(rows[0]), tmp_path / "program")
    page, plain = in_node(machine, rows), in_program(program, rows)
    assert len(page) == len(plain) == len(rows) * len(machine["kernels"]["calls"]) * machine["kernels"]["size"]
    np.testing.assert_array_equal(patterns(page), patterns(plain))


class Answers:
    """Results of sagline.mjs at poses, and those of the library."""

    def __init__(self, name: str, count: int, folder: Path) -> None:
        self.robot = ROBOTS[name]
        self.pose = poses(self.robot, count)
        self.plan = sl.inverse(self.robot, self.pose, stability=False)
        self.rows = rows_of(self.plan)
        answer = json.loads(in_node(model_data(self.robot), self.rows, repeat=3))
        self.found: list[dict[str, Any]] = answer["found"]
        self.times: dict[str, list[float]] = answer["times"]
        self.held: list[int] = np.flatnonzero(self.plan.feasible).tolist()
        self.lost: list[int] = np.flatnonzero(~self.plan.feasible).tolist()


@pytest.fixture(
    params=[*CHOSEN, *(pytest.param(name, marks=pytest.mark.soak) for name in ROBOTS if name not in CHOSEN)]
)
def answers(request: pytest.FixtureRequest, tmp_path: Path) -> Answers:
    return Answers(request.param, 60, tmp_path)


def test_the_package_agrees_with_the_library(answers: Answers) -> None:
    plan, found, held = answers.plan, answers.found, answers.held
    assert [one["status"] for one in found] == plan.status.tolist()
    assert 1 < len(held) < len(found)
    np.testing.assert_allclose([found[i]["tension"] for i in held], plan.chord_tension[held], rtol=1e-12)
    lengths = [found[i]["length"] for i in held]
    np.testing.assert_allclose(lengths, plan.unstrained_length[held], rtol=0.0, atol=1e-12)
    for i in answers.lost:
        np.testing.assert_allclose(float(found[i]["short"]), plan.shortfall[i], rtol=1e-9)
        assert found[i]["blocking"] == np.flatnonzero(plan.blocking[i]).tolist()
    for i in held:
        rest = sl.forward(answers.robot, answers.rows[i]["given"], start=answers.pose[i])
        assert found[i]["rest"]["status"] == rest.status
        assert found[i]["rest"]["solved"] == rest.solved
        turned = np.array(found[i]["rest"]["quaternion"])
        expected = rest.pose.quaternion * np.sign(turned @ rest.pose.quaternion)
        np.testing.assert_allclose(turned, expected, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(found[i]["rest"]["position"], rest.pose.position, rtol=0.0, atol=1e-12)
    for i in (held[0], answers.lost[0]):
        pose, tension = answers.pose[i], plan.chord_tension[i]
        expected = Snapshot(answers.robot, pose, sl.inverse(answers.robot, pose), None).courses(1.0)
        np.testing.assert_allclose(found[i]["courses"], expected, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(found[i]["courses"], courses_at(answers.robot, pose, tension), rtol=0.0, atol=1e-12)
    assert 1e6 / sum(min(times) for times in answers.times.values()) > UPDATES


def test_a_platform_end_at_an_anchor_is_reported(tmp_path: Path) -> None:
    robot = ROBOTS["falcon-7"]
    at = robot.frame_anchors[3] - robot.platform_anchors[3]
    row = {"pose": [*at.tolist(), 0.0, 0.0, 0.0, 1.0]}
    (found,) = json.loads(in_node(model_data(robot), [row], repeat=0))["found"]
    assert (found["status"], found["blocking"]) == (sl.PoseStatus.NO_CHORD, [3])
