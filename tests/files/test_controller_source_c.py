"""sagline.c against the kernels: cables, structure matrix and poses; what it refuses, and what it is made of."""

from __future__ import annotations

import re
import subprocess
from decimal import Decimal, localcontext
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.files.c_programs import (
    BAD_INPUT,
    DEEP_SAG,
    INFEASIBLE,
    OVERSTRAINED,
    SINGULAR,
    SOLVED,
    Program,
    compiled,
)
from tests.refusal import refused
from tests.tiers import extended, wide

PROTOTYPE = "article-prototype"
CABLES = 4_000


@pytest.fixture(scope="module")
def double(tmp_path_factory: pytest.TempPathFactory) -> Program:
    return Program(sl.load_robot(PROTOTYPE), tmp_path_factory.mktemp("double"))


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> Program:
    return Program(sl.load_robot(PROTOTYPE), tmp_path_factory.mktemp("single"), single=True)


def any_cables(rng: np.random.Generator) -> tuple[Array, ...]:
    """Span, rise, tension, weight and stiffness: every slope, upright ones too, to the borders of what is covered."""
    chord = 10.0 ** rng.uniform(-0.5, 1.5, CABLES)
    angle = rng.uniform(-np.pi / 2, np.pi / 2, CABLES)
    weight, stiffness = 10.0 ** rng.uniform(-2, 1, CABLES), 10.0 ** rng.uniform(3.5, 6.5, CABLES)
    slackness = 10.0 ** rng.uniform(-5, np.log10(1.999), CABLES)
    tension = np.minimum(weight * chord / (2 * slackness), 0.0999 * stiffness)
    span, rise = chord * np.cos(angle), chord * np.sin(angle)
    span[:100], rise[:100] = 0.0, np.where(rise[:100] < 0, -1.0, 1.0) * chord[:100]
    keep = weight * chord <= 1.999 * 2 * tension
    return tuple(x[keep] for x in (span, rise, tension, weight, stiffness))


def box_cables(robot: sl.Robot, kind: type) -> tuple[Array, ...]:
    """The cables of a robot at poses of its test box, in a precision."""
    plan = sl.inverse(robot, random_poses(robot, 300, np.random.default_rng(5)))
    cables = plan.state.cables
    weight = robot.cables.linear_density * robot.gravity
    rows = (cables.span, cables.rise, cables.chord_tension, weight, robot.cables.axial_stiffness)
    good = np.asarray(plan.feasible)
    return tuple(np.broadcast_to(x, cables.span.shape)[good].ravel().astype(kind).astype(float) for x in rows)


def reference(cables: tuple[Array, ...]) -> sl.CableState:
    span, rise, tension, weight, stiffness = cables
    return sl.Catenary().from_tension(sl.Cable(weight, stiffness), span, rise, tension, gravity=1.0)


@extended
def test_lengths_and_forces_are_those_of_the_kernels(double: Program) -> None:
    cables = any_cables(np.random.default_rng(11))
    state = reference(cables)
    status, found = double.length(*cables)
    assert len(status) > 0.9 * CABLES
    assert (status == SOLVED).all()
    np.testing.assert_allclose(found[:, 0], state.unstrained_length, rtol=1e-14)
    assert (np.abs(found[:, 1] - state.vertical_force) <= 1e-14 * state.platform_end_tension).all()
    span, rise, _, weight, stiffness = cables
    back = sl.Catenary().from_length(state.cable, span, rise, state.unstrained_length, gravity=1.0)
    status, force = double.tension(span, rise, state.unstrained_length, weight, stiffness)
    assert (status == SOLVED).all()
    np.testing.assert_allclose(force[:, 2], back.chord_tension, rtol=1e-14)
    for column, part in enumerate((back.horizontal_tension, back.vertical_force)):
        assert (np.abs(force[:, column] - part) <= 1e-14 * back.platform_end_tension).all()


