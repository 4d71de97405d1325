"""Margins of robots with fewer cables than degrees of freedom: distances of the equilibrium's tensions to limits."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted
from sagline.kernels import codes
from sagline.kinematics.inverse import inverse
from sagline.kinematics.inverse_rows import Given, decide_stability, given_codes, solve_underconstrained_rows
from sagline.kinematics.status import PoseStatus
from sagline.robot.batch import has_slanted_axes, refuse_slanted
from sagline.robot.equilibrium import cables_of_results, limited_tension
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import has_chords
from sagline.workspaces.moving_exits import Bracket
from sagline.workspaces.region import Orientations
from sagline.workspaces.wrench_sets import WrenchSet

MOST_LOADS: Final = 65  # largest number of loads that are checked at each pose: 64 corners and the middle


class BalancedMargins:
    """Margins of an underconstrained robot: smallest distance of a tension from its limits [N], over all loads.

    For each load, the tensions are those of the stable equilibrium that `inverse` finds within the limits. If it finds
    none, the limits do not restrict a second search, so that the margin continues to negative values. If this search
    gives no tension outside the limits either, the margin is -infinity.
    """

    def __init__(self, robot: Robot, wrenches: WrenchSet, model: CableModel, given: Sequence[Given] | None) -> None:
        """Prepare the robot without limits, and the loads. `given`: as in `inverse`."""
        self._given, self._names = given_codes(robot, given), given
        self._robot, self._model, self._loads = robot, model, _loads_of(wrenches)
        self._unlimited = robot.replace(tension_min=0.0, tension_max=np.inf)

    def rows(self, poses: NDArray[np.float64]) -> Bracket:
        """Margins at the rows `poses` (N, 7), whose rotations are initial values. Both bounds are the value."""
        rows = locked(np.ascontiguousarray(poses).view())
        value, cable = np.full(len(rows), np.inf), np.full(len(rows), -1)
        for load in self._loads:
            own, limiting = self._under(rows, load)
            lower = own < value
            value[lower], cable[lower] = own[lower], limiting[lower]
        status = np.where(value >= 0.0, codes.MARGIN_FEASIBLE, codes.MARGIN_INFEASIBLE).astype(np.int8)
        return Bracket(value, value, value, cable, status, np.full((len(rows), 6), np.nan))

    def _under(self, rows: Array, load: Array) -> tuple[Array, Indices]:
        """Margins (N,) [N] and limiting cables (N,), -1 for none, under one load (6,)."""
        value, cable = self._found_by(self._robot, rows, load)
        solved = value > -np.inf
        value[solved] = np.maximum(value[solved], 0.0)  # rounding of tensions that are equal to a limit
        left = np.flatnonzero(~solved)
        if left.size:
            beyond, limiting = self._found_by(self._unlimited, locked(rows[left]), load)
            # Heavy cables can have a second equilibrium, or a slack state whose frame-end tension is large.
            short = (beyond < 0.0) & (beyond > -np.inf)
            value[left[short]], cable[left[short]] = beyond[short], limiting[short]
        return value, cable

    def _found_by(self, robot: Robot, rows: Array, load: Array) -> tuple[Array, Indices]:
        """Distances (N,) [N] and limiting cables (N,) of equilibria of `robot`; -infinity without one."""
        model = self._model
        refuse_slanted(robot, only_platform=True)
        if has_slanted_axes(robot):
            return self._found_by_inverse(robot, rows, load)
        found, placed = solve_underconstrained_rows(
            robot, model, rows, locked(load[None]), self._given, level=0.0, chained=False, stability=True
        )
        decide_stability(robot, (model.code, *model.parameters), placed, found)
        solved = found.pose_status == codes.POSE_SOLVED
        state = cables_of_results(robot, model, found.results, found.cable_status, (len(rows),))
        return self._distances(limited_tension(robot, *state), solved, found.blocking)

    def _found_by_inverse(self, robot: Robot, rows: Array, load: Array) -> tuple[Array, Indices]:
        """`_found_by` for swivel axes of any direction. Poses inside a pulley have no equilibrium."""
        pose = Pose.from_quaternion(rows[:, :3], rows[:, 3:])
        outside = has_chords(robot, pose)
        value, cable = np.full(len(rows), -np.inf), np.full(len(rows), -1)
        if outside.any():
            plan = inverse(robot, pose[outside], self._model, wrench=load, given=self._names)
            value[outside], cable[outside] = self._distances(plan.state.limited_tension, plan.solved, plan.blocking)
        return value, cable

    def _distances(self, tension: Array, solved: Flags, blocking: Flags) -> tuple[Array, Indices]:
        """Smallest distances (N,) [N] of the tensions (N, m) from the limits, and their cables; -infinity unsolved."""
        distance = np.minimum(tension - self._robot.tension_min, self._robot.tension_max - tension)
        distance[np.isnan(distance)] = -np.inf
        distance = np.where(solved[:, None], distance, np.where(blocking, -np.inf, np.inf))
        cable = np.where(solved | blocking.any(axis=1), distance.argmin(axis=1), -1)
        return np.where(solved, distance.min(axis=1), -np.inf), cable

    def reason(self, pose: Pose) -> tuple[tuple[int, ...], str]:
        """Blocking cables, and the reason why the single `pose` is infeasible under the first such load."""
        plans = (inverse(self._robot, pose, self._model, wrench=load, given=self._names) for load in self._loads)
        plan = next((plan for plan in plans if not plan.solved), None)
        if plan is None:
            return (), "an equilibrium exists under every load"
        return tuple(np.flatnonzero(plan.blocking).tolist()), PoseStatus(int(plan.status)).text


def check_given(robot: Robot, given: Sequence[Given] | None) -> tuple[Given, ...] | None:
    """Checked names of the given values. The position of the platform must be one of them."""
    codes_of_names = given_codes(robot, given)
    if given is None or codes_of_names is None:
        return None
    normal = np.zeros(3) if robot.plane_normal is None else np.abs(robot.plane_normal)
    place: tuple[Given, ...] = ("x", "y", "z")
    missing = [name for name, share in zip(place, normal, strict=True) if share < 0.5 and name not in given]
    if missing:
        step = "Name the position, and for further cables yaw or level."
        allowed = f"{', '.join(place)} among the given values of a workspace"
        raise InvalidValueError("given", f"without {', '.join(missing)}", allowed, step)
    return tuple(given)


def check_arguments(robot: Robot, orientations: Orientations, hull: str, moment_arm: float | None) -> None:
    """Reject arguments of `workspace` that have no meaning for an underconstrained robot."""
    allowed = f"for {robot.name}, whose rotation and tensions follow from the balance"
    step = "Leave it out, or add cables."
    if len(orientations) > 1:
        raise InvalidValueError("orientations", str(orientations), f"one initial rotation {allowed}", step)
    if hull != "exact":
        raise InvalidValueError("hull", hull, f"exact {allowed}", step)
    if moment_arm is not None:
        raise InvalidValueError("moment_arm", f"{moment_arm:g} m", f"None {allowed}", step)


def _loads_of(wrenches: WrenchSet) -> Array:
    """Middle and corners of a set of loads (L, 6), L <= MOST_LOADS. Ellipsoids and accelerations are refused."""
    item, allowed = "wrenches", "a box, or one polytope, of at most 64 corners for a robot with so few cables"
    step = "Give WrenchBox or WrenchPolytope; its corners and its middle are checked."
    if len(wrenches.ellipsoids) or wrenches.accelerations.any():
        raise InvalidValueError(item, str(wrenches), allowed, step)
    segments = wrenches.segments[wrenches.segments.any(axis=1)]
    count = int(np.prod(wrenches.sizes)) * 2 ** len(segments)
    if count >= MOST_LOADS:
        raise InvalidValueError(item, counted(count, "corner"), allowed, step)
    parts = np.split(wrenches.corners, np.cumsum(wrenches.sizes)[:-1]) if len(wrenches.sizes) else []
    parts += [np.stack((one, -one)) for one in segments]
    sums = [np.sum(one, axis=0) for one in product(*parts)] if parts else np.zeros((1, 6))
    corners = wrenches.center + np.array(sums)
    return np.unique(np.vstack((corners.mean(axis=0), corners)), axis=0)
