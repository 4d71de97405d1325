"""MJCF, the model format of MuJoCo: straight elastic cables as spatial tendons."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree
from xml.etree.ElementTree import Comment, Element, SubElement

import numpy as np
from numpy.typing import ArrayLike

from sagline.arguments import instance
from sagline.arrays import Array, checked
from sagline.cables.elastic import Elastic
from sagline.errors import InvalidValueError
from sagline.kinematics.inverse import inverse
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

_NOTE = (
    " Written by sagline. Every cable is a straight spring that pulls and never pushes, of the given unstrained length "
    "and axial stiffness. Its sag, its weight and the tension limits are not in this model. "
)
_RADIUS = 0.01  # of what is only drawn [m]


def dump_mjcf(robot: Robot, pose: Pose, unstrained_length: ArrayLike | None = None) -> str:
    """The text of a MuJoCo model of the robot, with the platform at a pose.

    A cable of unstrained length L is a spatial tendon of stiffness EA/L that is slack below L: the model `Elastic`.
    Nothing damps the platform; give its joints damping to let it settle.

    Args:
        robot: The robot.
        pose: A single pose, where the platform starts.
        unstrained_length: L [m], > 0, shape (m,). None takes the lengths with which straight elastic cables hold the
            platform at rest at this pose.

    Returns:
        The XML text.

    Raises:
        InvalidValueError: If the pose is a batch, a length is not positive, or no tensions within the robot's limits
            hold the platform there.
    """
    instance(robot, Robot, "robot")
    if instance(pose, Pose, "pose").shape:
        raise InvalidValueError("pose", f"a batch of {len(pose)}", "a single pose", "Write one model a pose.")
    lengths = _held(robot, pose) if unstrained_length is None else _checked(robot, unstrained_length)
    root = Element("mujoco", model=robot.name)
    root.append(Comment(_NOTE))
    SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    SubElement(root, "option", gravity=_text((0.0, 0.0, -robot.gravity)))
    world = SubElement(root, "worldbody")
    for i, point in enumerate(robot.frame_anchors):
        SubElement(world, "site", name=f"frame_{i}", pos=_text(point), size=_text((_RADIUS,)))
    _add_platform(world, robot, pose)
    tendons = SubElement(root, "tendon")
    for i, length in enumerate(lengths):
        stiffness = robot.cables.axial_stiffness[i] / length
        tendon = SubElement(tendons, "spatial", name=f"cable_{i}", stiffness=_text((stiffness,)))
        tendon.set("springlength", _text((0.0, length)))
        tendon.set("width", _text((0.3 * _RADIUS,)))
        for end in ("frame", "platform"):
            SubElement(tendon, "site", site=f"{end}_{i}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _held(robot: Robot, pose: Pose) -> Array:
    plan = inverse(robot, pose, model=Elastic())
    if not plan.feasible:
        raise InvalidValueError(
            f"{robot.name} at ({', '.join(f'{x:g}' for x in pose.position)}) m",
            PoseStatus(int(plan.status)).text,
            "a pose that straight elastic cables can hold",
            "Give another pose, or the cables' lengths.",
        )
    return plan.unstrained_length


def _checked(robot: Robot, lengths: ArrayLike) -> Array:
    array = checked(lengths, "unstrained_length", "m", above=0.0)
    if array.shape != (robot.cable_count,):
        raise InvalidValueError(
            "unstrained_length", f"of shape {array.shape}", f"shape ({robot.cable_count},)", "Give one length a cable."
        )
    return array


def _add_platform(world: Element, robot: Robot, pose: Pose) -> None:
    x, y, z, w = pose.quaternion
    body = SubElement(world, "body", name="platform", pos=_text(pose.position), quat=_text((w, x, y, z)))
    _add_joints(body, robot, pose)
    # MuJoCo wants an inertia even of a platform that cannot turn, where it has no effect
    inertia = robot.inertia if robot.inertia.any() else robot.mass * np.eye(3)
    moments = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    inertial = SubElement(body, "inertial", pos=_text(robot.center_of_mass), mass=_text((robot.mass,)))
    inertial.set("fullinertia", _text(moments))
    size = (_RADIUS,) * 3 if robot.platform_size is None else 0.5 * robot.platform_size
    SubElement(body, "geom", type="box", size=_text(size), contype="0", conaffinity="0")
    for i, point in enumerate(robot.platform_anchors):
        SubElement(body, "site", name=f"platform_{i}", pos=_text(point), size=_text((_RADIUS,)))


def _add_joints(body: Element, robot: Robot, pose: Pose) -> None:
    """A free joint, or one slide or hinge for each free motion; their axes are in the body's own frame."""
    if robot.motion_pattern == "3R3T":
        SubElement(body, "freejoint", name="pose")
        return
    to_world = pose.rotation.as_matrix()
    for k, row in enumerate(robot.freedom):
        kind, axis = ("slide", row[:3]) if row[:3].any() else ("hinge", row[3:])
        SubElement(body, "joint", name=f"freedom_{k}", type=kind, axis=_text(axis @ to_world))


def _text(values: Iterable[float]) -> str:
    """Numbers to their last bit."""
    return " ".join(repr(float(value)) for value in values)
