"""Symmetries of a robot: changes of the parameters that change no reading.

The origins of the world and of the platform frame, the meter and the newton are conventions. Another convention changes
parameters, but no reading. See docs/model.md, section 14.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.calibration.log import Sensors
from sagline.calibration.parameters import left_jacobian
from sagline.core.arrays import Array, Flags
from sagline.core.errors import InvalidValueError
from sagline.kernels.calibration import kinds
from sagline.robot.drum import drums_of
from sagline.robot.robot import Robot

_AXES: Final = ("x", "y", "z")
_WORLD: Final = "fix a frame anchor, or measure 3 points"
_YAW: Final = "fix a second frame anchor, or measure 3 points"
_TILT: Final = "give a platform anchor a small tolerance, or measure rotations"
_ORIGIN: Final = (
    "give a platform anchor or the center of mass a small tolerance, or measure positions of a known target"
)
_BOTH: Final = "measure the platform's anchors"
_SCALE: Final = "weigh some meters of the cable, measure a distance between anchors, or measure the drum"
_FORCE: Final = "weigh the platform, or check a load cell with a known weight"


class Generator(NamedTuple):
    """A change of the parameters that changes no reading, if all parameters are unknowns.

    Attributes:
        name: Name of the quantity.
        step: Measurement that fixes the quantity.
        change: Change of every row of `kernels.calibration.kinds`, (KIND_ROWS, m); relative where the logarithm is
            estimated.
        lengths: Relative change of the lengths off the drums.
    """

    name: str
    step: str
    change: Array
    lengths: float = 0.0


class Symmetries(NamedTuple):
    """The g symmetries of a robot, including changes of the zeros and radii of its drums.

    Attributes:
        each: Symmetries with a name; the columns of the drums follow after these.
        table: Change of every row of `kinds`, (KIND_ROWS, m, g).
        lengths: Lengths that the drums pay out minus required lengths, (2 m, g); a combination must make them zero.
        matters: True for parameters that a symmetry must not change if they are known, (KIND_ROWS, m).
    """

    each: tuple[Generator, ...]
    table: Array
    lengths: Array
    matters: Flags


def symmetries(robot: Robot, sensors: Sensors, turn: Array, *, counted: bool) -> Symmetries:
    """Symmetries of a robot and its sensors; turn: rotation vector of the measuring system [rad], (3,)."""
    m, turning = robot.cable_count, bool(robot.freedom[:, 3:].any())
    each = [_scale(robot, sensors), _force(robot), _yaw(robot, sensors, turn)]
    each += [_turned(robot, sensors, axis) for axis in range(3)]
    if turning:
        each += [_platform_shift(robot, axis) for axis in range(3)]
    else:
        each += [_cable_shift(robot, cable, axis) for cable in range(m) for axis in range(3)]
    each += [_world_shift(robot, axis) for axis in range(3)]
    drums = np.zeros((kinds.KIND_ROWS, m, 2 * m))
    drums[kinds.ZERO, np.arange(m), np.arange(m)] = 1.0
    drums[kinds.DRUM, np.arange(m), m + np.arange(m)] = 1.0
    table = np.concatenate((np.stack([one.change for one in each], axis=-1), drums), axis=-1)
    asked = np.concatenate(([one.lengths for one in each], np.zeros(2 * m)))
    shift, share = (np.einsum("rm,rmg->mg", term, table) for term in _length_terms(robot, counted))
    matters = np.ones((kinds.KIND_ROWS, m), dtype=np.bool_)
    matters[kinds.PER_CABLE :, 1:] = False
    # measuring system and target may change, because a few measured points do not determine them
    matters[kinds.SHIFT :] = False
    if sensors.tension_deviation is None:
        matters[[kinds.GAIN, kinds.BIAS]] = False
    if not turning:  # without rotations, the center of mass has no effect
        matters[kinds.CENTER : kinds.CENTER + 3] = False
    return Symmetries(tuple(each), table, np.concatenate((shift, share - asked)), matters)


def _length_terms(robot: Robot, counted: bool) -> tuple[Array, Array]:
    """Derivatives a + b L of the length L off each drum, by each row of `kinds`: a [m] and b, (KIND_ROWS, m)."""
    shift, share = np.zeros((2, kinds.KIND_ROWS, robot.cable_count))
    if not counted:
        shift[kinds.ZERO] = 1.0
        return shift, share
    drums = drums_of(robot)
    stretch, zero = 1.0 + drums.rest_strain, drums.winches.length_zero
    radius, diameter, pitch = drums.winches.drum_radius, robot.cables.diameter, drums.winches.groove_pitch
    if zero is None or radius is None or diameter is None or pitch is None:  # counts need these data
        raise InvalidValueError("robot", "without counts", "with drums and their zeros", "Give them in the robot file.")
    circle = (2.0 * np.pi * (radius + 0.5 * diameter)) ** 2
    by_radius = circle / (circle + pitch**2) * radius / (radius + 0.5 * diameter)  # by the log of the radius
    shift[kinds.ZERO] = 1.0 / stretch
    shift[kinds.DRUM], share[kinds.DRUM] = -by_radius * zero / stretch, by_radius
    share[kinds.STIFFNESS] = drums.rest_strain / stretch
    return shift, share


def _empty(robot: Robot) -> Array:
    return np.zeros((kinds.KIND_ROWS, robot.cable_count))


def _world_shift(robot: Robot, axis: int) -> Generator:
    change = _empty(robot)
    change[[kinds.FRAME + axis, kinds.SHIFT + axis]] = 1.0
    return Generator(f"the world shifted along {_AXES[axis]}", _WORLD, change)


def _yaw(robot: Robot, sensors: Sensors, turn: Array) -> Generator:
    change, up = _empty(robot), np.array([0.0, 0.0, 1.0])
    change[kinds.FRAME : kinds.FRAME + 3] = np.cross(up, robot.frame_anchors).T
    change[kinds.SHIFT : kinds.SHIFT + 3] = np.cross(up, sensors.frame.position)[:, None]
    change[kinds.TURN : kinds.TURN + 3] = np.linalg.solve(left_jacobian(turn), up)[:, None]
    return Generator("the world turned about the vertical", _YAW, change)


def _platform_shift(robot: Robot, axis: int) -> Generator:
    change = _empty(robot)
    change[[kinds.PLATFORM + axis, kinds.CENTER + axis, kinds.TARGET + axis]] = 1.0
    return Generator(f"the platform's frame shifted along its {_AXES[axis]}", _ORIGIN, change)


def _cable_shift(robot: Robot, cable: int, axis: int) -> Generator:
    """Shift of one cable of a platform that cannot rotate."""
    change = _empty(robot)
    change[[kinds.FRAME + axis, kinds.PLATFORM + axis], cable] = 1.0
    return Generator(f"both anchors of cable {cable} shifted along {_AXES[axis]}", _BOTH, change)


def _turned(robot: Robot, sensors: Sensors, axis: int) -> Generator:
    """Rotation of the platform frame about the center of mass."""
    change, unit = _empty(robot), np.eye(3)[axis]
    change[kinds.PLATFORM : kinds.PLATFORM + 3] = np.cross(unit, robot.platform_anchors - robot.center_of_mass).T
    change[kinds.TARGET : kinds.TARGET + 3] = np.cross(unit, sensors.target - robot.center_of_mass)[:, None]
    return Generator(f"the platform's frame turned about its {_AXES[axis]}", _TILT, change)


def _scale(robot: Robot, sensors: Sensors) -> Generator:
    """Scale of all lengths; the cables become lighter per meter, so that forces do not change."""
    change = _empty(robot)
    change[kinds.FRAME : kinds.FRAME + 3] = robot.frame_anchors.T
    change[kinds.PLATFORM : kinds.PLATFORM + 3] = robot.platform_anchors.T
    change[kinds.DENSITY] = -1.0
    if robot.winches is not None:
        change[kinds.RADIUS], change[kinds.DEAD] = robot.winches.pulley_radius, robot.winches.dead_cable
    change[kinds.CENTER : kinds.CENTER + 3] = robot.center_of_mass[:, None]
    change[kinds.SHIFT : kinds.SHIFT + 3] = sensors.frame.position[:, None]
    change[kinds.TARGET : kinds.TARGET + 3] = sensors.target[:, None]
    return Generator("the scale: a larger robot with lighter cables", _SCALE, change, lengths=1.0)


def _force(robot: Robot) -> Generator:
    """Scale of all masses and stiffnesses, with a smaller gain of the load cells."""
    change = _empty(robot)
    change[[kinds.DENSITY, kinds.STIFFNESS, kinds.MASS]] = 1.0
    change[kinds.GAIN] = -1.0 if robot.winches is None else -robot.winches.load_cell_gain
    return Generator("larger forces, and load cells with a smaller gain", _FORCE, change)
