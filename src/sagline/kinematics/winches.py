"""Encoder counts, speeds and torques of the winches for a plan, and lengths from counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.creep import Creep
from sagline.core.arguments import choice, instance, optional
from sagline.core.arrays import Array, Flags, kernel_input, locked, numbers
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.kernels.cable.drum import MEMORY_ROWS, follow_memory
from sagline.kinematics.plan import Plan
from sagline.robot.drum import Drums, drum_tension, drums_of, warmth
from sagline.robot.robot import Robot

Winding = Literal["constant", "remembered"]
LARGEST: Final = 2.0**53  # counts: beyond, whole numbers are not exact


def encoder_counts(
    plan: Plan, winding: Winding = "constant", *, temperature: ArrayLike = 0.0, creep: Creep | None = None
) -> Array:
    """Counts of the encoders at which the drums have let out a plan's lengths.

    Args:
        plan: A plan of a robot whose winches have a drum, counts and the zeros of both.
        winding: State of the cable on the drum. "constant": cable wound at the winches' winding_tension. "remembered":
            cable wound along the plan too, each meter at the tension it had at the drum when it was wound in; below it,
            what was never off the drum since the first sample, at winding_tension.
        temperature: By how much the cables are warmer than where the lengths of the winches hold [K], a number or one
            a cable.
        creep: Creep of the cables along the plan's path, zero at its first sample, under the plan's
            `chord_tension`; None for not at all.

    Returns:
        Whole counts, shape (m,) or (N, m), as floats; NaN where the plan has no solution.

    Raises:
        InvalidValueError: If the robot's winches or cables lack what is needed (the message names it), a drum cannot
            hold the cable that is left or has not so much, or creep is given for a plan without a path.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> winch = sl.Winch(
        ...     drum_radius=0.06,
        ...     groove_pitch=0.006,
        ...     gear=10.0,
        ...     counts_per_turn=4096,
        ...     length_zero=8.0,
        ... )
        >>> rope = robot.cables.replace(diameter=0.004)
        >>> robot = robot.replace(winches=winch, cables=rope)
        >>> plan = sl.inverse(robot, sl.Pose.from_euler([1, 1, 2], 0, 0, 0))
        >>> counts = sl.encoder_counts(plan)
        >>> back = sl.lengths_from_counts(robot, counts)
        >>> off = abs(back - plan.unstrained_length).max()
        >>> print(counts[0], f"{1e6 * off:.1f} um")
        320530.0 4.6 um

    Source:
        docs/model.md, section 10.
    """
    robot = instance(plan, Plan, "plan").state.one_robot
    choice(winding, "winding", get_args(Winding))
    optional(creep, Creep, "creep")
    drums = drums_of(robot)
    longer = warmth(robot, temperature)
    if creep is not None:
        longer = longer * (1.0 + _creep_strain(plan, creep))
    shape = plan.unstrained_length.shape
    length = np.atleast_2d(plan.unstrained_length / longer)
    if winding == "constant":
        path = length * (1.0 + drums.rest_strain)
    else:
        path = _remembered_lengths(drums, robot, length, drum_tension(plan.state), unstrained=True)
    return locked(np.rint(drums.counts(path)).reshape(shape))


def lengths_from_counts(
    robot: Robot,
    counts: ArrayLike,
    winding: Winding = "constant",
    *,
    drum_tension: ArrayLike | None = None,
    temperature: ArrayLike = 0.0,
) -> Array:
    """Unstrained lengths of the cable off the drums at counts of the encoders: what `forward` takes.

    Args:
        robot: A robot whose winches have a drum, counts and the zeros of both.
        counts: Shape (m,) or (N, m); NaN where there is none.
        winding: As of `encoder_counts`; "remembered" needs the tensions.
        drum_tension: Of the cables where they leave the drum, at each sample [N], of the shape of counts: for
            winding="remembered" alone. That of a plan is `winch_rates(plan).drum_tension`.
        temperature: By how much the cables are warmer than where the lengths of the winches hold [K].

    Returns:
        L [m], of the shape of counts. Where cables creep, multiply by 1 + `Creep.strain` of the
            plan's times and `chord_tension`.

    Raises:
        InvalidValueError: If the robot's winches or cables lack what is needed (the message names it), counts run off a
            drum, are no whole number of rows, or tensions are missing.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("winches_robot.yaml")  # doctest: +SKIP
        >>> counts = sl.encoder_counts(sl.inverse(robot, path))  # doctest: +SKIP
        >>> lengths = sl.lengths_from_counts(robot, counts)  # doctest: +SKIP

    Source:
        docs/model.md, section 10.
    """
    drums = drums_of(instance(robot, Robot, "robot"))
    choice(winding, "winding", get_args(Winding))
    rows = _rows(robot, counts, "counts", "")
    path = drums.lengths_at(np.atleast_2d(rows))
    longer = warmth(robot, temperature)
    if (winding == "remembered") != (drum_tension is not None):
        given = "not given" if drum_tension is None else "given"
        allowed = 'given with winding="remembered", and only then'
        step = "Give those of the plan, winch_rates(plan).drum_tension, or what was measured; or leave both out."
        raise InvalidValueError("drum_tension", given, allowed, step)
    if drum_tension is None:
        length = path / (1.0 + drums.rest_strain)
    else:
        tension = _rows(robot, drum_tension, "drum_tension", "N")
        if tension.shape != rows.shape:
            shapes = f"of shape {tension.shape}"
            raise InvalidValueError("drum_tension", shapes, f"shape {rows.shape}, as counts", "Give one a count.")
        length = _remembered_lengths(drums, robot, path, tension, unstrained=False)
    return locked((length * longer).reshape(rows.shape))


def _remembered_lengths(drums: Drums, robot: Robot, given: Array, tension: Array, *, unstrained: bool) -> Array:
    """Lengths with the drums' memory of tensions, (N, m)."""
    strain = np.atleast_2d(tension / robot.cables.axial_stiffness)
    if (loose := strain <= -1.0).any():
        p, i = (int(index) for index in np.argwhere(loose)[0])
        shown = f"{np.atleast_2d(tension)[p, i]:g} N"
        raise InvalidValueError(
            f"sample {p}, cable {i}: drum_tension", shown, ">= 0 N", "No cable is pushed; correct the tension."
        )
    found, paths = np.empty(given.shape), kernel_input(given, given.shape)
    follow_memory(
        paths,
        kernel_input(strain, given.shape),
        drums.rest_strain,
        unstrained,
        found,
        np.empty((MEMORY_ROWS, len(given))),
    )
    return found


