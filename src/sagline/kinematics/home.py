"""Homing: the zeros of counts and lengths, from a pose held at known tensions."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.arguments import instance
from sagline.arrays import Array, checked
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel, CableState
from sagline.errors import InvalidValueError
from sagline.robot.checks import per_cable
from sagline.robot.drum import warmth
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

_CATENARY = Catenary()
STEPS: Final = 100
SETTLED: Final = 1e-13  # relative change of a tension
SLOPE_STEP: Final = 1e-5


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
            little tension; the message names the cable.

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
    if instance(pose, Pose, "pose").shape:
        raise InvalidValueError("pose", f"a batch of {len(pose)}", "a single pose", "Take one of them: pose[0].")
    m = robot.cable_count
    tension = per_cable(checked(frame_end_tension, "frame_end_tension", "N", above=0.0), "frame_end_tension", m)
    zero = per_cable(checked(counts, "counts", ""), "counts", m)
    length = _hung(robot, pose, tension, instance(model, CableModel, "model")).unstrained_length
    strain = winches.winding_tension / robot.cables.axial_stiffness
    at_rest = length * (1.0 + strain) / warmth(robot, temperature)
    return robot.replace(winches=winches.replace(count_zero=zero, length_zero=at_rest))


def _hung(robot: Robot, pose: Pose, tension: Array, model: CableModel) -> CableState:
    """The cables at a pose, with given tensions at their frame ends.

    That tension is a convex function of the chord tension: from above, Newton comes down on the tighter of the two
    cables that have it, without passing it.
    """
    reach = pose.transform(robot.platform_anchors) - robot.frame_anchors
    span, rise = np.hypot(reach[:, 0], reach[:, 1]), reach[:, 2]

    def hung(chord_tension: Array) -> CableState:
        return model.from_tension(robot.cables, span, rise, chord_tension, robot.gravity)

    weight = robot.cables.linear_density * robot.gravity * np.hypot(span, rise)
    chord = tension + weight
    for _ in range(STEPS):
        low, high = (hung(chord * factor).frame_end_tension for factor in (1.0 - SLOPE_STEP, 1.0 + SLOPE_STEP))
        slope = (high - low) / (2.0 * SLOPE_STEP * chord)
        step = (hung(chord).frame_end_tension - tension) / slope
        lost = ~(slope > 0.0) | ~(step < chord)
        if lost.any():
            break
        chord = chord - step
        if (np.abs(step) <= SETTLED * chord).all():
            return hung(chord)
    missed = lost if lost.any() else np.abs(step) > 1e3 * SETTLED * chord
    if not missed.any():
        return hung(chord)
    i = int(np.argmax(missed))
    raise InvalidValueError(
        f"cable {i}: frame_end_tension",
        f"{tension[i]:g} N",
        "what a cable can have there, between its own weight and what breaks it",
        "Correct the reading, its unit, or the pose.",
    )
