"""Bodies as rows of numbers for the kernels (`kernels.interference.shapes`), and the pairs to measure."""

from __future__ import annotations

from itertools import combinations
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, Indices, locked
from sagline.interference.obstacles import Box, Capsule, Mesh, Sphere
from sagline.kernels.codes import CATENARY
from sagline.kernels.interference import shapes
from sagline.robot.batch import Robots, robot_fields
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose


class _CablePart(NamedTuple):
    """Measured part of a cable: the whole cable, or the cable without a length at one end or at both ends."""

    cable: int
    off_frame: bool = False
    off_platform: bool = False


def cable_rows(state: Equilibrium, radius: Array) -> Array:
    """Rows of the cables from their exit points on, NaN for a cable without tension. `radius`: (m,) or (N, m) [m]."""
    cables, ends = state.cables, _platform_ends(state)
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


def _platform_ends(state: Equilibrium) -> Array:
    """Platform ends of the cables in the world [m], shape (m, 3) or (N, m, 3)."""
    (anchors,) = robot_fields(state.robot, "platform_anchors")
    if anchors.ndim == 2:
        return state.pose.transform(anchors)
    turned = np.einsum("nij,nmj->nmi", state.pose.matrix, anchors)
    return np.asarray(turned + state.pose.position[:, None])


def rows_of_parts(cables: Array, lengths: Array, parts: tuple[_CablePart, ...], left_out: float) -> Array:
    """Rows (N, len(parts), COLUMNS) of `parts` of the cables. `left_out`: unstrained length omitted at an end [m]."""
    out = cables[:, [part.cable for part in parts]]
    for k, part in enumerate(parts):
        share = np.minimum(left_out / lengths[:, part.cable], 0.5 if part.off_frame and part.off_platform else 1.0)
        if part.off_frame:
            out[:, k, shapes.FIRST] = share
        if part.off_platform:
            out[:, k, shapes.LAST] = 1.0 - share
    return out


def rod_row(rod: Capsule | Sphere) -> Array:
    """Row of the capsule or sphere `rod`, shape (COLUMNS,)."""
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
    """Row of a box at rest, (COLUMNS,), or rows of a box that moves with N poses, (N, COLUMNS)."""
    shape = () if pose is None else pose.shape
    out = np.zeros((*shape, shapes.COLUMNS))
    turn = box.orientation if pose is None else pose.matrix @ box.orientation
    out[..., shapes.KIND] = shapes.BOX
    out[..., shapes.PLACE : shapes.PLACE + 3] = box.center if pose is None else pose.transform(box.center)
    out[..., shapes.AXES : shapes.AXES + 9] = turn.reshape(*shape, 9)
    out[..., shapes.HALF : shapes.HALF + 3] = 0.5 * box.size
    return out


Obstacle = Box | Capsule | Sphere | Mesh

PLATFORM: Final = "platform"
_SAME = 1e-9  # anchors count as one anchor if their distance, relative to the robot's extent, is smaller
_NO_LENGTH = "cables and platform: give from_anchor, the length of cable at the anchor that is not measured"


class Pairs(NamedTuple):
    """Pairs of numbered bodies: first all parts of cables, then the platform (even without shape), then obstacles."""

    parts: tuple[_CablePart, ...]  # parts of cables that occur in pairs
    by_kernel: Indices  # numbers of the pairs that kernels measure, shape (P, 2)
    with_mesh: Indices  # numbers of the pairs with at least one mesh, shape (Q, 2)
    names: tuple[tuple[str, str], ...]  # names of all pairs, in the order of their numbers
    left_out: tuple[str, ...]  # pairs that are not measured, with the reasons


Body = _CablePart | int  # part of a cable, -1 for the platform, or number of an obstacle


def pairs_of(
    robot: Robots, obstacles: tuple[Obstacle, ...], platform: Box | Mesh | None, *, from_anchor: bool
) -> Pairs:
    """All pairs of bodies of a robot and obstacles. Without `from_anchor`, pairs with a common anchor are omitted."""
    at_frame, at_platform = (_together(anchors) for anchors in robot_fields(robot, "frame_anchors", "platform_anchors"))
    cables = range(len(at_frame))
    found: list[tuple[Body, Body]] = []  # part of a cable, -1 for the platform, or number of an obstacle
    left_out: list[str] = []
    for i, j in combinations(cables, 2):
        shared = bool(at_frame[i, j]), bool(at_platform[i, j])
        if all(shared) or (any(shared) and not from_anchor):
            where = " and ".join(name for name, there in zip(("frame", PLATFORM), shared, strict=True) if there)
            left_out.append(f"cable {i} and cable {j}: they share their anchor on the {where}")
        else:
            found.append((_CablePart(i, *shared), _CablePart(j, *shared)))
    found += [(_CablePart(i, off_frame=from_anchor), k) for k in range(len(obstacles)) for i in cables]
    if platform is not None:
        found += [(-1, k) for k in range(len(obstacles))]
        found += [(_CablePart(i, off_platform=True), -1) for i in cables if from_anchor]
        left_out += [] if from_anchor else [_NO_LENGTH]
    parts = tuple(dict.fromkeys(one for pair in found for one in pair if isinstance(one, _CablePart)))
    forms = (platform, *obstacles)
    own = _names(obstacles)

    def number(one: Body) -> int:
        return parts.index(one) if isinstance(one, _CablePart) else len(parts) + 1 + one

    def name(one: Body) -> str:
        return f"cable {one.cable}" if isinstance(one, _CablePart) else PLATFORM if one < 0 else own[one]

    def form(one: Body) -> object:
        return one if isinstance(one, _CablePart) else forms[1 + one]

    def in_order(pair: tuple[Body, Body]) -> tuple[Body, Body]:
        boxes = [isinstance(form(one), Box) for one in pair]
        return pair[::-1] if boxes == [True, False] else pair  # in kernels, a box is the second body of a pair

    other = [pair for pair in found if any(isinstance(form(one), Mesh) for one in pair)]
    plain = [in_order(pair) for pair in found if pair not in other]
    numbers = (np.array([[number(a), number(b)] for a, b in some], dtype=np.int64) for some in (plain, other))
    by_kernel, with_mesh = (locked(array.reshape(-1, 2)) for array in numbers)
    return Pairs(parts, by_kernel, with_mesh, tuple((name(a), name(b)) for a, b in plain + other), tuple(left_out))


def _together(anchors: Array) -> NDArray[np.bool_]:
    """Mask (m, m) of the pairs of cables that have a common anchor in any robot of a batch."""
    apart = np.linalg.norm(anchors[..., :, None, :] - anchors[..., None, :, :], axis=-1)
    same: NDArray[np.bool_] = (apart <= _SAME * max(1.0, float(np.abs(anchors).max()))).reshape(-1, *apart.shape[-2:])
    return np.asarray(same.any(axis=0))


def _names(obstacles: tuple[Obstacle, ...]) -> list[str]:
    """Names of the obstacles; a repeated name gets a number."""
    names: list[str] = []
    for one in obstacles:
        again = sum(other.name == one.name for other in obstacles[: len(names)])
        names.append(one.name if not again else f"{one.name} {again + 1}")
    return names
