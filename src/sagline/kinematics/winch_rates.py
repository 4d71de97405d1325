"""What a plan asks of the winches: speeds, torques and counts a second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.kinematics.plan import Plan
from sagline.robot.drum import drum_tension, drums_of


@dataclass(frozen=True, slots=True, eq=False)
class WinchRates(Result):
    """Speeds and torques of the winches along a path, arrays of shape (N, m); NaN where the plan has no answer.

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
        too_fast: Where motor_speed is beyond the winches' speed_limit; None where that is not known.
        too_strong: Where motor_torque is beyond their torque_limit; None where one of the two is not known.
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
    pitch radius of its layer but for the pitch of the helix, which adds some 0.01 %, and the wandering exit: the
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
        _beyond(turned, winches.speed_limit),
        _beyond(torque, winches.torque_limit),
    )


def _beyond(values: Array | None, limit: Array | None) -> Flags | None:
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
