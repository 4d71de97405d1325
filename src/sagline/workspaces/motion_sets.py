"""Sets of velocities and accelerations of the platform that winches and tension limits allow at an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.dynamics.trajectories.fastest import fastest_rates
from sagline.kinematics.plan import lengths_near, moved_pose
from sagline.robot.batch import refuse_slanted
from sagline.robot.drum import drum_lever, drum_tension
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.robot.reach import check_cable_count
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch
from sagline.statics.balance import structure_matrix
from sagline.statics.stiffness import mass_matrix
from sagline.tension.method import shared_tension
from sagline.tension.methods import Closest

STEP: Final = 1e-5  # motion for central differences of lengths [m, rad]
THIN: Final = 1e-9  # smallest inner radius of a set relative to its constraints
FORBIDDEN: Final = 1e-9  # largest component of a unit direction that the motion pattern does not allow
MOST_CABLES: Final = 12  # the number of corners of the tension limits doubles with each cable


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MotionSet(Result):
    """Convex polytope of velocities or accelerations: result of `speed_set` and `acceleration_set`.

    A motion is the velocity or acceleration of the origin of the platform frame and the angular velocity or
    acceleration, in world axes, shape (6,). n is the number of free motions.

    Attributes:
        state: Equilibrium of the set.
        corners: Corners of the set, shape (V, 6) [m/s, rad/s] or [m/s^2, rad/s^2].
        normals: Outward normals of the facets in the components along the free motions, shape (F, n).
        offsets: The set contains the motions with normals @ (freedom @ motion) <= offsets, shape (F,).
        volume: Volume in the space of the n free motions, for example [(m/s)^3 (rad/s)^3].
    """

    state: Equilibrium
    corners: Array
    normals: Array
    offsets: Array
    volume: float

    @property
    def translation(self) -> float:
        """Largest magnitude of a translation without rotation that is possible in every direction [m/s or m/s^2].

        Negative if the set does not contain rest, for example if a motor is too weak to hold the platform.
        """
        free = self.state.one_robot.freedom
        translations = free[np.linalg.norm(free[:, 3:], axis=1) < 0.5, :3]
        along = self.normals @ free[:, :3] @ translations.T
        size = np.linalg.norm(along, axis=1)
        return float((self.offsets[size > 0.0] / size[size > 0.0]).min())

    def pure(self, direction: ArrayLike) -> Array:
        """Largest motion exactly along a direction, with all other components of the motion equal to zero.

        Args:
            direction: Translation (..., 3), or translation and rotation (..., 6), in world axes; its length is
                irrelevant.

        Returns:
            Largest s, shape (...), for which s times the unit vector of the direction is in the set; NaN if the set
            does not contain rest.

        Raises:
            InvalidValueError: If a direction is zero, or the motion pattern does not allow it.
        """
        along = self._along(direction) @ self.normals.T
        with np.errstate(divide="ignore"):
            found = np.where(along > 0.0, self.offsets / np.where(along > 0.0, along, 1.0), np.inf).min(axis=-1)
        return locked(np.asarray(np.where((self.offsets >= 0.0).all(), found, np.nan)))

    def extent(self, direction: ArrayLike) -> Array:
        """Largest component along a direction, with any other components: support function of the set.

        Args:
            direction: As in `pure`.

        Returns:
            Largest component along the unit vector of the direction, shape (...).

        Raises:
            InvalidValueError: If a direction is zero, or the motion pattern does not allow it.
        """
        found = self._along(direction) @ (self.corners @ self.state.one_robot.freedom.T).T
        return locked(np.asarray(found.max(axis=-1)))

    def _along(self, direction: ArrayLike) -> Array:
        """Components (..., n) of unit directions along the free motions."""
        given = checked(direction, "direction", "")
        if given.ndim == 0 or given.shape[-1] not in (3, 6):
            step = "Give a translation, or a translation and a rotation."
            raise InvalidValueError("direction", f"of shape {given.shape}", "shape (..., 3) or (..., 6)", step)
        whole = np.zeros((*given.shape[:-1], 6))
        whole[..., : given.shape[-1]] = given
        size = np.linalg.norm(whole, axis=-1, keepdims=True)
        if not (size > 0.0).all():
            raise InvalidValueError("direction", "zero", "a vector with a direction", "Give (1, 0, 0), for example.")
        free, unit = self.state.one_robot.freedom, whole / size
        along = unit @ free.T
        if (np.abs(unit - along @ free) > FORBIDDEN).any():
            pattern = self.state.one_robot.motion_pattern
            step = "Give a direction of a free motion."
            raise InvalidValueError("direction", "a forbidden motion", f"motions of the pattern {pattern}", step)
        return np.asarray(along)


@of_equilibrium
def speed_set(state: Equilibrium) -> MotionSet:
    """Velocities of the platform at which no winch exceeds its speed limit.

    The rates of the lengths at a velocity are those of the inverse kinematics with `Closest`: the tensions change as
    little as possible. The wrench of the state is constant.

    Args:
        state: A single equilibrium. Also accepted: a plan, a solution, or two arguments: robot, pose.

    Returns:
        MotionSet of velocities.

    Raises:
        InvalidValueError: If the state is a batch or not in balance, if `speed_limit` or `drum_radius` of the winches
            is not known, if the robot has fewer cables than degrees of freedom, or a slanted swivel axis.

    Examples:
        >>> import sagline as sl
        >>> winch = sl.Winch(drum_radius=0.06, gear=10.0, speed_limit=300.0)
        >>> robot = sl.load_robot("cogiro").replace(winches=winch)
        >>> found = sl.speed_set(robot, (1, 0.5, 1.5))
        >>> up, sideways = found.pure([[0, 0, 1], [1, 0, 0]])
        >>> print(f"{up:.2f} m/s, {sideways:.2f} m/s, all: {found.translation:.2f} m/s")
        4.11 m/s, 2.13 m/s, all: 1.80 m/s

    Source:
        Bounds |A t| <= v on the length rates, with the differences A of the exact lengths; docs/model.md, section 7.
    """
    robot, winches = _checked(state)
    if winches.speed_limit is None:
        step = "Give it in the robot file, or with robot.replace(winches=Winch(speed_limit=...))."
        raise InvalidValueError("winches: speed_limit", "not given", "known for a set of speeds", step)
    slopes = _length_slopes(state)
    limit = fastest_rates(robot, state.unstrained_length)
    corners = _corners(np.vstack((slopes, -slopes)), np.concatenate((limit, limit)))
    return _motion_set(state, corners)


@of_equilibrium
def acceleration_set(state: Equilibrium) -> MotionSet:
    """Accelerations of the platform from rest that tension limits and motor torques allow.

    The sag forces of the cables and the differences between chord tension, frame-end tension and drum tension are those
    of the state, and the wrench of the state is constant. If the winches have a `torque_limit`, each motor carries the
    cable tension and accelerates its own `inertia`.

    Args:
        state: A single equilibrium. Also accepted: a plan, a solution, or two arguments: robot, pose.

    Returns:
        MotionSet of accelerations.

    Raises:
        InvalidValueError: If the state is a batch or not in balance, if `torque_limit` is given without `inertia` and
            `drum_radius`, if the robot has fewer cables than degrees of freedom, more than 12 cables, or a slanted
            swivel axis. If no tensions within the limits exist.

    Examples:
        >>> import sagline as sl
        >>> found = sl.acceleration_set(sl.load_robot("cogiro"), (1, 0.5, 1.5))
        >>> down, up = found.pure([[0, 0, -1], [0, 0, 1]])
        >>> print(f"{down:.2f} m/s^2 downward, {up:.2f} m/s^2 upward")
        6.71 m/s^2 downward, 132.96 m/s^2 upward

    Source:
        Newton-Euler equations with the structure matrix; docs/model.md, sections 5 and 10.
    """
    robot, winches = _checked(state)
    if robot.cable_count > MOST_CABLES:
        step = "Use the margin of sl.Accelerations(...) instead."
        raise InvalidValueError("number of cables", f"{robot.cable_count}", f"<= {MOST_CABLES}", step)
    m, free = robot.cable_count, robot.freedom
    mass = free @ mass_matrix(state) @ free.T
    by_tension = free.T @ np.linalg.solve(mass, structure_matrix(robot, state.pose))  # of the center of mass
    by_tension[:3] -= np.cross(by_tension[3:], state.pose.matrix @ robot.center_of_mass, axis=0)  # of the origin
    by_tension = free @ by_tension
    apart = state.limited_tension  # limits apply to this tension, which differs from the chord tension by a constant
    normals = [np.eye(m), -np.eye(m)]
    offsets = [robot.tension_max - apart, apart - robot.tension_min]
    if winches.torque_limit is not None:
        if winches.inertia is None:
            step = "Give the inertia at the motor's shaft, 0 to neglect it."
            raise InvalidValueError("winches: inertia", "not given", "known if torque_limit is given", step)
        lever = drum_lever(robot, state.unstrained_length) / winches.gear  # m per rad of the motor
        stretch = 1.0 + winches.winding_tension / robot.cables.axial_stiffness
        spin = (stretch / lever)[:, None] * (_length_slopes(state) @ by_tension)
        change = winches.inertia[:, None] * spin - np.diag(lever)
        held = -lever * drum_tension(state)
        normals += [change, -change]
        offsets += [winches.torque_limit - held, winches.torque_limit + held]
    bounded = np.isfinite(np.concatenate(offsets))
    changes = _corners(np.vstack(normals)[bounded], np.concatenate(offsets)[bounded])
    return _motion_set(state, changes @ by_tension.T)


def _checked(state: Equilibrium) -> tuple[Robot, Winch]:
    """Robot and winches of a single equilibrium with known tensions."""
    robot = state.one_robot
    if state.pose.shape:
        raise InvalidValueError("state", f"{len(state)} poses", "a single pose", "Select one: plan.state[3].")
    if not np.isfinite(state.chord_tension).all():
        step = "Give a pose that the cables can balance."
        raise InvalidValueError("state", "without a solution", "an equilibrium", step)
    check_cable_count(robot)
    refuse_slanted(robot)
    return robot, robot.winches or Winch()


def _length_slopes(state: Equilibrium) -> Array:
    """Derivatives (m, n) of the unstrained lengths by the free motions of the origin, with the closest tensions."""
    free, method = state.one_robot.freedom, Closest()
    reference = np.tile(shared_tension(state, method.variable), (len(free), 1))
    wrench = np.tile(state.wrench, (len(free), 1))

    def lengths(h: float) -> Array:
        return lengths_near(state, method, moved_pose(state.pose, h * free), wrench, reference)

    slopes = (lengths(STEP) - lengths(-STEP)).T / (2.0 * STEP)
    if np.isnan(slopes).any():
        step = "Give a pose inside the feasible region."
        raise InvalidValueError("state", "at the border of feasibility", "feasible on all sides", step)
    return slopes


def _corners(normals: Array, offsets: Array) -> Array:
    """Corners (V, k) of the set of x with normals @ x <= offsets, (F, k) and (F,)."""
    size = np.linalg.norm(normals, axis=1)
    normals, offsets = normals / size[:, None], offsets / size
    # center of the largest inscribed ball
    columns, k = np.column_stack((normals, np.ones(len(normals)))), normals.shape[1]
    found = linprog(np.append(np.zeros(k), -1.0), columns, offsets, bounds=[(None, None)] * k + [(0.0, None)])
    if found.status != 0 or found.x[-1] <= THIN * np.abs(offsets).max():
        step = "Widen the limits of tensions, torques or speeds; an upper limit is necessary."
        value = "unbounded" if found.status == 3 else "empty or without volume"
        raise InvalidValueError("set of motions", value, "a bounded set with a volume", step)
    try:
        return np.asarray(HalfspaceIntersection(np.column_stack((normals, -offsets)), found.x[:-1]).intersections)
    except QhullError:
        raise _thin_set() from None


def _thin_set() -> InvalidValueError:
    """Error of a set that is too thin for Qhull."""
    step = "Widen the limits of tensions, torques or speeds."
    return InvalidValueError("set of motions", "without volume", "a bounded set with a volume", step)


def _motion_set(state: Equilibrium, corners: Array) -> MotionSet:
    """Convex hull of `corners` (V, n), components along the free motions."""
    try:
        hull = ConvexHull(corners)
    except QhullError:
        raise _thin_set() from None
    equations = np.unique(hull.equations.round(12), axis=0)
    free = state.one_robot.freedom
    normals, offsets = (locked(np.ascontiguousarray(part)) for part in (equations[:, :-1], -equations[:, -1]))
    return MotionSet(state, locked(hull.points[hull.vertices] @ free), normals, offsets, float(hull.volume))