@extended
def test_cables_without_weight_are_springs(double: Program) -> None:
    rng = np.random.default_rng(4)
    span, rise, strain = rng.uniform(0.0, 9.0, 50), rng.uniform(-5.0, 5.0, 50), 10.0 ** rng.uniform(-9, -1.01, 50)
    span[:3] = 0.0
    length = np.hypot(span, rise) / (1.0 + strain)
    status, force = double.tension(span, rise, length, np.zeros(50), np.full(50, 1e5))
    assert (status == SOLVED).all()
    with localcontext(prec=40):
        for k in range(50):
            x, z = Decimal(span[k]), Decimal(rise[k])
            chord = (x * x + z * z).sqrt()
            pull = 100_000 * (chord / Decimal(length[k]) - 1)
            exact = np.array([float(pull * x / chord), float(pull * z / chord), float(pull)])
            assert (np.abs(force[k] - exact) <= 1e-14 * exact[2]).all()
    tension = force[:, 2]
    status, found = double.length(span, rise, tension, np.zeros(50), np.full(50, 1e5))
    assert (status == SOLVED).all()
    np.testing.assert_allclose(found[:, 0], length, rtol=1e-15)
    status, _ = double.tension(span, rise, 1.001 * np.hypot(span, rise), np.zeros(50), np.full(50, 1e5))
    assert (status == DEEP_SAG).all()


@extended
def test_single_precision_is_good_to_a_micrometer(single: Program) -> None:
    robot = sl.load_robot(PROTOTYPE)
    cables = box_cables(robot, np.float32)
    state = reference(cables)
    status, found = single.length(*cables)
    assert (status == SOLVED).all()
    assert np.abs(found[:, 0] - state.unstrained_length).max() <= 0.7e-6
    span, rise, _, weight, stiffness = cables
    given = state.unstrained_length.astype(np.float32).astype(float)
    status, force = single.tension(span, rise, given, weight, stiffness)
    assert (status == SOLVED).all()
    length = sl.Catenary().from_tension(state.cable, span, rise, force[:, 2], gravity=1.0).unstrained_length
    assert np.abs(length - given).max() <= 0.7e-6
    poses = random_poses(robot, 300, np.random.default_rng(5))
    plan = sl.inverse(robot, poses)
    answer = single.inverse(poses)
    np.testing.assert_array_equal(answer.status == SOLVED, plan.feasible)
    assert np.nanmax(np.abs(answer.length - plan.unstrained_length)) <= 1.5e-6


