"""Homing: the operator states the pose, and jogs winches until tensions and lengths agree with this pose."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.control.link import Sample
from sagline.control.null_space import SIGMAS, cell_errors
from sagline.control.set_points import Standing
from sagline.control.states import RefusedError
from sagline.core.arrays import Array
from sagline.kinematics.forward import forward
from sagline.kinematics.home import home
from sagline.kinematics.inverse import inverse
from sagline.robot.drum import drum_lever
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot, standard_errors, with_quantities
from sagline.robot.tolerances import UNCERTAIN, value_of
from sagline.robot.winch import Winch
from sagline.statics.stiffness import stiffness
from sagline.tension.method import TensionMethod

_SHARE: Final = 1e-3  # step of the numerical derivatives, in standard deviations
_READING: Final = ("length_zero", "drum_radius")  # quantities with which counts are converted to lengths


def _length_tolerance(robot: Robot, state: Equilibrium, model: CableModel) -> Array:
    """Allowed difference between lengths of a machine and lengths from homing, 5 sigma [m], shape (m,)."""
    # A difference is due to errors of the load cells, the resolution of the encoders, and errors of the robot's data.
    # The errors of the robot's data are its tolerances, or the standard errors of its calibration if these are smaller.
    # Each error changes the computed length at the pose of `state`.
    winches = robot.winches
    assert winches is not None  # a controller needs the data of the drums
    length, lever = state.unstrained_length, drum_lever(robot, state.unstrained_length)  # lever: [m/rad]
    variance = sum((part**2 for part in _at_pose(robot, state, model)), np.zeros(robot.cable_count))
    errors = standard_errors(robot)
    if winches.length_zero is not None:
        variance += np.square(errors.get("length_zero", 0.0))
        variance += np.square(errors.get("drum_radius", 0.0) * (length - winches.length_zero) / lever)
    if winches.counts_per_turn is not None:
        count = 2.0 * np.pi * lever / np.abs(winches.gear * winches.counts_per_turn)
        variance += count**2 / 12.0  # the rounding error of a count is uniformly distributed over one count
    return np.asarray(SIGMAS * np.sqrt(variance))


def _at_pose(robot: Robot, state: Equilibrium, model: CableModel) -> Iterator[Array]:
    """Standard deviations of the lengths at the pose of `state` [m], one array (m,) for each source of error."""
    winches = robot.winches
    assert winches is not None
    reading = state.cables.frame_end_tension * winches.load_cell_gain + winches.load_cell_bias
    stretch = 1.0 + winches.winding_tension / robot.cables.axial_stiffness

    def change(other: Robot, more: Array | float = 0.0) -> Array:
        """Change of the lengths after homing if the robot is `other` and the readings are higher by `more` [N]."""
        there, here = (
            _zeros(home(some, state.pose, read, model=model).winches)
            for some, read in ((other, reading + more), (robot, reading))
        )
        return np.asarray((there - here) / (stretch * _SHARE))

    yield change(robot, _SHARE * _cell_sigma(robot))
    for name, error in standard_errors(robot).items():
        if name in _READING or not UNCERTAIN[name].each:  # a load has no effect, because tensions are given
            continue
        if not np.isfinite(error).all():
            yield np.full(robot.cable_count, math.inf)
            continue
        for axis in np.eye(3) if UNCERTAIN[name].axes else np.ones(1):
            value = value_of(robot, name)
            yield change(robot if value is None else with_quantities(robot, {name: value + _SHARE * error * axis}))


def _cell_sigma(robot: Robot) -> Array:
    """Standard deviation of the load cell readings, including their bias [N], shape (m,)."""
    return np.hypot(*cell_errors(robot))


def _zeros(winches: Winch | None) -> Array:
    assert winches is not None
    assert winches.length_zero is not None
    return winches.length_zero


WINDOW: Final = 50  # number of samples at rest whose mean is compared with the plan
MOST: Final = 1.2  # a jog ends if a tension exceeds the planned tension times this factor


class Homing:
    """Plan at the pose that the operator stated, and comparison of tensions and lengths with this plan."""

    def __init__(
        self, robot: Robot, pose: Pose, model: CableModel, method: TensionMethod, zero: Array | float = 0.0
    ) -> None:
        """Make the plan for the stated `pose`. `zero`: offset of lengths from an earlier homing [m], (m,)."""
        self.plan = inverse(robot, pose, model, method)  # plan of the robot at the stated pose
        if not self.plan.solved:
            gap = self.plan.gaps[0]
            step = "State another pose, at which every cable is under tension."
            reason = "is unstable" if self.plan.feasible else "has no tensions within the limits"
            raise RefusedError("homing", f"the pose {reason}, {gap.status.name}", step)
        self.state = self.plan.state
        self.standing = Standing.at(self.state)
        self.tension = self.state.cables.frame_end_tension  # planned T_A at the pose [N], shape (m,)
        self.sigma = _cell_sigma(robot)  # standard deviation of the load cells [N], shape (m,)
        self._pose, self._robot, self._model = pose, robot, model
        m, winches = robot.cable_count, robot.winches
        self._present = zero + np.zeros(m)
        known = self._present.any() or (winches is not None and winches.length_zero is not None)
        # tolerance: largest difference of a length without confirmation by the operator [m], shape (m,); infinite if
        # the machine has no valid lengths
        self.tolerance = _length_tolerance(robot, self.state, model) if known else np.full(m, np.inf)
        self._lengths, self._tensions = np.zeros(m), np.zeros(m)
        self._count, self._counter = 0, np.zeros(0, dtype=np.int64)
        # off: mean of the measured minus the planned tensions [N], shape (m,)
        # apart: lengths of the machine minus lengths of the plan [m], shape (m,)
        # zero: offset added to the lengths of samples after homing [m], shape (m,)
        self.off, self.apart, self.zero = np.full(m, np.nan), np.full(m, np.nan), np.zeros(m)
        # agrees: True if every tension is within 5 sigma
        # confirmed: True if the operator has confirmed the pose despite different lengths in the machine
        self.agrees = self.confirmed = False

    @property
    def conflicts(self) -> bool:
        """True if tensions agree but a length differs, and the operator has not yet confirmed the pose."""
        return self.agrees and not self._accepted

    @property
    def _accepted(self) -> bool:
        known = self.confirmed and bool(np.isfinite(self.apart).all())
        return self.agrees and (known or bool((np.abs(self.apart) <= self.tolerance).all()))

    def moved(self) -> None:
        """Discard samples and results, because a winch has moved."""
        self._rest()
        self.agrees = self.confirmed = False

    def _rest(self) -> None:
        self._count = 0
        self._lengths[:] = self._tensions[:] = 0.0

    def look(self, sample: Sample) -> bool:
        """Add a sample at rest. Returns True if there are enough samples and they agree with the plan."""
        if self._counter.size and bool((sample.counter == self._counter).any()):
            return False  # a group has sent no new sample
        self._counter = sample.counter
        self._count += 1
        self._lengths += sample.length
        self._tensions += sample.tension
        if self._count < WINDOW:
            return False
        self.off = self._tensions / WINDOW - self.tension
        self.zero = self.state.unstrained_length - self._lengths / WINDOW
        self.apart = self._present - self.zero
        self.agrees = bool((np.abs(self.off) <= SIGMAS * self.sigma).all())
        self._rest()
        return self._accepted

    def jog_limits(self, sample: Sample) -> Array:
        """Upper tension limits of a jog [N], (m,): 1.2 times the planned tension, or the present tension if larger."""
        return np.maximum(MOST * self.tension, sample.tension + 3.0 * self.sigma)

    def refusal(self) -> RefusedError:
        """Create the error that names the deviating lengths or tensions, and the next step."""
        if self.conflicts:
            return self._conflict()
        if not (read := np.isfinite(self.off)).all():
            if not read.any():
                reason = f"fewer than {WINDOW} new samples of all groups came at rest"
                return RefusedError("homing", reason, "Check the PLCs and the network, then home again.")
            reason = f"the load cell of cable {int(np.argmin(read))} gives no reading"
            return RefusedError("homing", reason, "Check cell, plug and amplifier, then home again.")
        off, beyond = self.off, np.abs(self.off) - SIGMAS * self.sigma
        named = ", ".join(f"{i} by {off[i]:+.1f} N" for i in np.argsort(-beyond)[:3] if beyond[i] > 0.0)
        allowed = f"{SIGMAS * float(self.sigma.max()):.3g} N"
        winch, by = self._jog(off)
        step = f"Try jog {winch} {1e3 * by:+.1f}mm, one winch at a time, or place the platform; then home again"
        if (np.abs(self.apart) > self.tolerance).any():
            step += f"; {self._place}"
        reason = f"tensions differ from the plan: cables {named}; allowed: {allowed}"
        return RefusedError("homing", reason, f"{step}.")

    @property
    def _place(self) -> str:
        """Text with the pose that the platform would have if the lengths of the machine were right."""
        stated, length = self._pose, self.state.unstrained_length + self.apart
        found = forward(self._robot, length, start=stated, model=self._model)
        if not found.stable:
            return "at its lengths, the platform has no equilibrium near the stated pose"
        x, y, z = np.round(found.pose.position, 3) + 0.0  # no negative zero
        apart = 1e3 * float(np.linalg.norm(found.pose.position - stated.position))
        turn = 2.0 * math.acos(min(abs(float(found.pose.quaternion @ stated.quaternion)), 1.0))
        away = f"{apart:.1f} mm and {math.degrees(turn):.1f} degrees away"
        return f"at its lengths, the platform is at ({x:.3f}, {y:.3f}, {z:.3f}) m, {away}"

    def _conflict(self) -> RefusedError:
        """Create the error for the length that differs most, with the pose that follows from the machine's lengths."""
        ratio = np.abs(self.apart) / self.tolerance
        i = int(np.argmax(np.where(np.isfinite(self.apart), ratio, np.inf)))
        there, planned = self.state.unstrained_length + self.apart, self.state.unstrained_length
        if not np.isfinite(self.apart[i]):
            return RefusedError("homing", f"encoder {i} reads {there[i]:g} m", "Check encoder and plug; home again.")
        reason = (
            f"cable {i}: {1e3 * there[i]:.1f} mm in the machine, {1e3 * planned[i]:.1f} mm from homing, allowed "
            f"difference {1e3 * self.tolerance[i]:.1f} mm; {self._place}"
        )
        step = "Measure the pose; home at the measured pose, or confirm: home --confirm, confirm_homing() in Python."
        return RefusedError("homing", reason, step)

    def _jog(self, off: Array) -> tuple[int, float]:
        """Winch and length [m] of the jog that reduces the tension errors most."""
        slope = stiffness(self.state).tension_sensitivity
        by = -(slope.T @ off) / (slope**2).sum(axis=0)
        left = np.linalg.norm(off[:, None] + slope * by, axis=0)
        winch = int(np.argmin(left))
        return winch, float(np.clip(by[winch], -0.01, 0.01))
