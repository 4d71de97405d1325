"""The chords of the cables: straight lines from where they leave the frame to their ends, and where there is none."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import CableGeometryError
from sagline.kernels.balance.setting import SHORTEST_CHORD
from sagline.kernels.cable import geometry as rows
from sagline.kernels.cable.geometry import cable_geometries
from sagline.robot.batch import Robots, anchors_of, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows


def chord_geometry(robot: Robots, pose: Pose) -> Array:
    """Geometry of every cable at every pose, rows as in `sagline.kernels.cable.geometry`.

    Returns (N, GEOMETRY_ROWS, m).
    """
    cables, poses = cable_table(robot), pose_rows(pose)
    out = np.empty((len(poses), rows.GEOMETRY_ROWS, cables.shape[1]))
    with np.errstate(all="ignore"):
        cable_geometries(cables, body_table(robot), poses, np.empty((3, 3)), out)
    return out


def touching_angle(robot: Robot, pose: Pose) -> Array:
    """Wrap angle psi of straight cables: where the lines from the platform ends touch the pulleys.

    Returns (m,) [rad].
    """
    radius, entry = pulleys_of(robot)
    geometry = chord_geometry(robot, pose)[0]
    angle = np.arctan2(geometry[rows.COSINE], entry * geometry[rows.SINE])
    return np.where(radius > 0.0, angle, 0.0)


def refuse_missing_chords(robot: Robots, pose: Pose, geometry: Array | None = None) -> None:
    """Refuse poses at which a cable has no chord: its ends coincide, or no line from its pulley leads to its end."""
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
        "Move the platform away from the anchor, or the anchor away from the path.",
    )


def _inside_pulley(item: str, robot: Robot, pose: Pose, cable: int, radius: float) -> CableGeometryError:
    """The error of a platform end that no line from its pulley leads to, or that lies on the pulley."""
    anchors = anchors_of(robot)
    away = pose.transform(anchors.platform)[cable] - anchors.frame[cable]
    ahead = float(pulleys_of(robot).entry[cable] * away[2])  # along the cable's travel where it enters
    half = np.sqrt(max(radius**2 - max(ahead, 0.0) ** 2, 0.0))
    near = f"< {radius - half:.6g} m or " if ahead > 0.0 else ""
    return CableGeometryError(
        f"{item}: its platform end is inside its pulley or past the near side, its distance from the swivel axis",
        f"{float(np.hypot(away[0], away[1])):.9g} m",
        f"{near}> {radius + half:.6g} m there",
        f"Move the platform away, or correct its pulley_radius, {radius:g} m.",
    )