def _creep_strain(plan: Plan, creep: Creep) -> Array:
    if plan.path is None:
        step = "Plan along a Path, or leave creep out."
        raise InvalidValueError("creep", "given for a plan without a path", "times to creep in", step)
    return creep.strain(plan.path.time, plan.chord_tension)


def _rows(robot: Robot, value: ArrayLike, item: str, unit: str) -> Array:
    """Numbers of shape (m,) or (N, m), NaN among them."""
    array, m = numbers(value, item, unit), robot.cable_count
    if array.ndim not in (1, 2) or array.shape[-1] != m:
        step = f"Give one for each of the {m} cables of {robot.name}."
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape ({m},) or (N, {m})", step)
    wrong = np.abs(array) > LARGEST
    if wrong.any():
        index = tuple(int(k) for k in np.argwhere(wrong)[0])
        where = f"sample {index[0]}, " if array.ndim == 2 else ""
        shown = f"{array[index]:g} {unit}".rstrip()
        allowed = f"within +-{LARGEST:.0f} {unit}".rstrip()
        raise InvalidValueError(f"{where}cable {index[-1]}: {item}", shown, allowed, "Correct it, or give NaN.")
    return array


@dataclass(frozen=True, slots=True, eq=False)
class WinchRates(Result):
    """Speeds and torques of the winches along a path, arrays of shape (N, m); NaN where the plan has no solution.

    Speeds of the drum are positive where cable is let out; what holds at the motor is positive in the direction in
    which the encoder, on its shaft, counts up. With a positive gear both are the same direction, and a motor that only
    holds a cable has a negative torque.

    Attributes:
        drum_speed: Of the drum [rad/s].
        motor_speed: Of the motor's shaft [rad/s]: drum_speed times gear.
        motor_acceleration: Of the motor's shaft [rad/s^2]: from differences of the lengths' rates between samples,
            without the jump where a layer ends.
        drum_tension: Of the cable where it leaves the drum [N], with friction where the plan knows the winding.
        motor_torque: That the motor gives at its shaft [N m]: inertia, less the cable's pull at the drum's lever over
            the gear, plus the drive's friction against the motion; at rest without friction. None where the inertia
            of the winches is not known.
        count_rate: Of the encoder [1/s]; None where counts_per_turn is not known.
        too_fast: True where motor_speed is beyond the winches' speed_limit; None if that is unknown.
        too_strong: True where motor_torque is beyond their torque_limit; None if one of the two is unknown.
    """

    drum_speed: Array
    motor_speed: Array
    motor_acceleration: Array
    drum_tension: Array
    motor_torque: Array | None
    count_rate: Array | None
    too_fast: Flags | None
    too_strong: Flags | None

    @property
    def exceeding(self) -> Flags:
        """Samples at which a winch would have to exceed a limit that is known, shape (N,)."""
        found = np.zeros(len(self.drum_speed), dtype=np.bool_)
        for beyond in (self.too_fast, self.too_strong):
            if beyond is not None:
                found |= beyond.any(axis=-1)
        return locked(found)


