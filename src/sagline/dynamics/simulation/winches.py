"""Winches, encoders and load cells of a simulated robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np

from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.fields import NumberFields, rule
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.progress import read_cells, read_encoders
from sagline.kernels.jit import bound
from sagline.robot.drum import Drums, drum_lever, not_given
from sagline.robot.robot import Robot

AIR: Final = 1.2  # density of air [kg/m^3]
ROUND: Final = 1.2  # drag coefficient of a long round cable in cross wind, based on its diameter
NEEDED: Final = ("drum_radius", "inertia", "position_gain", "speed_gain", "integral_gain")


@dataclass(frozen=True, slots=True)
class SecondOrder(NumberFields):
    """Winches whose lengths follow their set points as damped second-order systems.

    If the set point changes at a constant rate, the length lags by this rate times 2 damping_ratio / (2 pi bandwidth).

    Attributes:
        bandwidth: Natural frequency [Hz], > 0.
        damping_ratio: Damping ratio of the oscillation, > 0.

    Raises:
        InvalidValueError: If a value is not positive.
    """

    bandwidth: float = field(metadata=rule("Hz", above=0.0))
    damping_ratio: float = field(default=1.0, metadata=rule(above=0.0))


Winches: TypeAlias = Literal["ideal", "robot"] | SecondOrder
Winding: TypeAlias = Literal["constant", "remembered"]


def winch_kind(winches: Any) -> int:
    """The kernel's code of a type of winches."""
    if isinstance(winches, SecondOrder):
        return d.SECOND_ORDER
    if isinstance(winches, str) and winches in ("ideal", "robot"):
        return d.IDEAL if winches == "ideal" else d.DRUMS
    allowed = '"ideal", "robot" or SecondOrder(bandwidth, damping_ratio)'
    raise InvalidValueError("winches", brief(winches), allowed, "Choose one of them as winches.")


def checked_winding(winding: Any, kind: int) -> Winding:
    """Check the option `winding`. "remembered" is rejected for winches without drums."""
    found: Winding = choice(winding, "winding", get_args(Winding))
    if found == "remembered" and kind != d.DRUMS:
        step = 'Add winches="robot", or omit winding.'
        raise InvalidValueError("winding", '"remembered"', '"constant" for winches without drums', step)
    return found


def drive_data(robot: Robot, winches: Winches, length: Array, with_wind: bool) -> Array:
    """Data of the drives for the kernels, (DATA_ROWS, m), at the lengths `length` (m,) [m]."""
    data = np.zeros((d.DATA_ROWS, robot.cable_count))
    if isinstance(winches, SecondOrder):
        data[d.BANDWIDTH] = 2.0 * np.pi * winches.bandwidth
        data[d.RATIO] = winches.damping_ratio
    if robot.winches is not None:
        data[d.WINDING_STRAIN] = robot.winches.winding_tension / robot.cables.axial_stiffness
        data[d.BEHIND_RISE] = robot.winches.dead_rise
    if with_wind:
        if robot.cables.diameter is None:
            step = "Give it in the robot file or with Cable(..., diameter=...), or omit wind."
            raise InvalidValueError("cables: diameter", "not given", "known for a simulation with wind", step)
        data[d.DRAG] = 0.5 * AIR * ROUND * robot.cables.diameter
    if winch_kind(winches) == d.DRUMS:
        _fill_drums(data, robot, length)
    return data


def _fill_drums(data: Array, robot: Robot, length: Array) -> None:
    """Inertia, limits and gains of the drives, converted to the motion of the cable at the initial drum radius."""
    winch = robot.winches
    missing = [f"winches: {name}" for name in NEEDED if winch is None or getattr(winch, name) is None]
    if winch is None or missing:
        step = "Give them in the robot file, or with robot.replace(winches=Winch(...))."
        raise InvalidValueError(*not_given(missing), 'known for winches="robot"', step)
    ratio = np.abs(winch.gear) / drum_lever(robot, length)  # motor rotation per length of cable [rad/m]
    data[d.INERTIA] = winch.inertia * ratio**2  # type: ignore[operator]
    data[d.FORCE_LIMIT] = np.inf if winch.torque_limit is None else winch.torque_limit * ratio
    data[d.SPEED_LIMIT] = np.inf if winch.speed_limit is None else winch.speed_limit / ratio
    data[d.FRICTION] = winch.friction
    data[d.POSITION_GAIN] = winch.position_gain
    data[d.SPEED_GAIN] = winch.speed_gain
    data[d.INTEGRAL_GAIN] = winch.integral_gain
    most = 2.0 * data[d.INERTIA] / d.LOOP_PERIOD  # a larger correction per period would reverse and increase the error
    if (wild := data[d.SPEED_GAIN] >= most).any():
        i = int(np.argmax(wild))
        allowed = f"< {most[i]:.4g} N s/m for {data[d.INERTIA, i]:.4g} kg at the cable, closed every millisecond"
        step = "Give a smaller gain, or more inertia."
        raise InvalidValueError(f"winches: speed_gain[{i}]", f"{data[d.SPEED_GAIN, i]:g} N s/m", allowed, step)


class Encoders:
    """Encoders on drums."""

    def __init__(self, robot: Robot, wound: Array, stretch: Array) -> None:
        """Create the encoders of a robot with complete drum data; `wound` (m,) [m]; `stretch` (m,)."""
        drums, m = Drums(robot), robot.cable_count
        zero, rate = drums.zero_and_rate()
        self.counts = np.empty(m)  # whole counts, as floats
        offset = drums.winches.count_zero + zero * rate
        given = ((drums.table, drums.starts), wound, locked(stretch), locked(offset), locked(rate * 1.0))
        self.read = bound(read_encoders, *given, np.empty((3, 1, m)), self.counts)  # fills the array of the counts


class LoadCells:
    """Load cells at the frame ends of the cables."""

    def __init__(self, robot: Robot, seed: int, tension: Array) -> None:
        """Create the load cells of `robot`. If the robot has no winches, the load cells measure the true tensions."""
        # shapes: tension (m,) [N]
        m, winch = robot.cable_count, robot.winches
        cells = np.array([np.ones(m), np.zeros(m), np.zeros(m), np.full(m, np.inf)])
        if winch is not None:
            cells[:3] = winch.load_cell_gain, winch.load_cell_bias, winch.load_cell_deviation
            if winch.load_cell_range is not None:
                cells[3] = winch.load_cell_range
        self.generator = np.random.default_rng(seed)  # of the noise
        self.reading, self._noise = np.empty(m), np.empty(m)  # measured tensions [N]
        self._read = bound(read_cells, tension, locked(cells), self._noise, self.reading)

    def read(self) -> None:
        """Fill the array of the measured tensions."""
        self.generator.standard_normal(out=self._noise)
        self._read()
