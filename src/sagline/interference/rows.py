"""Cables, rods and boxes as kernels measure them: one row of numbers each, as in kernels.interference.shapes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.interference.obstacles import Box, Capsule, Sphere
from sagline.kernels.codes import CATENARY
from sagline.kernels.interference import shapes
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.several import anchors_of


class Part(NamedTuple):
    """What of a cable counts: all of it, or all but its beginning at the frame, its end at the platform, or both."""

    cable: int
    off_frame: bool = False
    off_platform: bool = False


def cable_rows(state: Equilibrium, radius: Array) -> Array:
    """Every cable as it hangs at every pose, from where it leaves the frame; NaN where it has no tension.

    Args:
        state: The equilibrium, single or N poses.
        radius: Half the diameters [m], shape (m,) or (N, m).

    Returns:
        Shape (m, shapes.COLUMNS) or (N, m, shapes.COLUMNS).
    """
    cables, ends = state.cables, platform_ends(state)
    exits = state.exit_point
    out = np.zeros((*cables.shape, shapes.COLUMNS))
    out[..., shapes.PLACE : shapes.PLACE + 3] = exits
    out[..., shapes.RADIUS] = radius
    out[..., shapes.LAST] = 1.0
    run = (ends - exits)[..., :2]
    level = np.hypot(run[..., 0], run[..., 1])[..., None]
    upright = level == 0.0
    out[..., shapes.LEVEL : shapes.LEVEL + 2] = np.where(upright, (1.0, 0.0), run / np.where(upright, 1.0, level))
    weight = cables.cable.linear_density * cables.gravity
    hanging = np.broadcast_to((weight > 0.0) & (cables.model.code == CATENARY), cables.shape)
    values = (cables.horizontal_tension, cables.vertical_force, cables.unstrained_length)
    drop = np.zeros(()) if hanging.all() else 4.0 * cables.sag
    shallow = (cables.span, cables.rise, drop)
    for column, value, other in zip((shapes.HORIZONTAL, shapes.VERTICAL, shapes.LENGTH), values, shallow, strict=True):
        out[..., column] = np.where(hanging, value, other)
    out[..., shapes.KIND] = np.where(hanging, shapes.HANGING, shapes.PARABOLA)
    out[..., shapes.WEIGHT] = weight
    out[..., shapes.STIFFNESS] = cables.cable.axial_stiffness
    out[np.isnan(cables.unstrained_length)] = np.nan
    return out


def platform_ends(state: Equilibrium) -> Array:
    """Platform ends of the cables in the world [m], shape (m, 3) or (N, m, 3)."""
    anchors = anchors_of(state.robot).platform
    if anchors.ndim == 2:
        return state.pose.transform(anchors)
    turned = np.einsum("nij,nmj->nmi", state.pose.matrix, anchors)
    return np.asarray(turned + state.pose.position[:, None])


def parts_of(cables: Array, lengths: Array, parts: tuple[Part, ...], left_out: float) -> Array:
    """Rows of parts of cables: so much unstrained length of an end left out, of a shorter cable all but its other end.

    Args:
        cables: Of `cable_rows`, shape (N, m, COLUMNS).
        lengths: Unstrained lengths [m], shape (N, m).
        parts: Which.
        left_out: How much [m].

    Returns:
        Shape (N, len(parts), COLUMNS).
    """
    out = cables[:, [part.cable for part in parts]]
    for k, part in enumerate(parts):
        share = np.minimum(left_out / lengths[:, part.cable], 0.5 if part.off_frame and part.off_platform else 1.0)
        if part.off_frame:
            out[:, k, shapes.FIRST] = share
        if part.off_platform:
            out[:, k, shapes.LAST] = 1.0 - share
    return out


def rod_row(rod: Capsule | Sphere) -> Array:
    """A capsule or sphere, shape (COLUMNS,)."""
    start, end = (rod.start, rod.end) if isinstance(rod, Capsule) else (rod.center, rod.center)
    out = np.zeros(shapes.COLUMNS)
    run = end - start
    span = float(np.hypot(run[0], run[1]))
    out[shapes.KIND], out[shapes.RADIUS], out[shapes.LAST] = shapes.PARABOLA, rod.radius, 1.0
    out[shapes.PLACE : shapes.PLACE + 3] = start
    out[shapes.LEVEL : shapes.LEVEL + 2] = run[:2] / span if span > 0.0 else (1.0, 0.0)
    out[shapes.SPAN], out[shapes.RISE] = span, run[2]
    return out


def box_rows(box: Box, pose: Pose | None = None) -> Array:
    """A box at rest, shape (COLUMNS,), or taken along by a pose or N of them, shape (N, COLUMNS)."""
    shape = () if pose is None else pose.shape
    out = np.zeros((*shape, shapes.COLUMNS))
    turn = box.orientation if pose is None else pose.matrix @ box.orientation
    out[..., shapes.KIND] = shapes.BOX
    out[..., shapes.PLACE : shapes.PLACE + 3] = box.center if pose is None else pose.transform(box.center)
    out[..., shapes.AXES : shapes.AXES + 9] = turn.reshape(*shape, 9)
    out[..., shapes.HALF : shapes.HALF + 3] = 0.5 * box.size
    return out