def winch_rates(plan: Plan) -> WinchRates:
    """Speeds and torques that the winches need to follow a plan, and where they exceed their limits.

    The lever of the cable is the change of its length in a turn of the drum, over 2 pi, so that no power is lost: the
    pitch radius of its layer except for the pitch of the helix, which adds some 0.01 %, and the wandering exit: the
    pitch times the slant of the run in a turn, 0.06 % where a groove pitch of 4 mm is 40 mm off at 0.8 m. Drums are
    wound at winding_tension.

    Args:
        plan: A plan along a path, of a robot whose winches have drum_radius and groove_pitch and whose cables a
            diameter. Of several layers or a wandering exit, drum_width and cable_length are needed too.

    Returns:
        Rates, at every sample.

    Raises:
        InvalidValueError: If the plan has no path, data are missing (the message names them), or a drum cannot hold
            what is left of the cable.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> winch = sl.Winch(
        ...     drum_radius=0.06,
        ...     groove_pitch=0.006,
        ...     gear=10.0,
        ...     speed_limit=300.0,
        ... )
        >>> rope = robot.cables.replace(diameter=0.004)
        >>> robot = robot.replace(winches=winch, cables=rope)
        >>> path = sl.quintic_path([(0, 0, 2), (2, 1, 2.5)], durations=2.0)
        >>> rates = sl.winch_rates(sl.inverse(robot, path))
        >>> fastest = abs(rates.motor_speed).max()
        >>> print(f"{fastest:.0f} rad/s, {rates.exceeding.sum()} samples too fast")
        340 rad/s, 49 samples too fast

    Source:
        docs/model.md, section 10.
    """
    robot, rate = instance(plan, Plan, "plan").state.one_robot, plan.length_rate
    if plan.path is None or rate is None:
        raise InvalidValueError("plan", "one of poses without times", "one along a path", "Plan along a Path.")
    drums = drums_of(robot)
    winches, stretch = drums.winches, 1.0 + drums.rest_strain
    _, travel = drums.turns(plan.unstrained_length * stretch)
    lever = travel / (2.0 * np.pi)
    speed = rate * stretch / lever
    acceleration = winches.gear * _differences(plan.path.time, rate * stretch) / lever
    tension = drum_tension(plan.state)
    torque = None
    if winches.inertia is not None:
        against = winches.friction * np.sign(speed) - tension
        torque = locked(winches.inertia * acceleration + against * lever / winches.gear)
    turned = winches.gear * speed
    counted = None if winches.counts_per_turn is None else locked(turned * winches.counts_per_turn / (2.0 * np.pi))
    return WinchRates(
        locked(speed),
        locked(turned),
        locked(acceleration),
        tension,
        torque,
        counted,
        _exceeds(turned, winches.speed_limit),
        _exceeds(torque, winches.torque_limit),
    )


def _exceeds(values: Array | None, limit: Array | None) -> Flags | None:
    return None if values is None or limit is None else locked(np.abs(values) > limit)


def _differences(time: Array, values: Array) -> Array:
    """Rates of values, (N, m), within each run of samples that have one; a sample alone has none."""
    found = np.full(values.shape, np.nan)
    kept = np.isfinite(values).all(axis=-1)
    gradient: Any = np.gradient  # its types do not know arrays of two axes
    edges = np.flatnonzero(np.diff(np.concatenate(([False], kept, [False])).astype(np.int8))).reshape(-1, 2)
    for first, end in edges:
        if end - first > 1:
            order = 2 if end - first > 2 else 1
            found[first:end] = gradient(values[first:end], time[first:end], axis=0, edge_order=order)
    return found
