"""Arrays of robots and poses for kernels, and chord geometry of the cables."""

from __future__ import annotations

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import CableGeometryError, InvalidValueError
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry as rows
from sagline.kernels.cable.geometry import cable_geometries
from sagline.robot.batch import (
    Robots,
    cable_ends,
    first_of,
    has_slanted_axes,
    on_platform,
    pulley_radius,
    pulleys_of,
    refuse_slanted,
)
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


def cable_table(robot: Robots, slanted: bool = False) -> Array:
    """Table (1 or N, m, CABLE_COLUMNS) with anchors, material and limits; columns of `sagline.kernels.tables`."""
    # slanted: True if the caller supports swivel axes that are not vertical and winches on the platform; the table of
    # such a robot has SWIVEL_COLUMNS columns. It is refused otherwise.
    if slanted and has_slanted_axes(robot):
        return locked(np.array([slanted_rows(one) for one in ((robot,) if isinstance(robot, Robot) else robot)]))
    refuse_slanted(robot)
    robots = (robot,) if isinstance(robot, Robot) else robot
    return locked(np.array([_cable_rows(one, pulleys_of(one)) for one in robots]))


def has_pulley_model(robot: Robots, model: CableModel) -> bool:
    """True for a cable model with the pulleys of a robot: with those of `has_slanted_axes`, exact or weightless."""
    return model.code in (codes.CATENARY, codes.ELASTIC) or not has_slanted_axes(robot)


def check_slanted(robot: Robots, model: CableModel) -> None:
    """Refuse a cable model without the pulleys of a robot."""
    if not has_pulley_model(robot, model):
        step = "Use the default model; the others have vertical swivel axes at the frame only."
        raise InvalidValueError("model", type(model).__name__, "Catenary or Elastic for such swivel axes", step)


def slanted_rows(robot: Robot) -> Array:
    """Rows of `cable_table` with swivel axes of any direction, (m, SWIVEL_COLUMNS)."""
    winches, m = robot.winches, robot.cable_count
    if winches is None:
        radius, axes, entry = np.zeros(m), np.tile((0.0, 0.0, 1.0), (m, 1)), np.ones(m)
    else:
        radius, axes = winches.pulley_radius, winches.swivel_axis
        entry = np.where(winches.slanted, np.nan, np.where(axes[:, 2] < 0.0, -1.0, 1.0))
        entry[winches.on_platform] = 0.0
    return np.hstack((_cable_rows(robot, (radius, entry)), axes))


def body_table(robot: Robots) -> Array:
    """Table (1 or N, BODY_COLUMNS) with mass, gravity and center of mass; columns of `sagline.kernels.tables`."""
    robots = (robot,) if isinstance(robot, Robot) else robot
    return locked(np.array([[one.mass, one.gravity, *one.center_of_mass] for one in robots]))


def pose_rows(pose: Pose) -> Array:
    """Rows (N, POSE_COLUMNS) with positions and quaternions of a batch; one row for a single pose."""
    rows = np.concatenate((np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion)), axis=1)
    return locked(rows)


def robot_terms(robot: Robots, slanted: bool = False, anchors: Array | None = None) -> tuple[Array, Array, Array]:
    """Arrays of one or several robots for kernels: matrix of free motions (n, 6), `body_table` and `cable_table`."""
    # anchors: frame anchors of one robot at N poses, (N, m, 3) [m]; None for those of the robots.
    table = cable_table(robot, slanted)
    if anchors is not None:
        table = np.repeat(table, len(anchors), axis=0)
        table[..., tables.FRAME_X : tables.FRAME_Z + 1] = anchors
    return first_of(robot).freedom, body_table(robot), locked(table)


def _cable_rows(robot: Robot, pulleys: tuple[Array, Array]) -> Array:
    """Rows of `cable_table` for one robot, (m, CABLE_COLUMNS). `pulleys`: radius and entry, (m,) each."""
    none = np.zeros(robot.cable_count)
    run = (none, none) if robot.winches is None else (robot.winches.dead_cable, robot.winches.dead_rise)
    columns = (
        robot.frame_anchors,
        robot.platform_anchors,
        robot.cables.linear_density[:, None],
        robot.cables.axial_stiffness[:, None],
        robot.tension_min[:, None],
        robot.tension_max[:, None],
        np.stack((*pulleys, *run), axis=1),  # radius, entry, dead length, dead rise
    )
    return np.hstack(columns)


def chord_geometry(robot: Robots, pose: Pose, slanted: bool = False) -> Array:
    """Geometry (N, GEOMETRY_ROWS, m) of all cables at all poses; rows of `sagline.kernels.cable.geometry`."""
    return geometry_of(cable_table(robot, slanted), body_table(robot), pose_rows(pose))


def geometry_of(cables: Array, bodies: Array, poses: Array) -> Array:
    """`chord_geometry` of a `cable_table`, a `body_table` and pose rows (N, POSE_COLUMNS)."""
    out = np.empty((len(poses), rows.GEOMETRY_ROWS, cables.shape[1]))
    with np.errstate(all="ignore"):
        cable_geometries(cables, bodies, poses, np.empty((3, 3)), out)
    return out


