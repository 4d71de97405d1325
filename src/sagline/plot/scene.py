"""What a robot consists of where it is drawn: cables as they hang, pulleys, drums, frame, platform and ground."""

from __future__ import annotations

from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import ConvexHull

from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose
from sagline.robot.several import pulleys_of
from sagline.robot.wheels import on_wheels
from sagline.viewer import lines

if TYPE_CHECKING:
    from sagline.core.arrays import Array
    from sagline.kinematics.plan import Plan
    from sagline.robot.robot import Robot

POINTS = 50  # around each pulley
FLAT = 1e-6  # of the robot's size: a platform that is thinner casts a line
_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
EDGES = tuple(  # of a box: between corners that differ in one direction
    (a, b) for a, b in combinations(range(8), 2) if np.count_nonzero(_SIGNS[a] != _SIGNS[b]) == 1
)
FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # seen from outside


def pose_of(robot: Robot, pose: Pose | None) -> Pose:
    """Where the platform is drawn: at a pose, or in the middle of the robot's test box.

    Raises:
        InvalidValueError: If no pose is given and the robot has no test box, or the pose is a batch.
    """
    if pose is None and robot.test_box is not None:
        return Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))
    if pose is None or pose.shape:
        value = "missing" if pose is None else f"a batch of {len(pose)}"
        raise InvalidValueError("pose", value, "a single pose, where the robot has no test box", "Give one pose.")
    return pose


def hung(robot: Robot, pose: Pose, plan: Plan) -> Array:
    """Points of the cables in the world as a feasible plan of the pose has them [m], shape (m, points, 3)."""
    contact = plan.state.contact
    wraps = lines.wraps(robot, pose, None if contact is None else contact.wrap_angle)
    free = lines.hanging(lines.chords(robot, pose, wraps[:, -1]), plan.state.cables, 1.0)
    return np.concatenate((wraps, free), axis=1)


def taut(robot: Robot, pose: Pose) -> Array:
    """Points of straight cables in the world [m], shape (m, points, 3)."""
    wraps = lines.wraps(robot, pose, None)
    return np.concatenate((wraps, lines.straight(lines.chords(robot, pose, wraps[:, -1]))), axis=1)


def wheels(robot: Robot, pose: Pose) -> tuple[list[Array], list[tuple[Array, bool]]]:
    """Circles of the pulleys and of the drums that are known; and the runs behind pulleys, and whether each is upright.

    Of dead cable only its length and its rise are known: of a run that is not upright its rise is drawn.
    """
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)[:, None]
    pulleys = np.swapaxes(on_wheels(robot, pose, turn), 0, 1)[pulleys_of(robot).radius > 0.0]
    known = None if robot.winches is None else robot.winches.drum_radius
    radii = np.empty(0) if known is None else known
    drums = [_rims(ends, radius) for ends, radius in zip(lines.drum_axes(robot), radii, strict=False)]
    runs, upright = lines.dead_runs(robot)
    high = [(run, bool(known)) for run, known in zip(runs, upright, strict=True) if run[0, 2] != run[1, 2]]
    return [*pulleys, *drums], high


def _rims(ends: Array, radius: float) -> Array:
    """Both rims of a level drum, from one end of its axis to the other (2, 3), as one line."""
    axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)[:, None]
    rim = radius * (np.cos(turn) * np.cross(axis, [0.0, 0.0, 1.0]) + np.sin(turn) * [0.0, 0.0, 1.0])
    return np.concatenate((ends[0] + rim, ends[1] + rim))


def frame_box(robot: Robot) -> Array | None:
    """Corners of the frame, shape (8, 3). Frames stand: their top is where the highest anchors are."""
    if robot.frame_size is None:
        return None
    top = robot.frame_anchors.max(axis=0)
    middle = 0.5 * (top + robot.frame_anchors.min(axis=0))
    middle[2] = top[2] - 0.5 * robot.frame_size[2]
    return box_corners(middle, robot.frame_size)


def platform_box(robot: Robot, pose: Pose) -> Array:
    """Corners of the platform in the world, shape (8, 3): of its size, or of the box around its anchors."""
    low, high = robot.platform_anchors.min(axis=0), robot.platform_anchors.max(axis=0)
    size = high - low if robot.platform_size is None else robot.platform_size
    corners: Array = pose.position + box_corners(0.5 * (low + high), size) @ pose.matrix.T
    return corners


def box_corners(middle: Array, size: Array) -> Array:
    """The eight corners of a box, shape (8, 3)."""
    corners: Array = middle + 0.5 * size * _SIGNS
    return corners


def ground(points: Array, platform: Array) -> tuple[Array, Array]:
    """The ground under all points, at z = 0 or lower, and the platform's shadow on it: corners, each (k, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    height = min(0.0, float(low[2]))
    outline = box_corners(0.5 * (low + high), high - low)[[0, 2, 6, 4], :2]
    shadow = platform[:, :2]
    if np.linalg.matrix_rank(shadow - shadow[0], tol=FLAT * float(np.ptp(points))) == 2:
        shadow = shadow[ConvexHull(shadow).vertices]
    flat = [np.column_stack((place, np.full(len(place), height))) for place in (outline, shadow)]
    return flat[0], flat[1]