@extended
@pytest.mark.parametrize("name", [PROTOTYPE, "cogiro", "article-mixed", "ipanema-1", "planar"])
def test_poses_are_those_of_inverse(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    robot = planar() if name == "planar" else sl.load_robot(name)
    program = Program(robot, tmp_path)
    poses = level_poses(200, rng) if name == "planar" else random_poses(robot, 200, rng)
    weight = robot.mass * robot.gravity
    wrench = rng.uniform(-0.3, 0.3, (200, 6)) * weight * np.array([1, 1, 1, 0.2, 0.2, 0.2])
    for load in (None, wrench):
        plan = sl.inverse(robot, poses, wrench=load)
        found = program.inverse(poses, load)
        np.testing.assert_array_equal(found.status == SOLVED, plan.feasible)
        assert plan.feasible.sum() >= 50
        assert np.nanmax(np.abs(found.length - plan.unstrained_length)) <= 1e-12
        assert np.nanmax(np.abs(found.tension - plan.chord_tension)) <= 1e-10 * np.nanmax(plan.chord_tension)
    here = poses[0]
    matrix = program.structure_matrix(here.position, here.matrix)
    np.testing.assert_allclose(robot.freedom @ matrix, sl.structure_matrix(robot, here), atol=1e-14)


@extended
def test_tensions_follow_a_path_as_closest_does(double: Program) -> None:
    robot = sl.load_robot(PROTOTYPE)
    path = sl.quintic_path([[0.0, 0.0, 1.5], [0.8, -1.5, 1.2], [-0.7, 1.2, 2.2]], speed=0.5, rate=40.0)
    wrench = sl.inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    plan = sl.inverse(robot, path)
    found = double.inverse(path.pose, wrench, follow=True)
    assert plan.feasible.all()
    assert (found.status == SOLVED).all()
    np.testing.assert_allclose(found.length, plan.unstrained_length, atol=1e-12)
    alone = sl.inverse(robot, path, tension=sl.MinimumNorm())
    assert np.abs(alone.unstrained_length - plan.unstrained_length).max() > 1e-4  # there is something to follow


def planar() -> sl.Robot:
    """A point on four cables in a plane that is none of the axes'."""
    normal = np.array([0.6, -0.8, 0.0])
    along = np.array([0.8, 0.6, 0.0])
    corners = [s * 3.0 * along + np.array([0.0, 0.0, z]) for s, z in ((-1, 0.0), (1, 0.0), (1, 4.0), (-1, 4.0))]
    return sl.Robot(
        name="planar", frame_anchors=corners, platform_anchors=np.zeros((4, 3)), mass=8.0, inertia=np.eye(3),
        cables=sl.Cable(0.05, 4e4), tension_min=10.0, tension_max=500.0, motion_pattern="2T", plane_normal=normal,
    )  # fmt: skip


def random_poses(robot: sl.Robot, count: int, rng: np.random.Generator) -> sl.Pose:
    from tests.tension.reference import random_poses  # imports solvers, which the first tier does not need

    return random_poses(robot, count, rng)


def level_poses(count: int, rng: np.random.Generator) -> sl.Pose:
    s, z = rng.uniform(-2.5, 2.5, count), rng.uniform(0.3, 3.7, count)
    return sl.Pose(np.stack([0.8 * s, 0.6 * s, z], axis=1), np.broadcast_to(np.eye(3), (count, 3, 3)))


def test_a_compiled_program_agrees_with_the_kernels(tmp_path: Path) -> None:
    """A small case of the other tests for the first tier: cables, and a pose with the center of mass off the origin."""
    robot = sl.load_robot(PROTOTYPE).replace(center_of_mass=(0.05, -0.03, 0.1))
    program = Program(robot, tmp_path)
    cables = tuple(column[100:150] for column in any_cables(np.random.default_rng(11)))
    state = reference(cables)
    span, rise, _, weight, stiffness = cables
    status, found = program.length(*cables)
    assert (status == SOLVED).all()
    np.testing.assert_allclose(found[:, 0], state.unstrained_length, rtol=1e-14)
    status, force = program.tension(span, rise, state.unstrained_length, weight, stiffness)
    assert (status == SOLVED).all()
    back = sl.Catenary().from_length(state.cable, span, rise, state.unstrained_length, gravity=1.0)
    np.testing.assert_allclose(force[:, 2], back.chord_tension, rtol=1e-14)
    poses = sl.Pose.from_euler([[0.3, -0.2, 1.5]], 0.1, -0.05, 0.08)
    expected = sl.inverse(robot, poses)
    assert expected.feasible.all()
    answer = program.inverse(poses)
    np.testing.assert_allclose(answer.length, expected.unstrained_length, atol=1e-12)
    np.testing.assert_allclose(answer.tension, expected.chord_tension, rtol=1e-10)


@extended
def test_what_is_not_covered_has_a_status(double: Program) -> None:
    # span, rise, tension or length, weight, stiffness
    ordinary = (3.0, -2.0, 100.0, 0.9, 14e3)
    for place, value, expected in (
        (0, -1.0, BAD_INPUT), (0, np.nan, BAD_INPUT), (0, np.inf, BAD_INPUT), (1, np.nan, BAD_INPUT),
        (1, -np.inf, BAD_INPUT), (2, -1.0, BAD_INPUT), (2, np.nan, BAD_INPUT), (3, -1.0, BAD_INPUT),
        (3, np.nan, BAD_INPUT), (4, 0.0, BAD_INPUT), (4, -1.0, BAD_INPUT), (4, np.nan, BAD_INPUT),
        (2, 0.8, DEEP_SAG), (2, 0.0, DEEP_SAG), (2, 1500.0, OVERSTRAINED), (2, np.inf, OVERSTRAINED),
    ):  # fmt: skip
        cable = [np.array([value if k == place else x]) for k, x in enumerate(ordinary)]
        status, found = double.length(*cable)
        assert status[0] == expected, (place, value)
        assert np.isnan(found).all()
        if place != 2:
            cable[2] = np.array([3.6])
            status, found = double.tension(*cable)
            assert status[0] == expected, (place, value)
            assert np.isnan(found).all()
    for length, expected in (
        (0.0, BAD_INPUT), (-3.0, BAD_INPUT), (np.nan, BAD_INPUT), (np.inf, BAD_INPUT), (7.0, DEEP_SAG),
        (1e5, DEEP_SAG), (3.0, OVERSTRAINED), (1e-3, OVERSTRAINED),
    ):  # fmt: skip
        status, found = double.tension(*(np.array([x]) for x in (3.0, -2.0, length, 0.9, 14e3)))
        assert status[0] == expected, length
        assert np.isnan(found).all()
    status, _ = double.length(*(np.array([x]) for x in (0.0, 0.0, 100.0, 0.9, 14e3)))
    assert status[0] == BAD_INPUT


@extended
def test_any_numbers_end_in_a_status(double: Program, single: Program) -> None:
    rng = np.random.default_rng(3)
    for program in (double, single):
        signs = np.where(rng.random((5, 5_000)) < 0.1, -1.0, 1.0)
        largest = 300 if program is double else 37
        wild = signs * 10.0 ** rng.uniform(-largest, largest, (5, 5_000))
        near = signs * 10.0 ** rng.uniform(-4, 4, (5, 5_000))
        for cables in (wild, near):
            for solve in (program.length, program.tension):
                status, found = solve(*cables)
                assert ((status >= SOLVED) & (status <= 6)).all()
                assert np.isfinite(found[status == SOLVED]).all()
                assert np.isnan(found[status != SOLVED]).all()


@extended
def test_poses_that_cannot_be_held_have_a_status_and_leave_the_last_answer(double: Program) -> None:
    robot = sl.load_robot(PROTOTYPE)
    turned = sl.Pose.from_euler([0.0, 0.0, 1.5], 0.0, 0.0, 0.0).matrix
    for position, matrix, expected in (
        ([0.0, 0.0, 1.5], turned, SOLVED),
        ([5.0, 0.0, 1.5], turned, INFEASIBLE),
        ([0.0, np.nan, 1.5], turned, BAD_INPUT),
        ([0.0, 0.0, 1.5], 1.01 * turned, BAD_INPUT),
        ([0.0, 0.0, 1.5], np.full((3, 3), np.nan), BAD_INPUT),
        (robot.frame_anchors[0] - robot.platform_anchors[0], turned, BAD_INPUT),
    ):
        found = double.inverse(_poses(np.array(position), matrix))
        assert found.status[0] == expected
        assert np.isnan(found.length).all() == (expected != SOLVED)
    wrench = np.array([[0.0, 0.0, np.nan, 0.0, 0.0, 0.0]])
    assert double.inverse(_poses(np.array([0.0, 0.0, 1.5]), turned), wrench).status[0] == BAD_INPUT


class _Poses(list[Array]):
    """Positions and matrices that `Pose` would refuse."""

    position: Array
    matrix: Array


def _poses(position: Array, matrix: Array) -> sl.Pose:
    found = _Poses([position])
    found.position, found.matrix = position[None], np.asarray(matrix)[None]
    return found  # type: ignore[return-value]


@extended
def test_a_pose_without_full_rank_is_singular(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    straight = robot.replace(platform_anchors=[[0.0, 0.0, z] for z in (0.25, -0.25) * 4])  # free to turn about z
    assert Program(straight, tmp_path).inverse(sl.Pose([[0.0, 0.0, 1.5]], np.eye(3)[None])).status[0] == SINGULAR


@extended
def test_the_program_on_its_page_prints_what_the_page_says(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "howto" / "microcontroller.md").read_text()
    (program,) = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    (tmp_path / "program.c").write_text(program)
    source, _, _ = sl.export_c(sl.load_robot(PROTOTYPE), tmp_path / "sagline.c")
    made = compiled(tmp_path / "program.c", tmp_path / "program", str(source))
    printed = subprocess.run([made], check=True, capture_output=True, text=True).stdout.strip()
    assert printed in re.findall(r'```text title="output"\n(.*?)\n```', page, re.DOTALL)
    (lines,) = re.findall(r"(\d+) lines written", page)
    assert int(lines) == len(source.read_text().splitlines()) // 10 * 10


@extended
def test_the_object_is_small_and_calls_nothing_but_square_roots(tmp_path: Path) -> None:
    source, _, _ = sl.export_c(sl.load_robot(PROTOTYPE), tmp_path / "sagline.c")
    made = compiled(source, tmp_path / "sagline.o", "-c")
    sections = subprocess.run(["size", "-A", str(made)], check=True, capture_output=True, text=True).stdout
    (code,) = re.findall(r"^\.text\s+(\d+)", sections, re.MULTILINE)
    assert int(code) <= 8 * 1024
    assert not re.search(r"^\.(data|bss)\s+[1-9]", sections, re.MULTILINE)  # no state
    called = subprocess.run(["nm", "-u", str(made)], check=True, capture_output=True, text=True).stdout.split()
    assert set(called) - {"U", "_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"} <= {"sqrt", "cbrt"}


def test_no_function_calls_itself_or_one_below_it(tmp_path: Path) -> None:
    source, _, _ = sl.export_c(sl.load_robot(PROTOTYPE), tmp_path / "sagline.c")
    text = source.read_text()
    heads = list(re.finditer(r"^(?:static )?(?:int|bool|real|void) (\w+)\(", text, re.MULTILINE))
    names = [head[1] for head in heads]
    assert len(names) == 15
    ends = [head.start() for head in heads[1:]] + [len(text)]
    for k, (head, end) in enumerate(zip(heads, ends, strict=True)):
        called = set(re.findall(r"(\w+)\(", text[head.end() : end]))
        assert called.isdisjoint(names[k:]), names[k]
    assert not re.search(r"\b(while|goto|malloc|alloca)\b", text)


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        (
            {"winches": sl.Winch(pulley_radius=[0, 0.05, 0, 0, 0, 0, 0, 0])},
            ("article-prototype: pulley_radius", "0.05 m at cable 1"),
        ),
        ({"winches": sl.Winch(dead_cable=4.0)}, ("article-prototype: dead_cable", "4 m at cable 0")),
        ({"tension_limits_of": "frame_end"}, ("article-prototype: tension_limits_of", "frame_end", "chord")),
    ],
)
def test_what_is_behind_the_anchors_is_refused(
    change: dict[str, object], parts: tuple[str, ...], tmp_path: Path
) -> None:
    robot = sl.load_robot(PROTOTYPE).replace(**change)
    with refused(*parts, kind=sl.InvalidValueError) as caught:
        sl.export_c(robot, tmp_path / "sagline.c")
    assert len(str(caught.value)) < 300
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", wide(sl.robot_names(), first=4))
def test_every_preset_is_exported_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    robot = sl.load_robot(name)
    behind = robot.winches is not None and robot.winches.anything_behind
    if robot.cable_count == 8 and not behind:
        source, header, scl = sl.export_c(robot, tmp_path / "robot.c")
        assert (source.name, header.name, scl.name) == ("robot.c", "robot.h", "robot.scl")
        assert '#include "robot.h"' in source.read_text()
        (words,) = re.findall(r"#define SAGLINE_TENSION_MAX \{(.*)\}", header.read_text())
        np.testing.assert_array_equal([float(word) for word in words.split(",")], robot.tension_max)
        return
    with pytest.raises(sl.InvalidValueError) as caught:
        sl.export_c(robot, tmp_path / "robot.c")
    assert (len(str(caught.value).splitlines()), len(str(caught.value)) < 300) == (1, True)


@extended
@pytest.mark.parametrize("name", ["evil */ int main(void) {", "what??/", 'a "b" \\', "@mass@", "Ärger /*"])
def test_any_name_stays_in_its_comment(name: str, tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE).replace(name=name, tension_max=np.inf)
    source, header, _ = sl.export_c(robot, tmp_path / "sagline.c")
    compiled(source, tmp_path / "sagline.o", "-O0", "-c")
    assert header.read_text().isascii()


def test_numbers_beyond_single_precision_are_refused(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE).replace(cables=sl.Cable(0.09, 1e39))
    with pytest.raises(sl.InvalidValueError) as caught:
        sl.export_c(robot, tmp_path / "sagline.c", single_precision=True)
    assert "double precision" in caught.value.next_step
    sl.export_c(robot, tmp_path / "sagline.c")


def test_a_folder_that_is_missing_and_a_name_that_is_none(tmp_path: Path) -> None:
    robot = sl.load_robot(PROTOTYPE)
    for name, step in (("nothere/sagline.c", None), ("sagline.h", "Let it end in .c: sagline.c.")):
        with refused(next_step=step, kind=sl.FileError, file=tmp_path / name):
            sl.export_c(robot, tmp_path / name)
    assert not list(tmp_path.iterdir())
