"""Margins of a pose: distance between tensions and limits, largest additional load, and unconstrained motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, blocks, locked, rows_of
from sagline.kernels.inverse.feasibility import margins_of_poses
from sagline.kernels.memory import memory_for
from sagline.robot.batch import first_of, robot_fields
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.statics.balance import structure_matrix
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import LIMITS_OF

BLOCK = 1 << 12  # number of poses per block, which takes about 0.1 s; Ctrl-C is handled between blocks


@of_equilibrium
def limit_margin(state: Equilibrium) -> Array:
    """Compute the smallest distance between tensions and tension limits at each pose.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments: robot, poses.

    Returns:
        Smallest distance [N] between the tension of any cable and its limits, shape () or (N,); 0 if a cable is at a
        limit, NaN for a pose without tensions. The distance depends on the tension distribution method.

    Raises:
        InvalidValueError: If `state` has another type.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> round(float(sl.limit_margin(sl.inverse(robot, pose).state)), 1)
        225.3
    """
    margin: Array = cable_margins(state).min(axis=-1)
    return margin


def cable_margins(state: Equilibrium) -> Array:
    """Distances (m,) or (N, m) [N] between the tension of each cable and the nearest limit of this cable."""
    tension, (low, high) = state.limited_tension, robot_fields(state.robot, "tension_min", "tension_max")
    margins: Array = np.minimum(tension - low, high - tension)
    return margins


@of_equilibrium
def capacity_margin(state: Equilibrium) -> Array:
    """Compute the largest additional force in any direction that tensions within their limits can balance.

    The moment on the platform does not change. The result is exact for weightless cables. For sagging cables, constant
    sag forces are assumed. The computing time is proportional to the number of faces of the available wrench set, which
    is the binomial coefficient of m over n - 1. The 56 faces of eight cables take about twenty microseconds per pose.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments: robot, poses.

    Returns:
        Force [N], shape () or (N,), independent of the tension distribution; infinite if no additional force makes the
        pose infeasible, NaN for a pose without tensions.

    Raises:
        InvalidValueError: If `state` has another type.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> round(float(sl.capacity_margin(sl.inverse(robot, pose).state)))
        511

    Source:
        Bouchard, Gosselin & Moore 2010; Guay, Cardou, Cruz-Ruiz & Caro 2014.
    """
    shared, model = first_of(state.robot), state.cables.model
    rows = pose_rows(state.pose)
    pulls = np.atleast_2d(state.pull)
    margins = np.empty(len(rows))
    wrenches, memory = np.atleast_2d(state.wrench), memory_for(shared.cable_count)
    freedom, bodies, robots = robot_terms(state.robot)
    terms = (model.code, *model.parameters), (LIMITS_OF[shared.tension_limits_of], np.nan)
    for part in blocks(len(rows), BLOCK):
        own = (freedom, rows_of(bodies, part), rows_of(robots, part))
        pull = locked(np.ascontiguousarray(pulls[part]))
        margins_of_poses(*terms, own, rows[part], rows_of(wrenches, part), pull, memory, margins[part])
    return margins.reshape(state.pose.shape)


class UnresistedMotion(NamedTuple):
    """Platform motion that the cables constrain least.

    Attributes:
        twist: Velocity of the center of mass and angular velocity, world axes, shape (6,). The twist is scaled to an
            angular velocity of 1 or, for a pure translation, to a velocity of 1.
        resistance: Rate of the cable lengths in this motion divided by the rate in the most constrained motion; 0 at a
            singular pose, except for rounding.
        text: Description of the motion in words.
    """

    twist: Array
    resistance: float
    text: str


def unresisted_motion(robot: Robot, pose: PoseLike) -> UnresistedMotion:
    """Compute the platform motion with the smallest change of cable lengths, which is zero at a singular pose.

    Args:
        robot: The robot.
        pose: One pose.

    Returns:
        UnresistedMotion with the twist, the resistance of the cables to this twist, and a description in words.

    Raises:
        InvalidValueError: If `pose` is not a single pose.
        CableGeometryError: If both ends of a cable coincide.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> motion = sl.unresisted_motion(robot, pose)
    """
    instance(robot, Robot, "robot")
    pose = single_pose(pose)
    lever = float(np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1).max()) or 1.0
    units = np.where(np.linalg.norm(robot.freedom[:, 3:], axis=1) > 0.5, 1.0 / lever, 1.0)
    structure = units[:, None] * structure_matrix(robot, pose)
    # The (m, m) matrix of right singular vectors is large. It is needed only if the left singular vectors are
    # incomplete.
    left, values, _right = np.linalg.svd(structure, full_matrices=structure.shape[1] < structure.shape[0])
    twist = robot.freedom.T @ (units * left[:, -1])
    linear, angular = np.linalg.norm(twist[:3]), np.linalg.norm(twist[3:])
    turns = angular * lever > 1e-6 * linear
    twist = twist / (angular if turns else linear)
    resistance = float(values[-1] / values[0]) if len(values) == robot.degrees_of_freedom else 0.0
    return UnresistedMotion(locked(twist), resistance, _in_words(robot, pose, twist, turns=bool(turns)))


def _in_words(robot: Robot, pose: Pose, twist: Array, *, turns: bool) -> str:
    if not turns:
        return f"translation along {_vector(twist[:3])}"
    axis = twist[3:]
    center = pose.position + pose.matrix @ robot.center_of_mass
    through = center + np.cross(axis, twist[:3])
    pitch = float(axis @ twist[:3])
    slide = f", sliding {pitch:.3g} m per radian along it" if abs(pitch) > 1e-6 else ""
    return f"rotation about the axis {_vector(axis)} through {_vector(through)} m{slide}"


def _vector(values: Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in np.round(values, 9)) + ")"
