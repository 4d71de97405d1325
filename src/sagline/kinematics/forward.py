"""Forward kinematics: from unstrained lengths to the pose in which the platform rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.core.arguments import callback, instance, optional
from sagline.core.arrays import LARGEST, SMALLEST, Array, locked, numbers
from sagline.core.errors import InvalidValueError
from sagline.core.memory import check_poses
from sagline.core.progress import Progress
from sagline.kinematics.forward_rows import ForwardSolution, solve_forward_rows
from sagline.kinematics.measured import MeasuredTension, fit_measurements
from sagline.kinematics.start import search
from sagline.kinematics.winding import checked_winding, iterate_routing
from sagline.robot.batch import Robots, check_count, dead_cable, first_of, has_routing, together
from sagline.robot.pose import Pose
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.robot.routing import differs, with_routing
from sagline.statics.balance import external_wrench
from sagline.statics.tables import pose_rows

_CATENARY = Catenary()


def forward(
    robot: Robot | Sequence[Robot],
    unstrained_length: ArrayLike,
    start: Pose | None = None,
    model: CableModel = _CATENARY,
    wrench: ArrayLike | None = None,
    tension_measured: MeasuredTension | None = None,
    *,
    winding: ArrayLike | None = None,
    progress: Progress | None = None,
) -> ForwardSolution:
    """The pose in which the platform rests on cables of given unstrained lengths.

    Args:
        robot: The robot, with m cables. Or a sequence of N robots, one a sample, that differ in anything but number of
            cables, motion pattern with its plane, kind of tension limits and gravity.
        unstrained_length: L [m], > 0, shape (m,) for one sample or (N, m). A row of NaN, as a plan has it at an
            infeasible pose, is answered by the status NO_LENGTHS.
        start: Where to begin. A batch of N poses: one a sample. A single pose with N samples: a trajectory, the
            first sample begins there and each other where the last one ended. None: every sample is searched for
            by itself, from the level platform; of several equilibria the one is taken that keeps the robot's tension
            limits and is found first (see `equilibria` for the others).
        model: Cable model; the default is exact.
        wrench: External plus inertial wrench on the platform about its center of mass in world axes, without
            gravity: force [N], then moment [N m], shape (6,) or (N, 6). None for none.
        tension_measured: Readings of load cells: then lengths count as measured too, both are corrected within their
            deviations to fit each other, and the answer carries the covariance of the pose.
        winding: Which way the drums turned last, for the friction of pulleys and guides: +1 winding in, -1 paying out,
            0 standing, shape (m,) or (N, m). None: nothing rubs. What friction and guides change of the lengths is
            found in rounds of solving; with load cells, it stays what it is at the measured lengths. Much friction on
            soft cables lets the platform rest at more than one pose near by.
        progress: Called every tenth of a second or so: how many samples are solved, of how many.

    Returns:
        ForwardSolution, single or with a leading axis N.

    Raises:
        InvalidValueError: If a length is not positive, or no longer than the dead cable behind its pulley, or single
            lengths of a sample are NaN (the message names the cable), several robots do not fit together (it names
            which), an argument is of the wrong kind or shape, the start is outside the motions of the robot's pattern,
            or so many samples need more memory than is free.

    Source:
        docs/model.md, section 6.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> plan = sl.inverse(robot, sl.Pose.from_euler([1, 1, 2], 0, 0, 0))
        >>> found = sl.forward(robot, plan.unstrained_length)
        >>> print(found.solved, found.pose.position.round(9))
        True [1. 1. 2.]
    """
    robots = together(robot)
    for value, kind, item in ((start, Pose, "start"), (tension_measured, MeasuredTension, "tension_measured")):
        optional(value, kind, item)
    instance(model, CableModel, "model")
    callback(progress, "progress")
    lengths = checked_lengths(robots, unstrained_length)
    shape = lengths.shape[:-1]
    count = shape[0] if shape else None
    check_count(robots, count)
    check_poses(count or 1, lengths.shape[-1], has_routing(robots))
    load = external_wrench(wrench, count)
    direction = None if winding is None else checked_winding(winding, shape, lengths.shape[-1])
    samples, loads = np.atleast_2d(lengths), np.atleast_2d(load)
    if start is None:
        found = search(robots, model, samples, loads, progress)
    else:
        check_reach(first_of(robots), start, "start")
        chained = bool(shape) and not start.shape
        starts = start_rows(start, lengths)
        found = solve_forward_rows(robots, model, samples, starts, loads, chained=chained, progress=progress)
    if differs(robots, direction):
        found = iterate_routing(robots, model, found, samples, loads, direction)
    covariance = None
    if tension_measured is not None:
        covariance = fit_measurements(robots, model, found, loads, tension_measured)
    solution = found.solution(robots, model, load, shape, covariance)
    return replace(solution, state=with_routing(solution.state, direction))


def checked_lengths(robot: Robots, lengths: ArrayLike) -> Array:
    """The caller's lengths, shape (m,) or (N, m), positive and beyond the dead cable, or whole rows of NaN.

    robot: gives the number of cables, their dead cable, and its name to messages; or one a sample; lengths: what the
    caller gave [m]. Returns write-locked array of shape (m,) or (N, m).
    """
    array = numbers(lengths, "unstrained_length", "m")
    shared, dead = first_of(robot), dead_cable(robot)
    m = shared.cable_count
    if array.ndim not in (1, 2) or array.shape[-1] != m:
        raise InvalidValueError(
            "unstrained_length",
            f"of shape {array.shape}",
            f"shape ({m},) or (N, {m})",
            f"Give one length for each of the {m} cables of {shared.name}.",
        )
    absent = np.isnan(array).all(axis=-1, keepdims=True)
    wrong = ~((array >= SMALLEST) & (array < LARGEST)) & ~absent
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        sample = f"sample {index[0]}, " if array.ndim == 2 else ""
        raise InvalidValueError(
            f"{sample}cable {index[-1]}: unstrained length",
            f"{array[index]:g} m",
            "> 0 m, finite; or NaN for all cables of a sample",
            "Correct the length of this cable.",
        )
    fitting = dead.shape[:-1] in ((), array.shape[:-1])  # who gives other counts is told so later
    if fitting and ((array <= dead) & (dead > 0.0)).any():
        raise dead_only(array, np.broadcast_to(dead, array.shape))
    return locked(array)


def dead_only(lengths: Array, dead: Array) -> InvalidValueError:
    """The error of a length that would not reach from drum to pulley.

    lengths: unstrained lengths [m], shape (m,) or (N, m); dead: dead cable [m], of the same shape; no less than one of
    the lengths. Returns the error, to be raised: it names the cable and, of many, the sample.
    """
    index = tuple(int(i) for i in np.argwhere((lengths <= dead) & (dead > 0.0))[0])
    sample = f"sample {index[0]}, " if lengths.ndim == 2 else ""
    return InvalidValueError(
        f"{sample}cable {index[-1]}: unstrained length",
        f"{lengths[index]:.9g} m",
        f"> {dead[index]:.9g} m, the dead cable behind its pulley",
        "Give all cable off the drum, or correct its dead_cable.",
    )


def start_rows(start: Pose, lengths: Array) -> Array:
    """Pose rows to begin at.

    lengths: the samples, shape (m,) or (N, m). Returns array of shape (1 or N, POSE_COLUMNS).
    """
    if start.shape and start.shape != lengths.shape[:-1]:
        allowed = f"one pose, or {len(lengths)}" if lengths.ndim == 2 else "one pose, for one sample"
        raise InvalidValueError("start", f"{len(start)} poses", allowed, "Give one start a sample, or a single one.")
    return pose_rows(start)
