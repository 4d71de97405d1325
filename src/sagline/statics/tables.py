"""Robots and poses as arrays for kernels, and chord geometry of the cables."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.errors import CableGeometryError
from sagline.kernels.cable import geometry as rows
from sagline.kernels.cable.geometry import cable_geometries
from sagline.kernels.statics import SHORTEST_CHORD
from sagline.robot.batch import Robots, first_of, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


def cable_table(robot: Robots) -> Array:
    """Anchors, material and limits of the cables, columns as in kernels.tables, (1 or N, m, CABLE_COLUMNS)."""
    robots = (robot,) if isinstance(robot, Robot) else robot
    return locked(np.array([_cable_rows(one) for one in robots]))


def body_table(robot: Robots) -> Array:
    """Mass, gravity and center of mass of the platform, columns as in kernels.tables, (1 or N, BODY_COLUMNS)."""
    robots = (robot,) if isinstance(robot, Robot) else robot
    return locked(np.array([[one.mass, one.gravity, *one.center_of_mass] for one in robots]))


def pose_rows(pose: Pose) -> Array:
    """Positions and quaternions of a pose or a batch, (N, POSE_COLUMNS)."""
    rows = np.concatenate((np.atleast_2d(pose.position), np.atleast_2d(pose.quaternion)), axis=1)
    return locked(rows)


def robot_terms(robot: Robots) -> tuple[Array, Array, Array]:
    """Arrays for kernels, of one or several robots: free motions (n, 6), body_table and cable_table."""
    return first_of(robot).freedom, body_table(robot), cable_table(robot)


def _cable_rows(robot: Robot) -> Array:
    """Rows of `cable_table` for one robot, (m, CABLE_COLUMNS)."""
    none = np.zeros(robot.cable_count)
    run = (none, none) if robot.winches is None else (robot.winches.dead_cable, robot.winches.dead_rise)
    columns = (
        robot.frame_anchors,
        robot.platform_anchors,
        robot.cables.linear_density[:, None],
        robot.cables.axial_stiffness[:, None],
        robot.tension_min[:, None],
        robot.tension_max[:, None],
        np.stack((*pulleys_of(robot), *run), axis=1),  # pulley radius, entry, dead length and dead rise
    )
    return np.hstack(columns)


def chord_geometry(robot: Robots, pose: Pose) -> Array:
    """Geometry of every cable at every pose, rows as in `sagline.kernels.cable.geometry`, (N, GEOMETRY_ROWS, m)."""
    cables, poses = cable_table(robot), pose_rows(pose)
    out = np.empty((len(poses), rows.GEOMETRY_ROWS, cables.shape[1]))
    with np.errstate(all="ignore"):
        cable_geometries(cables, body_table(robot), poses, np.empty((3, 3)), out)
    return out


def touching_angle(robot: Robot, pose: Pose) -> Array:
    """Wrap angle psi of straight cables, from the tangents between platform ends and pulleys, (m,) [rad]."""
    radius, entry = pulleys_of(robot)
    geometry = chord_geometry(robot, pose)[0]
    angle = np.arctan2(geometry[rows.COSINE], entry * geometry[rows.SINE])
    return np.where(radius > 0.0, angle, 0.0)


def refuse_missing_chords(robot: Robots, pose: Pose, geometry: Array | None = None) -> None:
    """Refuse poses at which a cable has no chord, because its ends coincide or there is no tangent to its pulley."""
    chord = (chord_geometry(robot, pose) if geometry is None else geometry)[:, rows.CHORD]
    missing = np.argwhere(~(chord >= SHORTEST_CHORD))
    if not len(missing):
        return
    row, cable = (int(k) for k in missing[0])
    item = f"pose{f' {row}' if pose.shape else ''}, cable {cable}"
    one, here = (robot if isinstance(robot, Robot) else robot[row]), (pose[row] if pose.shape else pose)
    radius = float(pulleys_of(one).radius[cable])
    if radius > 0.0:
        raise _inside_pulley(item, one, here, cable, radius)
    raise CableGeometryError(
        f"{item}: distance between its ends",
        f"{round(float(chord[row, cable]), 12):g} m",
        f">= {SHORTEST_CHORD:g} m",
        "Move the platform or the anchor, so that the two ends are apart.",
    )


def _inside_pulley(item: str, robot: Robot, pose: Pose, cable: int, radius: float) -> CableGeometryError:
    """Error for a platform end inside or on its pulley, for which no tangent to the pulley exists."""
    away = pose.transform(robot.platform_anchors)[cable] - robot.frame_anchors[cable]
    ahead = float(pulleys_of(robot).entry[cable] * away[2])  # direction from drum to pulley at the entry
    half = np.sqrt(max(radius**2 - max(ahead, 0.0) ** 2, 0.0))
    near = f"< {radius - half:.6g} m or " if ahead > 0.0 else ""
    return CableGeometryError(
        f"{item}: distance of its platform end from the swivel axis, inside the pulley or on its near side,",
        f"{float(np.hypot(away[0], away[1])):.9g} m",
        f"{near}> {radius + half:.6g} m there",
        f"Move the platform away, or correct its pulley_radius, {radius:g} m.",
    )
