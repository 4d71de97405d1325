"""Homing: the zeros of counts and lengths, from a pose held at known tensions."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.arguments import instance
from sagline.arrays import Array, checked
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels.cable.geometry import GEOMETRY_ROWS
from sagline.kernels.cable.homing import lengths_at_frame_ends
from sagline.robot.checks import per_cable
from sagline.robot.drum import warmth
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows

_CATENARY = Catenary()
MISSED: Final = 1e-9  # of a tension: a cable that misses it by more cannot have it


def home(
    robot: Robot,
    pose: Pose,
    frame_end_tension: ArrayLike,
    counts: ArrayLike = 0.0,
    model: CableModel = _CATENARY,
    *,
    temperature: ArrayLike = 0.0,
) -> Robot:
    """A robot whose winches know where they are: the zeros of counts and lengths from a pose at known tensions.

    Args:
        robot: A robot with winches.
        pose: Where the platform is held, a single pose.
        frame_end_tension: What the load cells at the frame ends read there [N], > 0, a number or shape (m,). They need
            not balance the platform exactly: each cable is taken by itself.
        counts: What the encoders read there, a number or shape (m,).
        model: Cable model; the default is exact.
        temperature: By how much the cables are warmer there than where the lengths are to hold [K].

    Returns:
        The robot with `count_zero` and `length_zero` of its winches replaced.

    Raises:
        InvalidValueError: If the robot has no winches, the pose is none or a batch, or no cable hangs there with so
            little tension; the message names the cable. If the winches have guides.

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
        step = "Give it winches first: robot.replace(winches=Winch(drum_radius=..., ...))."
        raise InvalidValueError("winches", "not given", "those of the robot", step)
    if winches.guides is not None:
        step = "Set length_zero to unstrained_length (1 + winding_tension/EA) of inverse(robot, pose) instead."
        raise InvalidValueError("winches: guides", "given", "None for home", step)
    if instance(pose, Pose, "pose").shape:
        raise InvalidValueError("pose", f"a batch of {len(pose)}", "a single pose", "Take one of them: pose[0].")
    m = robot.cable_count
    tension = per_cable(checked(frame_end_tension, "frame_end_tension", "N", above=0.0), "frame_end_tension", m)
    zero = per_cable(checked(counts, "counts", ""), "counts", m)
    length = _lengths(robot, pose, tension, instance(model, CableModel, "model"))
    strain = winches.winding_tension / robot.cables.axial_stiffness
    at_rest = length * (1.0 + strain) / warmth(robot, temperature)
    return robot.replace(winches=winches.replace(count_zero=zero, length_zero=at_rest))


def _lengths(robot: Robot, pose: Pose, tension: Array, model: CableModel) -> Array:
    """Unstrained lengths off the drums at a pose, with given tensions at the frame ends."""
    m = robot.cable_count
    held, length = np.empty(m), np.empty(m)
    table, body = cable_table(robot)[0], body_table(robot)[0]
    room = np.empty((3, 3)), np.empty((GEOMETRY_ROWS, m))
    lengths_at_frame_ends(model.terms(robot.gravity), table, body, pose_rows(pose)[0], tension, held, length, *room)
    missed = ~(np.abs(held - tension) <= MISSED * tension) | ~(length > 0.0)
    if not missed.any():
        return length
    i = int(np.argmax(missed))
    raise InvalidValueError(
        f"cable {i}: frame_end_tension",
        f"{tension[i]:g} N",
        "what a cable can have there, between its own weight and what breaks it",
        "Correct the reading, its unit, or the pose.",
    )
