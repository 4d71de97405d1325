"""Data and solids of a robot for a shared page, and its drawing for browsers without JavaScript."""

from __future__ import annotations

import json
import zlib
from html import escape
from importlib.metadata import version
from math import isfinite
from typing import Any, Final

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import AnyArray, Array, locked
from sagline.kernels import tables
from sagline.kernels.cable.batch import cable_courses
from sagline.kernels.cable.geometry import GEOMETRY_ROWS
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward_rows import ForwardRows, new_chain
from sagline.kinematics.inverse_rows import UNDECIDED, InverseRows, covers_all
from sagline.kinematics.status import ForwardStatus, PoseStatus
from sagline.robot.batch import has_routing, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds, home_pose
from sagline.robot.robot import Robot
from sagline.share.packing import MODULE, Call, PackedColumn, check_module, described_calls, encode_columns
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import kernel_options
from sagline.tension.methods import DEFAULT
from sagline.viewer import shapes
from sagline.viewer.tension_scale import ForceUnit, TensionScale

DIGITS: Final = 12  # significant digits of the numbers in a page
FINEST: Final = 1e-5  # resolution of the solids, as a share of the robot's size
WIDE: Final = 640.0  # px
EDGE: Final = 12.0  # px, margin
_RIGHT: Final = np.array([0.9, 0.436, 0.0])
_UP: Final = np.array([-0.154, 0.318, 0.936])


def drawing_data(robot: Robot) -> dict[str, Any]:
    """Data for page/sagline.mjs: the call of the kernel that draws the cables of a run, and the data of `robot`."""
    pose, tension = np.zeros((1, tables.POSE_COLUMNS)), np.zeros(robot.cable_count)
    arguments = _draw_arguments(robot, robot_terms(robot), pose[0], tension)
    return _described(robot, {"draw": ("cable_courses", arguments)}, pose, arguments)


def model_data(robot: Robot) -> dict[str, Any]:
    """Data for page/sagline.mjs: calls of the kernels of kinematics and drawing, and the data of `robot`."""
    behind, m, n = has_routing(robot) or None, robot.cable_count, robot.degrees_of_freedom
    model, method = Catenary(), DEFAULT.alone
    terms, options, memory = robot_terms(robot), kernel_options(robot, model, method), memory_for(m)
    pose, length, tension = np.zeros((1, tables.POSE_COLUMNS)), np.zeros((1, m)), np.zeros(m)
    wrench, first, reference = (locked(each) for each in (np.zeros((1, 6)), np.zeros(1, np.int64), np.full(m, np.nan)))
    found, rest = InverseRows.empty(robot, 1), ForwardRows.empty(robot, 1)
    given = terms, pose, wrench
    decided = first, covers_all(method.code, m - n), memory, found.answers, found.proofs
    forward = (model.code, *model.parameters, behind), False, (*terms, length, pose, wrench), new_chain(m, n)
    draw = _draw_arguments(robot, terms, pose[0], tension)
    calls = {
        "inverse": ("inverse_poses", (*options, *given, reference, memory, None, False, found.answers, 0, 1)),
        "decide": ("decide_poses", (options.model, options.limits, *given, *decided)),
        "forward": (f"forward_poses{'_pulleys' * bool(behind)}", (*forward, memory, rest.arrays)),
        "draw": ("cable_courses", draw),
    }
    arrays = {
        "span": found.results[tables.SPAN, 0],
        "rise": found.results[tables.RISE, 0],
        "tension": found.results[tables.TENSION, 0],
        "length": found.results[tables.LENGTH, 0],
        "status": found.pose_status,
        "bracket": found.brackets,
        "blocking": found.blocking,
        "given": length,
        "rest": rest.poses,
        "restTension": rest.results[tables.TENSION, 0],
        "restStatus": rest.pose_status,
    }
    return {
        **_described(robot, calls, pose, draw, arrays),
        "statuses": {each.value: each.text.partition(";")[0] for each in PoseStatus},
        "rests": {each.value: each.text.partition(";")[0] for each in ForwardStatus},
        "undecided": list(UNDECIDED),
        "lost": [ForwardStatus.NOT_CONVERGED.value, ForwardStatus.NO_LENGTHS.value],
        "chordless": PoseStatus.NO_CHORD.value,
        "infeasible": PoseStatus.INFEASIBLE.value,
        "freedom": json_numbers(robot.freedom),
    }


def javascript_text(robot: Robot) -> str:
    """JSON of `model_data` for the JavaScript package; it fits the module of this version only."""
    check_module()
    about = {"name": robot.name, "version": version("sagline"), "module": zlib.crc32(MODULE.read_bytes())}
    return json.dumps(about | model_data(robot), allow_nan=False, separators=(",", ":")) + "\n"


def _described(
    robot: Robot, calls: dict[str, Call], pose: Array, draw: tuple[Any, ...], arrays: dict[str, AnyArray] | None = None
) -> dict[str, Any]:
    """Described `calls` and `arrays`, anchors [m] and pulley radii [m]. `draw`: arguments of the drawing kernel."""
    drawn = {"pose": pose, "drawn": draw[3], "points": draw[-1]}
    return {
        "kernels": described_calls(calls, drawn | (arrays or {})),
        "anchors": json_numbers(robot.frame_anchors),
        "ends": json_numbers(robot.platform_anchors),
        "radii": json_numbers(pulleys_of(robot).radius + np.zeros(robot.cable_count)),
    }


