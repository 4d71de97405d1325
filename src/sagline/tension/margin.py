"""Margins of a pose: distance of the tensions from their limits, and largest additional load."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.progress import blocks, rows_of
from sagline.kernels.inverse.feasibility import margins_of_poses
from sagline.kernels.memory import memory_for
from sagline.robot.batch import first_of, robot_fields
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import LIMITS_OF

BLOCK = 1 << 12  # poses per block, about 0.1 s; interrupts are handled between blocks


@of_equilibrium
def limit_margin(state: Equilibrium) -> Array:
    """Distance between the tensions of each pose and their nearest limit.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments: robot, poses.

    Returns:
        Smallest distance [N] between the tension of a cable and its limits, shape () or (N,); 0 if a cable is at its
        limit, NaN for a pose without tensions. The distance depends on the tension distribution.

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
    """Distance between the tension of each cable and its nearest limit, (m,) or (N, m) [N]."""
    tension, (low, high) = state.limited_tension, robot_fields(state.robot, "tension_min", "tension_max")
    margins: Array = np.minimum(tension - low, high - tension)
    return margins


@of_equilibrium
def capacity_margin(state: Equilibrium) -> Array:
    """Largest additional force in any direction that tensions within the limits can balance at each pose.

    The moment on the platform does not change. The result is exact for weightless cables. For sagging cables, the sag
    forces of the state are kept constant. The computing time is proportional to the number of faces, which is the
    binomial coefficient of m over n - 1. For eight cables, 56 faces take about twenty microseconds per pose.

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
    for part in blocks(len(rows), BLOCK):
        margins_of_poses(
            (model.code, *model.parameters),
            (LIMITS_OF[shared.tension_limits_of], np.nan),
            (freedom, rows_of(bodies, part), rows_of(robots, part)),
            rows[part],
            rows_of(wrenches, part),
            locked(np.ascontiguousarray(pulls[part])),
            memory,
            margins[part],
        )
    return margins.reshape(state.pose.shape)
