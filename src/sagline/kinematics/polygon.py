"""Polygon of feasible tensions of one pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import instance
from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.algebra import bounds
from sagline.kernels.inverse.feasibility import polygon_of_pose
from sagline.kernels.memory import memory_for
from sagline.kernels.tension.polygon import SPARE_CORNERS
from sagline.kinematics.inverse import inverse
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import Options, Variable, check_sharing, kernel_options
from sagline.tension.methods import Centroid, MinimumNorm
from sagline.tension.polygon import Side, TensionPolygon

MERGED = 1e-10  # corners are merged if their distance is below this share of the largest tension

_CATENARY = Catenary()


def tension_polygon(
    robot: Robot,
    pose: PoseLike,
    model: CableModel | str = _CATENARY,
    wrench: ArrayLike | None = None,
    variable: Variable = "chord",
) -> TensionPolygon:
    """The feasible tensions of one pose.

    Args:
        robot: The robot, with at most two redundant cables.
        pose: One pose.
        model: Cable model.
        wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for zero.
        variable: The tension variable of the polygon: "chord", "horizontal" (as in the article) or "frame_end".

    Returns:
        The polygon, without vertices if the pose is not feasible.

    Raises:
        InvalidValueError: If `pose` is not a single pose. If the structure matrix is rank-deficient, or a cable is too
            slack. If the robot has too few or too many cables.

    Source:
        Gia Luan & Truong Thinh 2020, (53)-(55); Gouttefarde et al. 2015; docs/model.md, section 5.

    Examples:
        >>> import sagline as sl
        >>> pose = sl.Pose.from_euler([1, 1, 2], 0, 0, 0)
        >>> polygon = sl.tension_polygon(sl.load_robot("cogiro"), pose)
        >>> print(len(polygon.vertices), "corners, first side:", polygon.sides[0])
        4 corners, first side: Side(cable=1, limit='min')
    """
    check_sharing(instance(robot, Robot, "robot"), Centroid())
    pose, model = single_pose(pose), model_of(model)
    plan = inverse(robot, pose, model, MinimumNorm(variable), wrench, stability=False)
    if plan.status not in (PoseStatus.SOLVED, PoseStatus.INFEASIBLE):
        why = PoseStatus(int(plan.status)).text
        raise InvalidValueError("pose", "a pose without solution", "a pose that `inverse` can solve", why)
    options = kernel_options(robot, model, MinimumNorm(variable))
    return polygon_at(robot, pose, options, plan.state.wrench, plan.chord_tension, plan.state.pull, bool(plan.feasible))


def polygon_at(
    robot: Robot, pose: Pose, options: Options, wrench: Array, tension: Array, pulls: Array, feasible: bool
) -> TensionPolygon:
    """Polygon from chord tensions (m,) [N] that balance the platform, and their sag forces (m,) [N]."""
    m, r = robot.cable_count, robot.cable_count - robot.degrees_of_freedom
    scale, offset = np.empty(m), np.empty(m)
    limits = np.empty((bounds.STRIP_ROWS, m))
    null = np.empty((r, m))
    corners = np.empty((2 * m + SPARE_CORNERS, 2))
    labels = np.full(2 * m + SPARE_CORNERS, -1, dtype=np.int64)
    count = polygon_of_pose(
        *options,
        robot_terms(robot),
        pose_rows(pose)[0],
        wrench,
        (tension, pulls),
        memory_for(m),
        (scale, offset, limits, null, corners, labels),
    )
    origin = limits[bounds.START]
    vertices, sides = _sides_of(count if feasible else 0, null, limits, corners, labels)
    return TensionPolygon(
        vertices=locked(vertices),
        tensions=locked(_tensions(vertices, null, origin + offset)),
        sides=sides,
        bounded=None not in sides,
        basis=locked(null),
        origin=locked(origin + offset),
        scale=locked(scale),
        offset=locked(offset),
    )


def _sides_of(
    count: int, null: Array, limits: Array, corners: Array, labels: Indices
) -> tuple[Array, tuple[Side | None, ...]]:
    """Vertices (h, r) of the polygon, and for each side the limit that forms it."""
    r, m = null.shape
    origin, low, high = limits[bounds.START], limits[bounds.LOW], limits[bounds.HIGH]
    if r == 0 or count == 0:
        return np.zeros((count, r)), ()
    if r == 1:
        ends = corners[:2, :1].copy()
        return ends, tuple(_limit_at(end, null[0], origin, low, high) for end in ends[:, 0])
    corners, labels = corners[:count], labels[:count]
    lengths = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    sizes = np.concatenate((np.abs(origin), low, high[np.isfinite(high)]))
    kept = lengths > MERGED * sizes.max()
    if not kept.any():
        kept[0] = True
    sides = tuple(Side(int(k) // 2, ("min", "max")[k % 2]) if k < 2 * m else None for k in labels[kept])
    return corners[kept], sides


def _limit_at(end: float, row: Array, origin: Array, low: Array, high: Array) -> Side | None:
    """Tension limit at the end `end` of the feasible interval."""
    if not np.isfinite(end):
        return None
    there = origin + row * end
    gaps = np.where(np.abs(row) > MERGED, np.minimum(np.abs(there - low), np.abs(there - high)), np.inf)
    cable = int(np.argmin(gaps))
    return Side(cable, "min" if abs(there[cable] - low[cable]) <= abs(there[cable] - high[cable]) else "max")


def _tensions(vertices: Array, null: Array, origin: Array) -> Array:
    """Tensions at the vertices. At an infinite vertex, only tensions that the null space does not change are finite."""
    with np.errstate(invalid="ignore"):
        steps = vertices[:, :, None] * null
    moved = np.where(null == 0.0, 0.0, steps)
    tensions: Array = origin + moved.sum(axis=1)
    return tensions