def solids_data(robot: Robot) -> dict[str, Any]:
    """Solids of frame, winches and platform, for page/scene.js."""
    low, high = bounds(robot)
    body, size = shapes.Solid.platform(robot), shapes.size_of(robot)
    drawn = {"frame": shapes.Solid.frame(robot), "winches": shapes.Solid.winches(robot), "platform": body}
    meshes = {name: _triangles(each, size) for name, each in drawn.items() if len(each.faces)}
    least, most = body.vertices.min(axis=0), body.vertices.max(axis=0)
    middle, grip = 0.5 * (least + most), 0.5 * float(np.linalg.norm(most - least))
    there = np.vstack((low, high, home_pose(robot).transform(body.vertices)))  # a platform may be larger than the frame
    seen = [json_numbers(there.min(axis=0)), json_numbers(there.max(axis=0))]
    box = {"low": json_numbers(low), "high": json_numbers(high), "seen": seen}
    return {**box, "middle": json_numbers(middle), "grip": json_numbers(grip), **meshes}


def colors(robot: Robot) -> dict[str, Any]:
    """Color scale of the tensions: colors, ticks and unit."""
    scale, unit = TensionScale.of(robot), ForceUnit.up_to(float(_highest(robot)))
    ticks = scale.ticks()
    return {
        "low": scale.low,
        "high": scale.high,
        "steps": scale.bar(24).tolist(),
        "ticks": [[float(scale.fraction(np.array(tick))), f"{tick / unit.newtons:,g}"] for tick in ticks],
        "unit": unit.name,
        "newtons": unit.newtons,
        "digits": 1 if unit.newtons == 1.0 else 2,
    }


def json_numbers(values: Any) -> Any:
    """Round numbers to `DIGITS` for JSON; infinite numbers become None."""
    if np.ndim(values):
        return [json_numbers(each) for each in values]
    value = float(values)
    short = float(f"{value:.{DIGITS}g}")
    return (int(short) if short == int(short) and abs(short) < 1e15 else short) if isfinite(value) else None


def _highest(robot: Robot) -> float:
    limited = robot.tension_max[np.isfinite(robot.tension_max)]
    return float(limited.max()) if limited.size else robot.mass * robot.gravity


def _triangles(solid: shapes.Solid, size: float) -> tuple[dict[str, object], str]:
    return encode_columns([PackedColumn("corners", solid.vertices[solid.faces].reshape(-1, 3), FINEST * size)])


def courses_at(robot: Robot, pose: Pose, tension: Array) -> Array:
    """Points (m, points_per_cable, 3) of exact cables at chord tensions `tension` (m,). NaN gives a straight line."""
    arguments = _draw_arguments(robot, robot_terms(robot), pose_rows(pose)[0], tension)
    cable_courses(*arguments)
    points: Array = arguments[-1]
    return points


def _draw_arguments(robot: Robot, terms: tuple[Array, Array, Array], pose: Array, tension: Array) -> tuple[Any, ...]:
    """Arguments of `cable_courses`. The last argument is the array of points. `pose` is a pose row."""
    m, points = robot.cable_count, shapes.points_per_cable(robot)
    work = np.empty((3, 3)), np.empty((GEOMETRY_ROWS, m)), np.empty((m, points, 3))
    return terms[2][0], terms[1][0], pose, tension, points - shapes.POINTS, *work


def robot_drawing(robot: Robot, pose: Pose, tension: Array) -> str:
    """SVG drawing of frame, platform and cables at `pose`. `tension`: chord tensions (m,) [N]."""
    courses = courses_at(robot, pose, tension)
    low, high = bounds(robot)
    frame, body = shapes.box_corners(low, high), shapes.Solid.platform(robot).vertices
    platform = pose.transform(shapes.box_corners(body.min(axis=0), body.max(axis=0)))
    groups = [_seen(each) for each in (frame, platform, *courses)]
    every = np.concatenate(groups)
    least, size = every.min(axis=0), np.ptp(every, axis=0)
    scale = (WIDE - 2.0 * EDGE) / size[0]
    frame, platform, *drawn_courses = (EDGE + scale * (each - least) for each in groups)
    colors = TensionScale.of(robot).colors(tension)
    drawn = [_line(frame[[b, a]], "#7f878f", 1.5) for a, b in shapes.BOX_EDGES]
    drawn += [_line(each, f"rgb({r} {g} {b})", 2.0) for each, (r, g, b) in zip(drawn_courses, colors, strict=True)]
    drawn += [_line(platform[[b, a]], "#3a86c9", 2.5) for a, b in shapes.BOX_EDGES]
    tall = scale * size[1] + 2.0 * EDGE
    label = escape(f"{robot.name}: its platform on cables")
    head = f'<svg viewBox="0 0 {WIDE:g} {tall:.0f}" width="{WIDE:g}" role="img" aria-label="{label}">'
    return f"{head}{''.join(drawn)}</svg>"


def _seen(points: Array) -> Array:
    """Projected coordinates to the right and down, shape (..., 2)."""
    return np.stack((points @ _RIGHT, -(points @ _UP)), axis=-1)


def _line(points: Array, color: str, width: float) -> str:
    way = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{way}" fill="none" stroke="{color}" stroke-width="{width:g}"/>'