def tangent_exits(table: Array, pose: Pose, geometry: Array) -> Array:
    """Exit points (N, m, 3) of straight cables in world axes [m]; NaN without a tangent.

    `table` (1 or N, m, SWIVEL_COLUMNS) and `geometry` (N, GEOMETRY_ROWS, m) have swivel axes of any direction.
    """
    anchors = table[..., tables.PLATFORM_X : tables.DENSITY] @ np.swapaxes(pose.matrix.reshape(-1, 3, 3), -1, -2)
    level = geometry[:, rows.SPAN, :, None] * np.moveaxis(geometry[:, rows.AZIMUTH_X : rows.AZIMUTH_Y + 1], 1, -1)
    tangent = np.concatenate((level, geometry[:, rows.RISE, :, None]), axis=-1)
    aboard, frame = table[..., tables.ENTRY, None] == 0.0, table[..., : tables.PLATFORM_X]
    return np.asarray(np.where(aboard, frame, pose.position.reshape(-1, 1, 3) + anchors) - tangent)


def eyelets_at(table: Array, pose: Pose, exits: Array) -> Array:
    """Table (N, m, CABLE_COLUMNS) of cables from eyelets at their exit points `exits` (N, m, 3) [m], world axes."""
    aboard = table[..., tables.ENTRY, None] == 0.0
    turned = (exits - pose.position.reshape(-1, 1, 3)) @ pose.matrix.reshape(-1, 3, 3)
    eyelets = np.empty((len(exits), table.shape[1], tables.CABLE_COLUMNS))
    eyelets[:] = table[..., : tables.CABLE_COLUMNS]
    eyelets[..., tables.PULLEY_RADIUS :] = 0.0
    eyelets[..., tables.ENTRY] = 1.0
    np.copyto(eyelets[..., : tables.PLATFORM_X], exits, where=~aboard)
    np.copyto(eyelets[..., tables.PLATFORM_X : tables.DENSITY], turned, where=aboard)
    return eyelets


def has_chords(robot: Robot, pose: Pose) -> Flags:
    """True for poses (N,) at which every cable has a chord."""
    chord = chord_geometry(robot, pose, slanted=True)[:, rows.CHORD]
    return np.asarray((chord >= tables.SHORTEST_CHORD).all(axis=1))


def touching_angle(robot: Robot, pose: Pose) -> Array:
    """Wrap angles psi (m,) [rad] of straight cables, which are tangents between platform ends and pulleys."""
    geometry, axis = chord_geometry(robot, pose, slanted=True)[0], cable_ends(robot, pose).axis
    level = geometry[[rows.AZIMUTH_X, rows.AZIMUTH_Y]] * geometry[rows.COSINE]
    tangent = np.vstack((level, geometry[rows.SINE])).T  # from the exit point along the cable
    along = (tangent * axis).sum(axis=1)
    across = np.linalg.norm(tangent - along[:, None] * axis, axis=1)
    return np.where(pulley_radius(robot) > 0.0, np.arctan2(across, along), 0.0)


def refuse_missing_chords(robot: Robots, pose: Pose, geometry: Array | None = None) -> None:
    """Refuse poses at which both ends of a cable coincide, or no tangent to the pulley exists."""
    chord = (chord_geometry(robot, pose) if geometry is None else geometry)[:, rows.CHORD]
    missing = np.argwhere(~(chord >= tables.SHORTEST_CHORD))
    if not len(missing):
        return
    row, cable = (int(k) for k in missing[0])
    item = f"pose{f' {row}' if pose.shape else ''}, cable {cable}"
    one, here = (robot if isinstance(robot, Robot) else robot[row]), (pose[row] if pose.shape else pose)
    radius = 0.0 if one.winches is None else float(one.winches.pulley_radius[cable])
    if has_slanted_axes(one):
        value, step = "inside its pulley or on its near side", "Move the platform away, or correct the pulley."
        end = "frame" if on_platform(one)[cable] else "platform"
        raise CableGeometryError(f"{item}: its {end} end", value, f"outside, radius {radius:g} m", step)
    if radius > 0.0:
        raise _inside_pulley(item, one, here, cable, radius)
    raise CableGeometryError(
        f"{item}: distance between its ends",
        f"{round(float(chord[row, cable]), 12):g} m",
        f">= {tables.SHORTEST_CHORD:g} m",
        "Move the platform or the anchor, so that the two ends are apart.",
    )


def _inside_pulley(item: str, robot: Robot, pose: Pose, cable: int, radius: float) -> CableGeometryError:
    """Error for a platform end inside or on its pulley, from which no tangent to the pulley exists."""
    away = pose.transform(robot.platform_anchors)[cable] - robot.frame_anchors[cable]
    ahead = float(pulleys_of(robot).entry[cable] * away[2])  # height above the anchor, in the direction of entry
    half = np.sqrt(max(radius**2 - max(ahead, 0.0) ** 2, 0.0))
    near = f"< {radius - half:.6g} m or " if ahead > 0.0 else ""
    return CableGeometryError(
        f"{item}: distance of its platform end from the swivel axis, inside the pulley or on its near side,",
        f"{float(np.hypot(away[0], away[1])):.9g} m",
        f"{near}> {radius + half:.6g} m there",
        f"Move the platform away, or correct its pulley_radius, {radius:g} m.",
    )
