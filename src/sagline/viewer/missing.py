"""Missing wrench of an infeasible pose, and the nearest feasible pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import lsq_linear

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import SaglineError
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.balance import structure_matrix
from sagline.tension.methods import MinimumNorm
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.workspace import CELLS, WorkspaceQuery
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.wrench_sets import WrenchBox

ATTEMPTS: Final = 4
MORE: Final = 1.0 + 1e-9  # factor of the wrench, by which the pose is slightly inside the boundary
NEAR: Final = 1e-4  # relative distance to a limit below which a tension counts as at the limit
_EXPLAINED: Final = (PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE)


class _AtLimit(NamedTuple):
    """A cable at a limit."""

    cable: int  # index of the cable
    lower: bool  # True for the lower limit, False for the upper limit

    @property
    def name(self) -> str:
        """Label at the cable."""
        return f"{self.cable} at its {'lower' if self.lower else 'upper'} limit"


@dataclass(frozen=True, slots=True, eq=False)
class MissingWrench:
    """Smallest wrench that makes a pose feasible; it is a force without moment if a force is sufficient."""

    wrench: Array  # missing wrench about the center of mass, world axes [N, N m], shape (6,)
    state: Equilibrium  # plan with this wrench, in which the blocking cables are at their limits
    limits: tuple[_AtLimit, ...]  # the cables at limits

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
    if plan is None or snapshot.status not in _EXPLAINED:
        return None
    robot, state = snapshot.robot, plan.state
    missing = np.zeros(6)
    held = plan
    try:
        for _ in range(ATTEMPTS):
            missing += MORE * _step(held)
            wrench = locked(state.wrench + missing)
            held = inverse(robot, snapshot.pose, state.cables.model, MinimumNorm(), wrench)
            if held.feasible:
                return MissingWrench(locked(missing), held.state, _limits(plan, held))
    except SaglineError:
        return None
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
    rest: Array = freedom.T @ (freedom @ needed - matrix @ found.x)
    return rest


def _limits(plan: Plan, held: Plan) -> tuple[_AtLimit, ...]:
    """Cables at limits. If a force is sufficient, these are the plan's blocking cables, otherwise those of `held`."""
    robot, tension = plan.state.one_robot, held.state.limited_tension
    to_lower, to_upper = tension - robot.tension_min, robot.tension_max - tension
    which = plan.blocking
    if not np.isfinite(plan.shortfall):
        which = np.minimum(to_lower, to_upper) <= NEAR * tension
    return tuple(_AtLimit(int(k), bool(to_lower[k] <= to_upper[k])) for k in np.flatnonzero(which))


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
            search = _Search(robot, start, model, wrench)
            found = search.nearest(pose.position)
        except SaglineError:  # the motion pattern excludes this rotation
            continue
        if found is not None:
            there = Pose.from_quaternion(found, start.quaternion)
            return NearestFeasible(there, float(np.linalg.norm(found - pose.position)), turned)
    return None


class _Search:
    """Search at one orientation."""

    def __init__(self, robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> None:
        self._robot, self._model, self._wrench, self._quaternion = robot, model, wrench, pose.quaternion
        self._levels: Levels = WorkspaceQuery(robot, pose.quaternion, model, WrenchBox(center=wrench)).levels()
        self._region: Region = region_of(robot, None, CELLS)
        free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
        if self._region.flat is not None:
            free[self._region.flat] = False
        self._free = np.flatnonzero(free)
        self._size = float(np.max(self._region.high - self._region.low))

    def nearest(self, start: Array) -> Array | None:
        """The nearest feasible position [m], shape (3,)."""
        low, high = self._region.low, self._region.high
        axes = [np.linspace(low[axis], high[axis], NODES) for axis in self._free]
        nodes = np.tile(start, (NODES ** len(axes), 1))
        nodes[:, self._free] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        inside = nodes[self._feasible(nodes)]
        if not len(inside):
            return None
        order = np.argsort(np.linalg.norm(inside - start, axis=1))[:STARTS]
        step = (high - low)[self._free] / (NODES - 1)
        best = min((self._refined(start, node, step) for node in inside[order]), key=lambda at: _distance(at, start))
        return self._inside(start, best)

    def _refined(self, start: Array, best: Array, step: Array) -> Array:
        """The feasible position nearest to `start`, by a search from the feasible `best` on finer and finer grids."""
        ways = np.linspace(-1.0, 1.0, 2 * AROUND + 1)
        offsets = np.stack(np.meshgrid(*[ways] * len(step), indexing="ij"), axis=-1).reshape(-1, len(step))
        for _ in range(ITERATIONS):
            places = np.tile(best, (len(offsets), 1))
            places[:, self._free] += offsets * step
            nearer = places[np.linalg.norm(places - start, axis=1) < _distance(best, start)]
            held = nearer[self._feasible(nearer)]
            if len(held):
                best = held[np.argmin(np.linalg.norm(held - start, axis=1))]
            else:
                step = step / AROUND
                if step.max() < FINEST * self._size:
                    break
        return best

    def _inside(self, start: Array, best: Array) -> Array | None:
        """A position slightly inside the boundary, at which `inverse` has a solution."""
        way = best - start
        way = way / max(float(np.linalg.norm(way)), 1e-12)
        for share in INWARD:
            place = best + share * self._size * way
            if inverse(self._robot, self._pose(place), self._model, wrench=self._wrench).feasible:
                return place
        return None

    def _feasible(self, places: Array) -> Flags:
        parts = [self._levels.details(part).margin >= 0.0 for part in _parts(places)]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=np.bool_)

    def _pose(self, place: Array) -> Pose:
        return Pose.from_quaternion(place, self._quaternion)


def _parts(places: Array) -> list[Array]:
    return [places[k : k + BLOCK] for k in range(0, len(places), BLOCK)]


def _distance(one: Array, other: Array) -> float:
    return float(np.linalg.norm(one - other))
