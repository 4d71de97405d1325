"""Encoder counts, speeds and torques of the winches for a plan; lengths from counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.cable import Creep
from sagline.core.arguments import choice, instance, optional, true_runs
from sagline.core.arrays import Array, Flags, kernel_input, locked, numbers
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels.cable.drum import MEMORY_ROWS, follow_memory
from sagline.kinematics.plan import Plan
from sagline.robot.drum import Drums, drum_tension, warmth
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

Winding = Literal["constant", "remembered"]
LARGEST: Final = 2.0**53  # [counts]; larger whole numbers are not exact as floats


def encoder_counts(
    plan: Plan, winding: Winding = "constant", *, temperature: ArrayLike = 0.0, creep: Creep | None = None
) -> Array:
    """Encoder counts for the lengths of a plan.

    Args:
        plan: A plan of a robot whose winches have a drum, counts, and the zeros of counts and lengths.
        winding: State of the cable on the drum. "constant": all cable was wound at the winding_tension of the winches.
            "remembered": cable that is wound in along the plan keeps the tension that it had at the drum; the cable on
            the drum at the first sample was wound at winding_tension.
        temperature: Temperature of the cables minus the temperature for which the winch lengths are valid [K], a number
            or one per cable.
        creep: Creep of the cables due to `chord_tension` along the path, zero at the first sample; None: no creep.

    Returns:
        Whole counts, shape (m,) or (N, m), as floats; NaN where the plan has no solution.

    Raises:
        InvalidValueError: If required data of winches or cables are missing: the message names them. If the remaining
            cable does not fit on a drum or is too short. If `creep` is given for a plan without a path.

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
    robot = instance(plan, Plan, "plan").robot
    choice(winding, "winding", get_args(Winding))
    optional(creep, Creep, "creep")
    drums = Drums(robot)
    longer = warmth(robot, temperature)
    if creep is not None:
        if plan.path is None:
            step = "Plan along a Path, or omit creep."
            raise InvalidValueError("creep", "given for a plan without a path", "a path with times", step)
        longer = longer * (1.0 + creep.strain(plan.path.time, plan.chord_tension))
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
    """Unstrained lengths off the drums from encoder counts, for `forward`.

    Args:
        robot: A robot whose winches have a drum, counts, and the zeros of counts and lengths.
        counts: Encoder counts, shape (m,) or (N, m); NaN if unknown.
        winding: Same as in `encoder_counts`; "remembered" requires drum_tension.
        drum_tension: Tension of the cables at the drum for each sample [N], with the shape of `counts`. Only for
            winding="remembered". For a plan, use `winch_rates(plan).drum_tension`.
        temperature: Temperature of the cables minus the temperature for which the winch lengths are valid [K].

    Returns:
        Unstrained lengths off the drums [m], with the shape of counts. For cables with creep, multiply by 1 +
        `Creep.strain` of the plan's times and `chord_tension`.

    Raises:
        InvalidValueError: If required data of winches or cables are missing: the message names them. If `counts` are
            beyond the end of a drum or have the wrong shape. If `drum_tension` is missing.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("winches_robot.yaml")  # doctest: +SKIP
        >>> counts = sl.encoder_counts(sl.inverse(robot, path))  # doctest: +SKIP
        >>> lengths = sl.lengths_from_counts(robot, counts)  # doctest: +SKIP

    Source:
        docs/model.md, section 10.
    """
    drums = Drums(instance(robot, Robot, "robot"))
    choice(winding, "winding", get_args(Winding))
    rows = _rows(robot, counts, "counts", "")
    path = drums.lengths_at(np.atleast_2d(rows))
    longer = warmth(robot, temperature)
    if (winding == "remembered") != (drum_tension is not None):
        given = "not given" if drum_tension is None else "given"
        allowed = 'given with winding="remembered", and only then'
        step = "Give winch_rates(plan).drum_tension or measured tensions; or omit both arguments."
        raise InvalidValueError("drum_tension", given, allowed, step)
    if drum_tension is None:
        length = path / (1.0 + drums.rest_strain)
    else:
        tension = _rows(robot, drum_tension, "drum_tension", "N")
        if tension.shape != rows.shape:
            value, allowed = f"of shape {tension.shape}", f"shape {rows.shape}, as counts"
            raise InvalidValueError("drum_tension", value, allowed, "Give one tension per count.")
        length = _remembered_lengths(drums, robot, path, tension, unstrained=False)
    return locked((length * longer).reshape(rows.shape))


def _remembered_lengths(drums: Drums, robot: Robot, given: Array, tension: Array, *, unstrained: bool) -> Array:
    """Lengths (N, m) for a cable that keeps, on the drum, the tension with which it was wound."""
    strain = np.atleast_2d(tension / robot.cables.axial_stiffness)
    if (loose := strain <= -1.0).any():
        p, i = (int(index) for index in np.argwhere(loose)[0])
        item, shown = f"sample {p}, cable {i}: drum_tension", f"{np.atleast_2d(tension)[p, i]:g} N"
        raise InvalidValueError(item, shown, ">= 0 N", "A cable only pulls; correct the tension.")
    found, memory = np.empty(given.shape), np.empty((MEMORY_ROWS, len(given)))
    paths, strains = (kernel_input(each, given.shape) for each in (given, strain))
    follow_memory(paths, strains, drums.rest_strain, unstrained, found, memory)
    return found


