"""Pulleys in a MuJoCo model: cylinders that tendons lie on. They do not swivel; at one pose nobody can tell.

A cable whose platform end moves by small u in its vertical plane, across the chord, and v out of it, lengthens by
u^2/(2 l) + v^2 cos phi/(2 s): l is its free length, s the distance of the end from the swivel axis. On a cylinder that
stands still it unrolls to a straight line, and lengthens by v^2/(2 a), a the length from where it begins to its end. So
it begins where a = s/cos phi, R tan(psi/2) before it leaves the cylinder: force and stiffness are those of a pulley
that swivels.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.several import pulleys_of
from sagline.robot.wheels import dead_cable, on_wheels, outward, wheel_centers
from sagline.statics.chords import refuse_missing_chords, touching_angle

NOTE = (
    "Its pulleys are cylinders that stand as the platform has turned them at the pose it starts from, and do not "
    "swivel: forces and stiffness are the robot's there; elsewhere lengths are right in the planes of the pulleys "
    "alone, and off by an amount that grows with the cube of the way there. What of a cable is not in its tendon (dead "
    "cable, and some of what lies on the pulley) counts in its stiffness and is taken off its springlength. Nothing "
    "rubs on the pulleys, and there are no drums. "
)
_OFF = 0.05  # of the radius: a tendon that begins nearer to its cylinder would not be laid on it
_WIDTH = 0.2  # of a pulley as it is drawn, to its radius
_BESIDE = 2.0  # radii from the middle of a pulley, on the side on which the cable lies
_LONGEST = 1e3  # radii: of a tendon before its cylinder


class Lead(NamedTuple):
    """How tendons begin.

    Attributes:
        start: Where, in the world [m], shape (m, 3).
        side: Points beside the pulleys, on the side on which the cables lie [m], shape (m, 3).
        missing: Length of cable off the drum that is not in the tendon [m], shape (m,); negative where a tendon is
            longer.
    """

    start: Array
    side: Array
    missing: Array


def lead_of(robot: Robot, pose: Pose) -> Lead:
    """How the tendons begin: at the frame anchors, or at the pulleys there.

    Args:
        robot: The robot.
        pose: Where the platform starts.

    Returns:
        Lead.

    Raises:
        CableGeometryError: If a platform end is inside its pulley.
    """
    radius, entry = pulleys_of(robot)
    wrap = touching_angle(robot, pose)
    if np.isnan(wrap).any():
        refuse_missing_chords(robot, pose)
    before = np.minimum(np.tan(0.5 * wrap), _LONGEST)  # radii from the beginning of the tendon to the exit point
    off = np.maximum(np.minimum(_OFF, 0.5 * before), before - wrap)
    first = np.maximum(wrap - before + off, 0.0)
    sine, cosine = np.sin(first), np.cos(first)
    along = np.concatenate((sine[:, None] * outward(robot, pose), (entry * cosine)[:, None]), axis=1)
    start = on_wheels(robot, pose, first) - (off * radius)[:, None] * along
    centers = wheel_centers(robot, pose)
    side = centers + _BESIDE * (on_wheels(robot, pose, 0.5 * (first + wrap)) - centers)
    return Lead(start, side, dead_cable(robot) + radius * (first - off))


def free_chords(robot: Robot, pose: Pose) -> Array:
    """Chords from where straight cables leave the frame to their platform ends [m], shape (m, 3)."""
    exits = on_wheels(robot, pose, np.nan_to_num(touching_angle(robot, pose)))
    return np.asarray(pose.transform(robot.platform_anchors) - exits)


def add_pulleys(world: Element, robot: Robot, pose: Pose, lead: Lead) -> None:
    """Add the pulleys, each a body of its own that stands still.

    Args:
        world: What they are added to.
        robot: The robot.
        pose: Where the platform starts.
        lead: How the tendons begin.
    """
    radius = pulleys_of(robot).radius
    toward, centers = outward(robot, pose), wheel_centers(robot, pose)
    for i in np.flatnonzero(radius > 0.0):
        body = SubElement(world, "body", name=f"pulley_{i}")
        wheel = SubElement(body, "geom", name=f"pulley_{i}", type="cylinder", pos=numbers_text(centers[i]))
        wheel.set("size", numbers_text((radius[i], 0.5 * _WIDTH * radius[i])))
        wheel.set("zaxis", numbers_text((-toward[i, 1], toward[i, 0], 0.0)))
        for key in ("contype", "conaffinity"):
            wheel.set(key, "0")
        site = SubElement(body, "site", name=f"side_{i}", pos=numbers_text(lead.side[i]), rgba="0 0 0 0")
        site.set("size", numbers_text((0.01 * radius[i],)))


def numbers_text(values: Iterable[float]) -> str:
    """Numbers of an attribute, to their last bit."""
    return " ".join(repr(float(value)) for value in values)
