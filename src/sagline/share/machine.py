"""Data and solids of a robot for a shared page, and a drawing for pages without JavaScript."""

from __future__ import annotations

from html import escape
from math import isfinite
from typing import Any, Final

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arrays import Array
from sagline.robot.batch import pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds, home_pose
from sagline.robot.robot import Robot
from sagline.share.packing import PackedColumn, encode_columns
from sagline.viewer import shapes
from sagline.viewer.tension_scale import ForceUnit, TensionScale

DIGITS: Final = 12  # significant digits of the numbers in a page
FINEST: Final = 1e-5  # resolution of its solids, as a share of the robot's size
WIDE: Final = 640.0  # px
EDGE: Final = 12.0  # px, margin
_RIGHT: Final = np.array([0.9, 0.436, 0.0])
_UP: Final = np.array([-0.154, 0.318, 0.936])
_EDGES: Final = [(a, b) for a in range(8) for b in range(a) if (a ^ b) in (1, 2, 4)]


def model_data(robot: Robot) -> dict[str, Any]:
    """Data of the model of docs/model.md, for page/robot.js; None for no upper limit."""
    radius, entry = pulleys_of(robot)
    winches = robot.winches
    nothing = np.zeros(robot.cable_count)
    dead, rise = (nothing, nothing) if winches is None else (winches.dead_cable, winches.dead_rise)
    columns = {
        "frame": robot.frame_anchors,
        "platform": robot.platform_anchors,
        "density": robot.cables.linear_density,
        "stiffness": robot.cables.axial_stiffness,
        "low": robot.tension_min,
        "high": robot.tension_max,
        "radius": radius,
        "entry": entry,
        "dead": dead,
        "rise": rise,
    }
    whole = {
        name: np.broadcast_to(column, (robot.cable_count, *np.shape(column)[1:])) for name, column in columns.items()
    }
    return {
        "mass": robot.mass,
        "center_of_mass": json_numbers(robot.center_of_mass),
        "gravity": robot.gravity,
        "freedom": json_numbers(robot.freedom),
        "limits_of": robot.tension_limits_of,
        "cables": [{name: json_numbers(column[i]) for name, column in whole.items()} for i in range(robot.cable_count)],
    }


def solids_data(robot: Robot) -> dict[str, Any]:
    """Solids of frame, winches and platform, for page/scene.js."""
    low, high = bounds(robot)
    body, size = shapes.platform_solid(robot), shapes.size_of(robot)
    drawn = {"frame": shapes.frame_solid(robot), "winches": shapes.winch_solid(robot), "platform": body}
    meshes = {name: _triangles(each, size) for name, each in drawn.items() if len(each.faces)}
    least, most = body.vertices.min(axis=0), body.vertices.max(axis=0)
    middle, grip = 0.5 * (least + most), 0.5 * float(np.linalg.norm(most - least))
    there = np.vstack((low, high, home_pose(robot).transform(body.vertices)))  # a platform may extend beyond its frame
    seen = [json_numbers(there.min(axis=0)), json_numbers(there.max(axis=0))]
    box = {"low": json_numbers(low), "high": json_numbers(high), "seen": seen}
    return {**box, "middle": json_numbers(middle), "grip": json_numbers(grip), **meshes}


def colors(robot: Robot) -> dict[str, Any]:
    """Colors of tensions with their numbers."""
    scale, unit = TensionScale.of(robot), ForceUnit.up_to(float(_highest(robot)))
    shares = np.linspace(0.0, 1.0, 24)
    steps = scale.low * (scale.high / scale.low) ** shares
    ticks = scale.ticks()
    return {
        "low": scale.low,
        "high": scale.high,
        "steps": scale.colors(steps).tolist(),
        "ticks": [[float(scale.fraction(np.array(tick))), f"{tick / unit.newtons:,g}"] for tick in ticks],
        "unit": unit.name,
        "newtons": unit.newtons,
        "digits": 1 if unit.newtons == 1.0 else 2,
    }


def json_numbers(values: Any) -> Any:
    """Numbers for JSON, rounded to `DIGITS`; None for infinite ones."""
    if np.ndim(values):
        return [json_numbers(each) for each in values]
    value = float(values)
    short = float(f"{value:.{DIGITS}g}")
    return (int(short) if short == int(short) and abs(short) < 1e15 else short) if isfinite(value) else None


def _highest(robot: Robot) -> float:
    limited = robot.tension_max[np.isfinite(robot.tension_max)]
    return float(limited.max()) if limited.size else robot.mass * robot.gravity


def _triangles(solid: shapes.Solid, size: float) -> tuple[dict[str, object], str]:
    """Corners of all triangles, encoded."""
    return encode_columns([PackedColumn("corners", solid.vertices[solid.faces].reshape(-1, 3), FINEST * size)])


def robot_drawing(robot: Robot, pose: Pose, tension: Array) -> str:
    """SVG of frame, platform and the catenaries of chord tensions."""
    ends = shapes.chords(robot, pose)
    run = ends[:, 1] - ends[:, 0]
    known = np.isfinite(tension) & (np.linalg.norm(run, axis=1) > 0.0)
    courses = shapes.straight(ends)
    if known.all():
        cables = Catenary().from_tension(robot.cables, np.hypot(*run[:, :2].T), run[:, 2], tension, robot.gravity)
        courses = shapes.catenaries(ends, cables, 1.0)
    low, high = bounds(robot)
    frame = np.array(np.meshgrid(*zip(low, high, strict=True), indexing="ij")).reshape(3, -1).T
    body = shapes.platform_solid(robot)
    box = np.array(np.meshgrid(*zip(body.vertices.min(axis=0), body.vertices.max(axis=0), strict=True), indexing="ij"))
    platform = pose.transform(box.reshape(3, -1).T)
    groups = [_seen(each) for each in (frame, platform, *courses)]
    every = np.concatenate(groups)
    least, size = every.min(axis=0), np.ptp(every, axis=0)
    scale = (WIDE - 2.0 * EDGE) / size[0]
    frame, platform, *drawn_courses = (EDGE + scale * (each - least) for each in groups)
    colors = TensionScale.of(robot).colors(tension)
    drawn = [_line(frame[[a, b]], "#7f878f", 1.5) for a, b in _EDGES]
    drawn += [_line(each, f"rgb({r} {g} {b})", 2.0) for each, (r, g, b) in zip(drawn_courses, colors, strict=True)]
    drawn += [_line(platform[[a, b]], "#3a86c9", 2.5) for a, b in _EDGES]
    tall = scale * size[1] + 2.0 * EDGE
    label = escape(f"{robot.name}: its platform on cables")
    head = f'<svg viewBox="0 0 {WIDE:g} {tall:.0f}" width="{WIDE:g}" role="img" aria-label="{label}">'
    return f"{head}{''.join(drawn)}</svg>"


def _seen(points: Array) -> Array:
    """Projection to the right and down, shape (..., 2)."""
    return np.stack((points @ _RIGHT, -(points @ _UP)), axis=-1)


def _line(points: Array, color: str, width: float) -> str:
    way = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{way}" fill="none" stroke="{color}" stroke-width="{width:g}"/>'