def _rows(robot: Robot, value: ArrayLike, item: str, unit: str) -> Array:
    """Numbers of shape (m,) or (N, m); NaN is allowed."""
    array, m = numbers(value, item, unit), robot.cable_count
    if array.ndim not in (1, 2) or array.shape[-1] != m:
        step = f"Give one value for each of the {m} cables of {robot.name}."
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape ({m},) or (N, {m})", step)
    wrong = np.abs(array) > LARGEST
    if wrong.any():
        index = tuple(int(k) for k in np.argwhere(wrong)[0])
        where = f"sample {index[0]}, " if array.ndim == 2 else ""
        shown = f"{array[index]:g} {unit}".rstrip()
        allowed = f"within +-{LARGEST:.0f} {unit}".rstrip()
        raise InvalidValueError(f"{where}cable {index[-1]}: {item}", shown, allowed, "Correct it, or give NaN.")
    return array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class WinchRates(Result, Tabular):
    """Speeds and torques of the winches along a path, arrays of shape (N, m); NaN where the plan has no solution.

    Drum speeds are positive while cable is paid out. Motor quantities are positive if the encoder on the motor shaft
    counts up. With a positive gear both signs agree, and a motor that holds a cable at rest has a negative torque.

    Attributes:
        drum_speed: Speed of the drum [rad/s].
        motor_speed: Speed of the motor's shaft [rad/s]: drum_speed times gear.
        motor_acceleration: Acceleration of the motor's shaft [rad/s^2], from differences of the length rates at the
            samples. The jump at the end of a layer is not included.
        drum_tension: Tension of the cable where it leaves the drum [N], with friction if the plan has winding
            directions.
        motor_torque: Torque of the motor at its shaft [N m]: inertia torque, minus the torque of the cable tension
            (tension times lever divided by gear), plus the torque against friction (zero at rest). None if the inertia
            of the winches is unknown.
        count_rate: Count rate of the encoder [1/s]; None if counts_per_turn is not known.
        too_fast: True where motor_speed exceeds the winches' speed_limit; None if the limit is not known.
        too_strong: True where motor_torque exceeds the winches' torque_limit; None if torque or limit is not known.
    """

    _columns: ClassVar[Columns] = (
        "motor_speed#=motor_speed",
        "motor_torque#=motor_torque",
        "drum_tension#=drum_tension",
    )

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
        """True for samples at which a winch exceeds a known limit, shape (N,)."""
        found = np.zeros(len(self.drum_speed), dtype=np.bool_)
        for beyond in (self.too_fast, self.too_strong):
            if beyond is not None:
                found |= beyond.any(axis=-1)
        return locked(found)


def winch_rates(plan: Plan) -> WinchRates:
    """Speeds and torques of the winches along a plan, and the samples at which a winch exceeds a limit.

    The lever of the cable is the change of its length per drum turn divided by 2 pi, so that power is conserved. The
    lever differs from the pitch radius of the layer for two reasons. The pitch of the helix adds about 0.01 %. The
    motion of the exit along the drum adds the groove pitch times the slant of the cable. For a groove pitch of 4 mm and
    an exit 40 mm off center at a distance of 0.8 m, this is 0.06 %. The cable on the drums is at winding_tension. If
    neither groove_pitch nor the diameter of the cables is known, the lever is drum_radius, as in `fastest`.

    Args:
        plan: A plan along a path, of a robot whose winches have drum_radius. If groove_pitch is known, the diameter of
            the cables must also be known, and vice versa. Several layers or a moving exit also need drum_width and
            cable_length.

    Returns:
        Speeds and torques of the winches at every sample.

    Raises:
        InvalidValueError: If `plan` has no path. If data are missing: the message names them. If the remaining cable
            does not fit on a drum.

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
    robot, rate = instance(plan, Plan, "plan").robot, plan.length_rate
    if plan.path is None or rate is None:
        raise InvalidValueError("plan", "a plan of poses without times", "a plan along a path", "Plan along a Path.")
    winches, stretch, lever = _levers(robot, plan.unstrained_length)
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


def _levers(robot: Robot, length: Array) -> tuple[Winch, Array, Array]:
    """The winches, the stretch factor of the cable on the drums, and the levers of the cables [m], (N, m)."""
    winches, cables = robot.winches, robot.cables
    bare = cables.diameter is None and winches is not None and winches.groove_pitch is None
    if bare and winches is not None and winches.drum_radius is not None:
        return winches, 1.0 + winches.winding_tension / cables.axial_stiffness, winches.drum_radius
    drums = Drums(robot)
    stretch = 1.0 + drums.rest_strain
    _, travel = drums.turns(length * stretch)
    return drums.winches, stretch, travel / (2.0 * np.pi)


def _exceeds(values: Array | None, limit: Array | None) -> Flags | None:
    return None if values is None or limit is None else locked(np.abs(values) > limit)


def _differences(time: Array, values: Array) -> Array:
    """Rates of `values` (N, m), computed separately in each range of valid samples; NaN for a range of one sample."""
    found = np.full(values.shape, np.nan)
    kept = np.asarray(np.isfinite(values).all(axis=-1))
    gradient: Any = np.gradient  # the type annotations of the library do not support arrays with two axes
    for first, end in true_runs(kept):
        if end - first > 1:
            order = 2 if end - first > 2 else 1
            found[first:end] = gradient(values[first:end], time[first:end], axis=0, edge_order=order)
    return found
