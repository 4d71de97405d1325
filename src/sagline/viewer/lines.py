"""Cables as lines in the world: where they lie on pulleys, where they hang, where their chords are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sagline.cables.model import CableState
from sagline.core.arrays import Array, locked
from sagline.robot.batch import points_on_pulleys, pulleys_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.chords import touching_angle

POINTS = 41  # along a hanging cable: an odd number, so that dashes end as they begin
WRAP_POINTS = 16  # along the cable on a pulley
_UPRIGHT = 1e-6  # of a run's length, that its rise may be less


def points_per_cable(robot: Robot) -> int:
    """Number of points of a cable, from its frame anchor to its platform end."""
    return POINTS + WRAP_POINTS * bool(pulleys_of(robot).radius.any())


def wraps(robot: Robot, pose: Pose, wrap_angle: Array | None) -> Array:
    """Points of the cables from their frame anchors over their pulleys to where they leave them [m].

    Returns:
        Shape (m, WRAP_POINTS, 3); (m, 1, 3), the frame anchors, where no cable has a pulley.
    """
    if not pulleys_of(robot).radius.any():
        return robot.frame_anchors[:, None]
    angle = np.nan_to_num(touching_angle(robot, pose)) if wrap_angle is None else wrap_angle
    return np.swapaxes(points_on_pulleys(robot, pose, np.linspace(0.0, 1.0, WRAP_POINTS)[:, None] * angle), 0, 1)


def chords(robot: Robot, pose: Pose, exits: Array | None = None) -> Array:
    """Both ends of every hanging cable in the world [m], shape (m, 2, 3); it starts at its exit point, or anchor."""
    platform_ends = pose.transform(robot.platform_anchors)
    return locked(np.stack((robot.frame_anchors if exits is None else exits, platform_ends), axis=1))


def dead_runs(robot: Robot) -> tuple[Array, NDArray[np.bool_]]:
    """The straight guided runs behind the pulleys, upright: of a run only its length and its rise are known.

    Returns:
        Frame anchors and the points as much lower as the runs rise [m], shape (m, 2, 3); and whether a run is upright,
        as its length and its rise say, shape (m,).
    """
    winches = robot.winches
    low = robot.frame_anchors.copy()
    if winches is None:
        return np.stack((robot.frame_anchors, low), axis=1), np.ones(len(low), dtype=bool)
    low[:, 2] -= winches.dead_rise
    upright = winches.dead_cable - np.abs(winches.dead_rise) <= _UPRIGHT * winches.dead_cable
    return np.stack((robot.frame_anchors, low), axis=1), upright


def drum_axes(robot: Robot) -> Array:
    """Ends of the axes of the drums whose radius is known [m], shape (k, 2, 3).

    A drum touches the foot of its run on the side away from the robot's middle, level; its way around is not known.
    """
    winches = robot.winches
    if winches is None or winches.drum_radius is None:
        return np.empty((0, 2, 3))
    feet, middle = dead_runs(robot)[0][:, 1], robot.frame_anchors.mean(axis=0)
    away = (feet - middle)[:, :2]
    length = np.linalg.norm(away, axis=1, keepdims=True)
    away = np.where(length > 0.0, away / np.where(length > 0.0, length, 1.0), [1.0, 0.0])
    flat = np.zeros((len(feet), 1))
    centers = feet + winches.drum_radius[:, None] * np.hstack((away, flat))
    width = winches.drum_radius if winches.drum_width is None else winches.drum_width
    half = 0.5 * width[:, None] * np.hstack((-away[:, 1:], away[:, :1], flat))
    return np.stack((centers - half, centers + half), axis=1)


def straight(ends: Array) -> Array:
    """Points along chords (m, 2, 3), shape (m, POINTS, 3)."""
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    return np.asarray(ends[:, :1] * (1.0 - share) + ends[:, 1:] * share)


def catenaries(ends: Array, cables: CableState, sag_scale: float) -> Array:
    """Points along the cables as they hang (m, POINTS, 3), their sag below the chord drawn some times as large."""
    run = ends[:, 1] - ends[:, 0]
    span = np.hypot(run[:, 0], run[:, 1])
    level = np.divide(run[:, :2], span[:, None], out=np.zeros((len(run), 2)), where=span[:, None] > 0.0)
    along, up = np.moveaxis(cables.points(POINTS), -1, 0)
    slope = np.divide(run[:, 2], span, out=np.zeros(len(run)), where=span > 0.0)[:, None]
    drop = np.where(span[:, None] > 0.0, up - slope * along, 0.0)  # a vertical cable stays on its chord
    height = up + (sag_scale - 1.0) * drop
    return np.asarray(ends[:, :1] + np.concatenate((level[:, None] * along[..., None], height[..., None]), axis=-1))


def resampled(points: Array, count: int) -> Array:
    """Values at points (m, P, 3) at so many, at equal steps of the first ones' number, shape (m, count, 3)."""
    place = np.linspace(0.0, points.shape[1] - 1.0, count)
    first = np.minimum(place.astype(np.intp), points.shape[1] - 2)
    rest = (place - first)[:, None]
    return np.asarray((1.0 - rest) * points[:, first] + rest * points[:, first + 1])


def segments(points: Array, *, dashed: bool, shown: NDArray[np.bool_] | None = None) -> Array:
    """Consecutive points (m, P, 3) as segments (m (P - 1), 2, 3)."""
    pairs = np.stack((points[:, :-1], points[:, 1:]), axis=2)
    if dashed:
        pairs[:, 1::2, 1] = pairs[:, 1::2, 0]
    if shown is not None:
        hidden = ~(shown[:, :-1] & shown[:, 1:])
        pairs[hidden, 1] = pairs[hidden, 0]
    return np.asarray(pairs.reshape(-1, 2, 3))
