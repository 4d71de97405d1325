"""C source of a robot compared with the package: inverse, forward, methods, pulleys, precisions, refusals."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.files import c_source
from sagline.kernels import codes
from sagline.tension import methods as tension_methods
from tests.files.c_programs import BAD_INPUT, FORWARD, INFEASIBLE, NO_CHORD, SINGULAR, SOLVED, Program, compiled
from tests.refusal import refused
from tests.tiers import extended, wide

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "microcontroller.md"
PROTOTYPE = "article-prototype"
UNDECIDED = (codes.POSE_INFEASIBLE, codes.POSE_NOT_CONVERGED)  # the package continues with a proof for these


def planar() -> sl.Robot:
    """A point mass on four cables in a plane that is not parallel to an axis."""
    normal = np.array([0.6, -0.8, 0.0])
    along = np.array([0.8, 0.6, 0.0])
    corners = [s * 3.0 * along + np.array([0.0, 0.0, z]) for s, z in ((-1, 0.0), (1, 0.0), (1, 4.0), (-1, 4.0))]
    return sl.Robot(
        name="planar", frame_anchors=corners, platform_anchors=np.zeros((4, 3)), mass=8.0, inertia=np.eye(3),
        cables=sl.Cable(0.05, 4e4), tension_min=10.0, tension_max=500.0, motion_pattern="2T", plane_normal=normal,
    )  # fmt: skip


def ten_cables() -> sl.Robot:
    """The prototype with two additional cables from the middle of two sides of the floor."""
    robot = sl.load_robot(PROTOTYPE)
    frame = np.vstack((robot.frame_anchors, [[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]))
    platform = np.vstack((robot.platform_anchors, [[0.2, 0.0, -0.2], [-0.2, 0.0, -0.2]]))
    return sl.Robot(
        name="ten", frame_anchors=frame, platform_anchors=platform, mass=50.0, inertia=robot.inertia,
        cables=sl.Cable(0.09, 14e3), tension_min=25.0, tension_max=2000.0,
    )  # fmt: skip


OWN = {"planar": planar, "ten": ten_cables}


def robot_of(name: str) -> sl.Robot:
    return OWN[name]() if name in OWN else sl.load_robot(name)


def poses_of(robot: sl.Robot, count: int, rng: np.random.Generator) -> sl.Pose:
    """Poses of the test box of a robot in its free motions."""
    if robot.name == "planar":
        s, z = rng.uniform(-2.5, 2.5, count), rng.uniform(0.3, 3.7, count)
        return sl.Pose(np.stack([0.8 * s, 0.6 * s, z], axis=1), np.broadcast_to(np.eye(3), (count, 3, 3)))
    if robot.name == "ten":
        angles = rng.uniform(-0.1, 0.1, (3, count))
        return sl.Pose.from_euler(rng.uniform([-0.5, -0.5, 1.0], [0.5, 0.5, 2.0], (count, 3)), *angles)
    from tests.tension.reference import random_poses  # imports solvers that the first tier does not need

    return random_poses(robot, count, rng)


def moved(pose: sl.Pose, robot: sl.Robot) -> sl.Pose:
    """Poses at a distance of a centimeter along the free motions."""
    return sl.Pose(pose.position + 0.01 * robot.freedom[:, :3].sum(axis=0), pose.matrix)


def assert_inverse(program: Program, robot: sl.Robot, pose: sl.Pose, load: Array | None, method: int, plan: Any) -> int:
    """Equal to the last bit, except at poses that a proof decides; returns the number of solved poses."""
    found = program.inverse(pose, load, method)
    solved = found.status == SOLVED
    at = f"{robot.name}, method {method}"
    np.testing.assert_array_equal(found.found[solved], plan.unstrained_length[solved], err_msg=at)
    np.testing.assert_array_equal(found.tension[solved], plan.chord_tension[solved], err_msg=at)
    decided = ~np.isin(found.status, UNDECIDED)
    np.testing.assert_array_equal(found.status[decided], plan.status[decided], err_msg=at)
    return int(solved.sum())


def assert_forward(program: Program, robot: sl.Robot, plan: sl.Plan, load: Array | None) -> None:
    """Equal to the last bit from an initial pose; without one, the pose of the plan."""
    good = np.flatnonzero(plan.feasible)
    lengths, pose = plan.unstrained_length[good], plan.state.pose[good]
    loads = None if load is None else load[good]
    expected = sl.forward(robot, lengths, moved(pose, robot), wrench=loads)
    found = program.forward(lengths, moved(pose, robot), loads)
    status = np.asarray(expected.status, dtype=int)
    np.testing.assert_array_equal(found.status, status + FORWARD * (status > 0))
    rows = np.hstack((expected.pose.position, expected.pose.quaternion))
    ended = status != codes.FORWARD_NOT_CONVERGED
    np.testing.assert_array_equal(found.found[ended], rows[ended])
    np.testing.assert_array_equal(found.tension[ended], expected.state.chord_tension[ended])
    found = program.forward(lengths, None, loads)
    stable = found.status == SOLVED
    assert stable.mean() > 0.95
    assert np.median(np.abs(found.found[stable, :3] - pose.position[stable]).max(axis=1)) < 1e-9


def test_results_agree_with_the_package_to_the_last_bit(tmp_path: Path) -> None:
    """A small case of the next test for the first tier, with the center of mass off the origin."""
    robot = sl.load_robot(PROTOTYPE).replace(center_of_mass=(0.05, -0.03, 0.1))
    program = Program(robot, tmp_path, "-O0", forward=True)
    pose = sl.Pose.from_euler([[0.3, -0.2, 1.5], [-0.4, 0.6, 1.1], [9.0, 0.0, 1.0]], 0.1, -0.05, 0.08)
    wrench = np.array([[10.0, -20.0, 30.0, 2.0, -1.0, 3.0]] * 3)
    plan = sl.inverse(robot, pose, wrench=wrench)
    assert assert_inverse(program, robot, pose, wrench, 0, plan) == 2
    assert_forward(program, robot, plan, wrench)


@extended
@pytest.mark.parametrize(
    "name", [PROTOTYPE, "cogiro", "article-mixed", "falcon-7", "fast", "ipanema-3-pulleys", "planar", "ten"]
)
def test_all_methods_and_forward_with_pulleys(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    robot = robot_of(name)
    redundant = robot.cable_count - robot.degrees_of_freedom
    every = [make() for make in tension_methods.methods_by_name().values()]
    methods = [each for each in every if each.most_redundant is None or redundant <= each.most_redundant]
    ends = [sl.MinimumNorm("frame_end"), sl.Centroid("horizontal")][: 2 if redundant <= 2 else 1]
    methods += ends if redundant else []
    program = Program(robot, tmp_path, "-O3", tension=methods, forward=True)
    pose = poses_of(robot, 60, rng)
    weight = robot.mass * robot.gravity
    wrench = rng.uniform(-0.1, 0.1, (60, 6)) * weight * np.array([1, 1, 1, 0.1, 0.1, 0.1])
    solved = 0
    for index, method in enumerate(methods):
        plan = sl.inverse(robot, pose, tension=method, wrench=wrench)
        solved += assert_inverse(program, robot, pose, wrench, index, plan)
    assert solved > 20 * len(methods)
    assert_forward(program, robot, sl.inverse(robot, pose, wrench=wrench), wrench)


@extended
def test_tensions_follow_a_path_as_closest_does(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    path = sl.quintic_path([[0.0, 0.0, 1.5], [0.8, -1.5, 1.2], [-0.7, 1.2, 2.2]], speed=0.5, rate=40.0)
    wrench = sl.inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    plan = sl.inverse(robot, path)
    found = Program(robot, tmp_path, "-O2").inverse(path.pose, wrench, follow=True)
    assert plan.feasible.all()
    np.testing.assert_array_equal(found.found, plan.unstrained_length)
    alone = sl.inverse(robot, path, tension=sl.MinimumNorm())
    assert np.abs(alone.unstrained_length - plan.unstrained_length).max() > 1e-4  # at least one sample follows


def stated_errors() -> list[tuple[str, float, float, float, float]]:
    """Largest errors in single precision, as on the page on microcontrollers."""
    rows = re.findall(r"^\| `([\w-]+)`, \d+ m \| (.*) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    units = {"µm": 1e-6, "mN": 1e-3, "N": 1.0}
    pairs = [(name, [cell.split() for cell in cells.split(" | ")]) for name, cells in rows]
    return [(name, *(float(number) * units[unit] for number, unit in cells)) for name, cells in pairs]


@extended
@pytest.mark.parametrize(("name", "length", "tension", "position", "force"), stated_errors())  # [m], [N]
def test_single_precision(
    name: str, length: float, tension: float, position: float, force: float, tmp_path: Path
) -> None:
    robot = sl.load_robot(name)
    program = Program(robot, tmp_path, "-O2", single=True, forward=True)
    pose = poses_of(robot, 2_000, np.random.default_rng(5))
    rows = np.hstack((pose.position, pose.quaternion)).astype(np.float32).astype(float)
    pose = sl.Pose.from_quaternion(rows[:, :3], rows[:, 3:])
    plan = sl.inverse(robot, pose)
    found = program.inverse(pose)
    np.testing.assert_array_equal(found.status == SOLVED, plan.feasible)
    assert length / 3 < np.nanmax(np.abs(found.found - plan.unstrained_length)) <= length
    assert tension / 3 < np.nanmax(np.abs(found.tension - plan.chord_tension)) <= tension
    good = np.flatnonzero(plan.feasible)[:200]
    lengths = plan.unstrained_length[good].astype(np.float32).astype(float)
    expected = sl.forward(robot, lengths, moved(pose[good], robot))
    found = program.forward(lengths, moved(pose[good], robot))
    assert (found.status == SOLVED).all()
    assert np.abs(found.found[:, :3] - expected.pose.position).max() <= position
    assert np.abs(found.tension - expected.state.chord_tension).max() <= force
    assert (program.forward(lengths, None).status == SOLVED).all()


def test_wrong_input_has_a_status_and_leaves_the_last_result(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    program = Program(robot, tmp_path, "-O0", forward=True)
    level = np.array([0.0, 0.0, 0.0, 1.0])
    for position, quaternion, expected in (
        ([0.0, 0.0, 1.5], level, SOLVED),
        ([5.0, 0.0, 1.5], level, INFEASIBLE),
        ([0.0, np.nan, 1.5], level, BAD_INPUT),
        ([0.0, 0.0, 1.5], 1.01 * level, BAD_INPUT),
        ([0.0, 0.0, 1.5], np.full(4, np.nan), BAD_INPUT),
        (robot.frame_anchors[0] - robot.platform_anchors[0], level, NO_CHORD),
    ):
        found = program.inverse(unchecked(np.array(position), quaternion))
        assert found.status[0] == expected
        assert np.isnan(found.found).all() == (expected != SOLVED)
    here = unchecked(np.array([0.0, 0.0, 1.5]), level)
    assert program.inverse(here, np.array([[0.0, 0.0, np.nan, 0.0, 0.0, 0.0]])).status[0] == BAD_INPUT
    assert program.inverse(here, None, 1).status[0] == BAD_INPUT
    lengths = program.inverse(here).found
    short = sl.forward(robot, 0.8 * lengths, sl.Pose([[0.0, 0.0, 1.5]], np.eye(3)[None]))
    assert short.status[0] == codes.FORWARD_OVERSTRETCHED
    assert program.forward(0.8 * lengths, here).status[0] == FORWARD + codes.FORWARD_OVERSTRETCHED
    for wrong in (np.nan, -1.0, 0.0, np.inf):
        found = program.forward(np.where(np.arange(8) == 3, wrong, lengths), here)
        assert found.status[0] == BAD_INPUT
        assert np.isnan(found.tension).all()
    assert program.forward(lengths, unchecked(np.zeros(3), 1.01 * level)).status[0] == BAD_INPUT


class _Poses(list[Array]):
    """Positions and quaternions that `Pose` refuses."""

    position: Array
    quaternion: Array


def unchecked(position: Array, quaternion: Array) -> Any:
    found = _Poses([position])
    found.position, found.quaternion = position[None], np.asarray(quaternion)[None]
    return found


@extended
def test_a_pose_without_full_rank_is_singular(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    straight = robot.replace(platform_anchors=[[0.0, 0.0, z] for z in (0.25, -0.25) * 4])  # free to rotate about z
    assert Program(straight, tmp_path).inverse(sl.Pose([[0.0, 0.0, 1.5]], np.eye(3)[None])).status[0] == SINGULAR


def test_the_source_has_no_recursion_heap_or_loop_without_a_bound(tmp_path: Path) -> None:
    methods = [make() for make in tension_methods.methods_by_name().values()]
    source, _, _ = sl.export_c(sl.load_robot("ipanema-3-pulleys"), tmp_path / "s.c", tension=methods, forward=True)
    text = re.sub(r"/\*.*?\*/|^#.*?$", "", source.read_text(), flags=re.DOTALL | re.MULTILINE)
    heads = list(
        re.finditer(r"^(?:static |SL_HELPER |int )(?:SL_\w+ )?[\w ]*?(\w+)\([^;]*?\)\s*\{", text, re.MULTILINE)
    )
    names = [head[1] for head in heads]
    assert len(names) > 150
    ends = [head.start() for head in heads[1:]] + [len(text)]
    for k, (head, end) in enumerate(zip(heads, ends, strict=True)):
        called = set(re.findall(r"(\w+)\(", text[head.end() : end]))
        assert called.isdisjoint(names[k:]), names[k]
    assert not re.search(r"\b(while|goto|malloc|alloca)\b", text)
    assert "_Complex" not in text


def test_only_requested_functions_are_written(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    least = sl.export_c(robot, tmp_path / "s.c")[0].read_text()
    forward = sl.export_c(robot, tmp_path / "s.c", forward=True)[0].read_text()
    methods = sl.export_c(robot, tmp_path / "s.c", tension=[sl.MinimumNorm(), sl.Centroid()])[0].read_text()
    assert len(least) < min(len(forward), len(methods))
    assert "sagline_forward" not in least
    assert "polygon" not in forward.lower()


def test_unsupported_robots_are_refused(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    changes: list[tuple[dict[str, Any], dict[str, Any], str, str | None]] = [
        ({"tension_max": np.inf}, {"tension": sl.ClosedForm()}, "article-prototype: tension_max[0]", None),
        ({}, {"tension": []}, "tension", "Give a method, for example Closest()."),
        ({"cables": sl.Cable(0.09, 1e39)}, {"single_precision": True}, "table", "Export it in double precision."),
    ]
    for change, asked, item, step in changes:
        with refused(item, next_step=step, kind=sl.InvalidValueError):
            sl.export_c(robot.replace(**change), tmp_path / "sagline.c", **asked)
    for name, step in (("nothere/sagline.c", None), ("sagline.h", "Let it end in .c: sagline.c.")):
        with refused(next_step=step, kind=sl.FileError, file=tmp_path / name):
            sl.export_c(robot, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_package_without_compiled_kernels_names_the_next_step(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(c_source, "KERNELS", "c/nothing.json")
    with pytest.raises(sl.FileError, match=r"python -m tools\.build"):
        sl.export_c(sl.load_robot(PROTOTYPE), tmp_path / "sagline.c")


@pytest.mark.parametrize("name", wide(sl.robot_names(), first=4))
def test_every_preset_is_exported(name: str, tmp_path: Path) -> None:
    robot = sl.load_robot(name)
    source, header, scl = sl.export_c(robot, tmp_path / "robot.c", forward=True)
    assert (source.name, header.name, scl.name) == ("robot.c", "robot.h", "robot.scl")
    assert '#include "robot.h"' in source.read_text()
    (table,) = re.findall(r"CABLES\[M \* 14\] = \{(.*?)\}", source.read_text(), re.DOTALL)
    numbers = np.array([float(word.replace("INFINITY", "inf")) for word in table.split(",")]).reshape(-1, 14)
    np.testing.assert_array_equal(numbers[:, 9], robot.tension_max)
    assert f"#define SAGLINE_CABLES {robot.cable_count}\n" in header.read_text()


@extended
@pytest.mark.parametrize("name", ["evil */ int main(void) {", "what??/", 'a "b" \\', "@mass@", "Ärger /*"])
def test_names_stay_within_their_comment(name: str, tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE).replace(name=name, tension_max=np.inf)
    source, header, _ = sl.export_c(robot, tmp_path / "sagline.c")
    compiled(source, tmp_path / "sagline.o", "-O0", "-c")
    assert header.read_text().isascii()
