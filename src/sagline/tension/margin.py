"""Margins of a pose: tension limits, and extra load."""

from __future__ import annotations

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked
from sagline.core.progress import blocks, rows_of
from sagline.kernels.inverse.feasibility import margins_of_poses
from sagline.kernels.memory import memory_for
from sagline.robot.batch import first_of, limits_of
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import LIMITS_OF

BLOCK = 1 << 12  # poses at once: a tenth of a second, after which an interrupt is heard


def limit_margin(state: Equilibrium) -> Array:
    """Distance of each pose's tensions to their nearest limit.

    Args:
        state: Robot or robots, and cables, `plan.state` for instance.

    Returns:
        Smallest distance [N] of the quantity that the robot's limits name, shape () or (N,): 0 where a cable is at its
        limit, NaN where there are no tensions. It depends on the tension distribution.

    Raises:
        InvalidValueError: If the state is no Equilibrium (of a plan: plan.state).

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
    """Distance of each cable's tension to its nearest limit: what `limit_margin` takes the smallest of.

    Returns (m,) or (N, m) [N].
    """
    tension, limits = instance(state, Equilibrium, "state").limited_tension, limits_of(state.robot)
    margins: Array = np.minimum(tension - limits.low, limits.high - tension)
    return margins


def capacity_margin(state: Equilibrium) -> Array:
    """Extra load that each pose can take, whatever its direction, before no tensions within the limits balance it.

    The moment stays as it is. Exact for weightless cables; with sag the pulls stay those of the state. Grows with the
    binomial of m over n - 1: 56 faces for eight cables, some twenty microseconds a pose.

    Args:
        state: Robot or robots, poses, wrench and cables, `plan.state` for instance.

    Returns:
        Force [N], shape () or (N,), for any tension distribution; infinite where no force alone can make the pose fail,
        NaN where there are no tensions.

    Raises:
        InvalidValueError: If the state is no Equilibrium (of a plan: plan.state).

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> round(float(sl.capacity_margin(sl.inverse(robot, pose).state)))
        511

    Source:
        Bouchard, Gosselin & Moore 2010; Guay, Cardou, Cruz-Ruiz & Caro 2014.
    """
    shared, model = first_of(instance(state, Equilibrium, "state").robot), state.cables.model
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
