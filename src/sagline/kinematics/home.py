"""Homing: zeros of counts and lengths, determined at a pose with known tensions."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import instance
from sagline.core.arrays import Array, Flags, checked
from sagline.core.errors import InvalidValueError
from sagline.kernels.cable.geometry import GEOMETRY_ROWS
from sagline.kernels.cable.states import lengths_at_frame_ends
from sagline.robot.checks import per_cable
from sagline.robot.drum import warmth
from sagline.robot.pose import PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch
from sagline.statics.tables import body_table, cable_table, pose_rows, refuse_missing_chords

_CATENARY = Catenary()
MISSED: Final = 1e-9  # a cable cannot have a given tension if its tension differs by more than this, relative
# largest accepted strain, more than any rope allows; a larger strain means a wrong unit
LARGEST_STRAIN: Final = 0.5
HALVINGS: Final = 50  # largest number of bisections for the smallest tension of a cable
PRECISION: Final = 1e-4  # relative precision of this smallest tension


def home(
    robot: Robot,
    pose: PoseLike,
    frame_end_tension: ArrayLike,
    counts: ArrayLike = 0.0,
    model: CableModel | str = _CATENARY,
    *,
    temperature: ArrayLike = 0.0,
) -> Robot:
    """Copy of a robot with new zeros of counts and lengths, which follow from one pose with known tensions.

    Args:
        robot: A robot with winches.
        pose: A single pose of the platform.
        frame_end_tension: Load cell values at this pose [N], a number or shape (m,). The frame-end tension is (value -
            load_cell_bias) / load_cell_gain. The tensions need not balance the platform exactly, because each cable is
            evaluated separately.
        counts: Encoder counts at this pose, a number or shape (m,).
        model: Cable model; the default is exact.
        temperature: Cable temperature at this pose minus the temperature for which the lengths are valid [K].

    Returns:
        The robot with new `count_zero` and `length_zero` of its winches.

    Raises:
        InvalidValueError: If the robot has no winches, or its winches have guides. If `pose` is a batch or has the
            wrong type. If a value exceeds load_cell_range, or a length off a drum exceeds cable_length, or if a tension
            is too small or too large for its cable at this pose. The message names the cable.
        CableGeometryError: If the ends of a cable coincide at this pose, or its platform end is inside its pulley.

    Examples:
        >>> import sagline as sl
        >>> winch = sl.Winch(drum_radius=0.06, winding_tension=200.0)
        >>> robot = sl.load_robot("cogiro").replace(winches=winch)
        >>> pose = sl.Pose.from_euler([0, 0, 2], 0, 0, 0)
        >>> held = sl.inverse(robot, pose).state.cables.frame_end_tension
        >>> zero = sl.home(robot, pose, held, counts=1000).winches
        >>> print(f"{zero.length_zero[0]:.4f} m at {zero.count_zero[0]:.0f}")
        9.7409 m at 1000

    Source:
        docs/model.md, section 10.
    """
    winches = instance(robot, Robot, "robot").winches
    if winches is None:
        step = "Add winches to the robot: robot.replace(winches=Winch(drum_radius=..., ...))."
        raise InvalidValueError("winches", "not given", "a robot with winches", step)
    if winches.guides is not None:
        step = "Set length_zero to unstrained_length * (1 + winding_tension/EA) from inverse(robot, pose)."
        raise InvalidValueError("winches: guides", "given", "None for home", step)
    pose = single_pose(pose)
    refuse_missing_chords(robot, pose)
    m = robot.cable_count
    reading = per_cable(checked(frame_end_tension, "frame_end_tension", "N"), "frame_end_tension", m)
    zero = per_cable(checked(counts, "counts", ""), "counts", m)
    tension = _tensions(robot, winches, reading)
    given, model = pose_rows(pose)[0], model_of(model)
    length, reached = _lengths(robot, given, tension, model)
    if not reached.all():
        i = int(np.argmin(reached))
        allowed = "a tension that the cable can have at this pose"
        least = _least_tension(robot, given, model, i, tension[i])
        if least is not None:
            least = least * winches.load_cell_gain[i] + winches.load_cell_bias[i]
            allowed = f">= {least:.5g} N at this pose, because of the cable's weight"
        step = "Correct the reading, its unit, or the pose."
        raise InvalidValueError(f"cable {i}: frame_end_tension", f"{reading[i]:g} N", allowed, step)
    strain = winches.winding_tension / robot.cables.axial_stiffness
    at_rest = length * (1.0 + strain) / warmth(robot, temperature)
    if winches.cable_length is not None and (wrong := at_rest > winches.cable_length).any():
        i = int(np.argmax(wrong))
        most = f"<= {winches.cable_length[i]:g} m, its cable_length"
        item, step = f"cable {i}: length off its drum at the pose", "Correct cable_length, or the pose."
        raise InvalidValueError(item, f"{at_rest[i]:.6g} m", most, step)
    return robot.replace(winches=winches.replace(count_zero=zero, length_zero=at_rest))


def _tensions(robot: Robot, winches: Winch, reading: Array) -> Array:
    """Tensions from the load cell values `reading`. Refuse impossible tensions."""
    bias, gain = winches.load_cell_bias, winches.load_cell_gain
    tension, strongest = (reading - bias) / gain, LARGEST_STRAIN * robot.cables.axial_stiffness
    cell = np.full(reading.shape, np.inf) if winches.load_cell_range is None else winches.load_cell_range
    least = [f"> {b:g} N{', its load_cell_bias' if b else ''}" for b in bias]
    holds = [f"<= {r:.6g} N, at which the cable is {LARGEST_STRAIN:.0%} longer" for r in strongest * gain + bias]
    for wrong, allowed, step in (
        (reading > cell, [f"<= {most:g} N, its load_cell_range" for most in cell], "Correct it."),
        (~(tension > 0.0), least, "A cable only pulls; correct the reading."),
        (tension > strongest, holds, "Correct the reading, its unit, or axial_stiffness."),
    ):
        if wrong.any():
            i = int(np.argmax(wrong))
            raise InvalidValueError(f"cable {i}: frame_end_tension", f"{reading[i]:g} N", allowed[i], step)
    return tension


def _lengths(robot: Robot, pose: Array, tension: Array, model: CableModel) -> tuple[Array, Flags]:
    """Unstrained lengths off the drums at the pose row `pose`, and True for each cable that can have its `tension`."""
    m = robot.cable_count
    held, length = np.empty(m), np.empty(m)
    table, body = cable_table(robot)[0], body_table(robot)[0]
    work = np.empty((3, 3)), np.empty((GEOMETRY_ROWS, m))
    lengths_at_frame_ends(model.terms(robot.gravity), table, body, pose, tension, held, length, *work)
    return length, (np.abs(held - tension) <= MISSED * tension) & (length > 0.0)


def _least_tension(robot: Robot, pose: Array, model: CableModel, cable: int, low: float) -> float | None:
    """Smallest tension >= `low` that `cable` can have at the pose row `pose`; None if no such tension exists."""
    high = LARGEST_STRAIN * float(robot.cables.axial_stiffness[cable])

    def can(tension: float) -> bool:
        return bool(_lengths(robot, pose, np.full(robot.cable_count, tension), model)[1][cable])

    if not can(high):
        return None
    for _ in range(HALVINGS):
        if high <= (1.0 + PRECISION) * low:
            break
        middle = math.sqrt(low * high)
        low, high = (low, middle) if can(middle) else (middle, high)
    return high * (1.0 + PRECISION)  # rounded up to five digits, so that the number in the message is sufficient
