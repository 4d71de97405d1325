"""What a calibration is asked, and where its search is."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.observing import Machine, Observed, machine_of
from sagline.calibration.paid import paid_out
from sagline.calibration.parameters import external, internal, offset_with, robot_with, sensors_with
from sagline.calibration.sensors import Sensors
from sagline.calibration.unknowns import KINDS, Parameters
from sagline.core.arrays import Array, Indices
from sagline.robot.robot import Robot

_AT_LEAST_NONE: Final = ("pulley_radius", "dead_cable")  # kinds of which less than nothing is none, and nothing usual


class Log(NamedTuple):
    """What was read at N poses, NaN where a sensor was silent.

    Attributes:
        counts: Of the encoders, (N, m), or None.
        lengths: That the machine believes [m], (N, m), or None; one of the two is there.
        cells: Of the load cells [N], (N, m).
        positions: [m], (N, 3).
        rotations: Unit quaternions, (N, 4).
    """

    counts: Array | None
    lengths: Array | None
    cells: Array
    positions: Array
    rotations: Array


class Problem(NamedTuple):
    """A calibration to be done.

    Attributes:
        robot: As it is believed to be.
        model: Cable model.
        sensors: What reads.
        parameters: What is looked for.
        log: What was read.
    """

    robot: Robot
    model: CableModel
    sensors: Sensors
    parameters: Parameters
    log: Log

    @property
    def prior(self) -> Array:
        """What is known beforehand, internally, (P,)."""
        return internal(self.parameters, self.parameters.prior)

    @property
    def prior_deviation(self) -> Array:
        """Its standard deviation, internally, (P,)."""
        known, prior = self.parameters.prior_deviation, self.parameters.prior
        deviation: Array = known / np.where(self.parameters.logarithmic, prior, 1.0)
        return deviation

    def missed(self, numbers: Array) -> Array:
        """By how many of these deviations numbers (P,) are off what is known beforehand, (P,)."""
        off: Array = (numbers - self.prior) / self.prior_deviation
        return off

    @property
    def scale(self) -> Array:
        """A unit of each number, internally (P,): its prior deviation, or what is usual of one that nobody gives.

        The smaller of the two: in wider units sums of squares are rounding where a number is told well.
        """
        usual = np.array([KINDS[name].assumed for name in self.parameters.names])
        unit: Array = np.fmin(self.prior_deviation, usual)
        return unit

    @property
    def least(self) -> Array:
        """The least that each number may be, internally (P,)."""
        return np.array([0.0 if name in _AT_LEAST_NONE else -np.inf for name in self.parameters.names])


class State(NamedTuple):
    """Where the search is.

    Attributes:
        numbers: What is looked for, internally, (P,).
        machine: The robot with these numbers.
        lengths: True lengths [m], (N, m).
        poses: Pose rows, (N, POSE_COLUMNS).
    """

    numbers: Array
    machine: Machine
    lengths: Array
    poses: Array


class Normal(NamedTuple):
    """What the poses say near a state.

    Attributes:
        matrix: J^T W J of all poses, without the prior, (P, P).
        gradient: J^T W y, (P,).
        squares: Sum of squares of each pose, infinite where the platform finds no equilibrium, (N,).
        readings: How many readings each pose has, (N,).
        weights: With which the poses count, (N,).
        rows: All that is said, of a log of one block; None of a longer one, which is looked at anew.
    """

    matrix: Array
    gradient: Array
    squares: Array
    readings: Indices
    weights: Array
    rows: Observed | None


class Fit(NamedTuple):
    """How the search ended.

    Attributes:
        state: The last one.
        normal: What the poses say there.
        converged: Whether no step promises more.
        iterations: How many steps were taken.
    """

    state: State
    normal: Normal
    converged: bool
    iterations: int


Begun = tuple[State, Normal]


def machine_at(problem: Problem, numbers: Array) -> Machine:
    """The robot and its sensors with some numbers (P,), internal ones.

    Raises:
        InvalidValueError: If the robot cannot have them.
    """
    values, parameters = external(problem.parameters, numbers), problem.parameters
    robot = robot_with(problem.robot, parameters, values)
    sensors = sensors_with(problem.sensors, parameters, values)
    offset = offset_with(problem.robot, parameters, values)
    return machine_of(robot, problem.model, parameters, sensors, offset)


def said_lengths(problem: Problem, machine: Machine, part: slice) -> Array:
    """The lengths that the winches say [m], (n, m), of some of the poses."""
    log = problem.log
    if log.counts is not None and machine.drums is not None:
        return paid_out(machine.drums, log.counts[part])
    assert log.lengths is not None
    said: Array = log.lengths[part] + machine.offset
    return said
