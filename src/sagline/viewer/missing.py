"""Missing wrench of an infeasible pose, and the nearest feasible pose."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, locked
from sagline.core.errors import SaglineError
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.statics.balance import structure_matrix
from sagline.tension.methods import MinimumNorm
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.workspace import CELLS, DIRECTIONS, WorkspaceQuery, free_directions
from sagline.workspaces.region import region_of
from sagline.workspaces.wrench_sets import WrenchBox

ATTEMPTS: Final = 4
MORE: Final = 1.0 + 1e-9  # factor of the wrench, by which the pose is slightly inside the boundary
NEAR: Final = 1e-4  # relative distance to a limit below which a tension counts as at the limit
_EXPLAINED: Final = (PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE)


@dataclass(frozen=True, slots=True, eq=False)
class MissingWrench:
    """Smallest wrench that makes a pose feasible; it is a force without moment if a force is sufficient."""

    wrench: Array  # missing wrench about the center of mass, world axes [N, N m], shape (6,)
    state: Equilibrium  # plan with this wrench, in which the blocking cables are at their limits
    limits: dict[int, bool]  # cables at limits: True at the lower limit, False at the upper limit

    @property
    def force(self) -> Array:
        """Force of the wrench [N], shape (3,)."""
        return self.wrench[:3]

    @property
    def moment(self) -> Array:
        """Moment of the wrench [N m], shape (3,); zero if a force alone is sufficient."""
        return self.wrench[3:]


def missing_of(snapshot: Snapshot) -> MissingWrench | None:
    """Missing wrench of an infeasible pose; None for other failures, or if no wrench was found."""
    plan = snapshot.plan
    if plan is None or snapshot.status not in _EXPLAINED or is_underconstrained(snapshot.robot):
        return None
    robot, state = snapshot.robot, plan.state
    missing, held = np.zeros(6), plan
    with suppress(SaglineError):
        for _ in range(ATTEMPTS):
            missing += MORE * _step(held)
            held = inverse(robot, snapshot.pose, state.cables.model, MinimumNorm(), locked(state.wrench + missing))
            if held.feasible:
                return MissingWrench(locked(missing), held.state, _limits(plan, held))
    return None


def _step(plan: Plan) -> Array:
    """Wrench (6,) [N, N m] of the smallest sufficient force. If no force is sufficient, the smallest wrench."""
    if plan.relief is not None and np.isfinite(plan.relief).all():
        return np.concatenate((plan.relief, np.zeros(3)))
    robot = plan.state.one_robot
    matrix, freedom = structure_matrix(robot, plan.state.pose), robot.freedom
    needed = np.zeros(6) if plan.needed is None else np.nan_to_num(plan.needed)
    turning = np.abs(freedom[:, 3:]).max(axis=1) > 0.5
    lever = float(np.abs(matrix[turning]).max(initial=0.0)) or 1.0  # [m], a moment counts as the force at this arm
    unit = np.where(turning, 1.0 / lever, 1.0)
    low = robot.tension_min
    high = np.maximum(robot.tension_max, low * (1.0 + 1e-9) + 1e-9)  # the solver requires low < high
    found = lsq_linear(unit[:, None] * matrix, unit * (freedom @ needed), (low, high), tol=1e-12)
    return np.asarray(freedom.T @ (freedom @ needed - matrix @ found.x))


def _limits(plan: Plan, held: Plan) -> dict[int, bool]:
    """Cables at limits. If a force is sufficient, these are the plan's blocking cables, otherwise those of `held`."""
    robot, tension = plan.state.one_robot, held.state.limited_tension
    to_lower, to_upper = tension - robot.tension_min, robot.tension_max - tension
    which = plan.blocking
    if not np.isfinite(plan.shortfall):
        which = np.minimum(to_lower, to_upper) <= NEAR * tension
    return {int(k): bool(to_lower[k] <= to_upper[k]) for k in np.flatnonzero(which)}


NODES: Final = 15  # nodes of the first grid along each axis
AROUND: Final = 2  # points of a finer grid on each side of its center
STARTS: Final = 4
ITERATIONS: Final = 40
FINEST: Final = 1e-6  # finest grid, relative to the region's size
BLOCK: Final = 250  # positions per call: a few milliseconds, then other threads can run
INWARD: Final = (1e-5, 1e-4, 1e-3, 1e-2)  # steps inward from the boundary, as shares of the region's size


class NearestFeasible(NamedTuple):
    """The nearest feasible pose."""

    pose: Pose
    distance: float  # distance from the given pose [m]
    turned: bool  # True if the orientation differs too


def nearest_feasible(robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> NearestFeasible | None:
    """Nearest feasible pose within the robot's region, at the orientation of a pose or level; None if none exists."""
    for turned in (False, True):
        start = Pose(pose.position, np.eye(3)) if turned else pose
        if turned and np.allclose(start.matrix, pose.matrix):
            break
        try:
            found = _nearest_position(robot, pose.position, start, model, wrench)
        except SaglineError:  # the motion pattern excludes this rotation
            continue
        if found is not None:
            there = Pose.from_quaternion(found, start.quaternion)
            return NearestFeasible(there, float(np.linalg.norm(found - pose.position)), turned)
    return None


def _nearest_position(
    robot: Robot, start: Array, orientation: Pose, model: CableModel, wrench: Array | None
) -> Array | None:
    """The feasible position (3,) [m] nearest to `start`, at one orientation; None if none exists."""
    levels = WorkspaceQuery(robot, orientation.quaternion, model, WrenchBox(center=wrench)).levels()
    region = region_of(robot, None, CELLS)
    free = np.flatnonzero(np.any(DIRECTIONS[free_directions(robot, region.flat)] > 0.0, axis=0))
    size = float(np.max(region.high - region.low))

    def grid(axes: list[Array]) -> Array:
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))

    def feasible(places: Array) -> Array:
        parts = [places[k : k + BLOCK] for k in range(0, len(places), BLOCK)]
        held = [np.empty(0, bool), *(levels.details(part).margin >= 0.0 for part in parts)]
        return np.asarray(places[np.concatenate(held)])

    def refined(best: Array) -> Array:
        """The nearest position, by a search from the feasible position `best` on finer and finer grids."""
        step = (region.high - region.low)[free] / (NODES - 1)
        offsets = grid([np.linspace(-1.0, 1.0, 2 * AROUND + 1)] * len(free))
        for _ in range(ITERATIONS):
            places = np.tile(best, (len(offsets), 1))
            places[:, free] += offsets * step
            held = feasible(places[np.linalg.norm(places - start, axis=1) < np.linalg.norm(best - start)])
            if len(held):
                best = held[np.argmin(np.linalg.norm(held - start, axis=1))]
            else:
                step = step / AROUND
                if step.max() < FINEST * size:
                    break
        return best

    axes = [np.linspace(region.low[axis], region.high[axis], NODES) for axis in free]
    nodes = np.tile(start, (NODES ** len(axes), 1))
    nodes[:, free] = grid(axes)
    inside = feasible(nodes)
    if not len(inside):
        return None
    order = np.argsort(np.linalg.norm(inside - start, axis=1))[:STARTS]
    best = min((refined(node) for node in inside[order]), key=lambda at: float(np.linalg.norm(at - start)))
    way = best - start
    way = way / max(float(np.linalg.norm(way)), 1e-12)
    for share in INWARD:  # slightly inside the boundary, where `inverse` has a solution
        place = best + share * size * way
        if inverse(robot, Pose.from_quaternion(place, orientation.quaternion), model, wrench=wrench).feasible:
            return np.asarray(place)
    return None
