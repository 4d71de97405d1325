"""MJCF, the model format of MuJoCo: straight elastic cables as spatial tendons, pulleys as cylinders."""

# The cylinders do not swivel. The platform end of a cable moves perpendicular to the chord by small distances: by u in
# the vertical plane of the cable, and by v out of this plane. If the pulley swivels, the cable becomes longer by u^2/(2
# l) + v^2 cos phi/(2 s), where l is the free length, and s is the distance of the platform end from the swivel axis. On
# a fixed cylinder, the cable becomes longer by v^2/(2 a), where a is the length from the first point to the end. The
# tendon therefore starts at the point with a = s/cos phi. This point is R tan(psi/2) before the point at which the
# tendon leaves the cylinder. Force and stiffness are then the same as with a swiveling pulley.

from __future__ import annotations

from decimal import ROUND_DOWN, Context
from xml.etree import ElementTree
from xml.etree.ElementTree import Comment, Element, SubElement

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from sagline.cables.models import Elastic
from sagline.core.arguments import instance
from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError
from sagline.kinematics.forward import dead_only
from sagline.kinematics.inverse import inverse
from sagline.kinematics.status import PoseStatus
from sagline.robot.batch import dead_cable, outward, points_on_pulleys, pulley_centers, pulleys_of
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.statics.tables import refuse_missing_chords, touching_angle

NOTE = (
    "A pulley is a cylinder in the direction of the pulley at the initial pose, and does not swivel. Forces and "
    "stiffness agree with the robot at the initial pose. At other poses, lengths are exact only in the planes of the "
    "pulleys; their error grows with the cube of the distance from the initial pose. Dead length and a part of the "
    "wrap are outside of the tendon: its stiffness includes them, and its springlength excludes them. "
    "The model has no friction on the pulleys and no drums. "
)
_OFF = 0.05  # smallest distance of a tendon's start from its cylinder, in radii; a closer tendon would not wrap
_WIDTH = 0.2  # ratio of the drawn width of a pulley to its radius
_BESIDE = 2.0  # distance of the side point from the pulley center [radii], on the side where the cable is
_LONGEST = 1e3  # largest length of a tendon before its cylinder, in pulley radii
_NOTE = (
    " Written by sagline. Every cable is a straight spring that pulls and never pushes, with the given unstrained "
    "length and axial stiffness. The model has no sag, no weight of cables and no tension limits. The damping is not "
    "that of the robot: it brings the platform to rest, and also acts on slack cables. "
)
_RADIUS = 0.002  # ratio of the radius of drawn cable ends to the size of the robot
_DRAWN = {"contype": "0", "conaffinity": "0"}  # collision settings of a geometry that makes no contacts
_THINNEST = 0.02  # ratio of the shortest to the longest edge of a displayed box
_STEPS = 20.0  # time steps per period of the fastest motion
_LONGEST_STEP = 0.002  # default time step of MuJoCo [s]
_DOWN = Context(prec=2, rounding=ROUND_DOWN)  # number of digits to which the time step is rounded down
_STRETCH_DAMPING = 4.0  # critical damping at half the frequency bound, which is about the highest frequency
_SWING_DAMPING = 0.4  # joint damping: a fifth of critical damping
_ROUNDING = 1e-12
_SHORTEST = 1e-6  # shortest cable [m]


def _lead_of(robot: Robot, pose: Pose) -> tuple[Array, Array, Array]:
    """First points of tendons and side points of pulleys, (m, 3), world axes, and missing lengths, (m,) [m]."""
    # A side point is beside a pulley, on the side of the cable. A missing length is the cable off the drum minus the
    # length of the tendon; it is negative if the tendon is longer
    radius, entry = pulleys_of(robot)
    wrap = touching_angle(robot, pose)
    if np.isnan(wrap).any():
        refuse_missing_chords(robot, pose)
    before = np.minimum(np.tan(0.5 * wrap), _LONGEST)  # from the start of the tendon to the exit point, in radii
    off = np.maximum(np.minimum(_OFF, 0.5 * before), before - wrap)
    first = np.maximum(wrap - before + off, 0.0)
    sine, cosine = np.sin(first), np.cos(first)
    along = np.concatenate((sine[:, None] * outward(robot, pose)[:, :2], (entry * cosine)[:, None]), axis=1)
    start = points_on_pulleys(robot, pose, first) - (off * radius)[:, None] * along
    centers = pulley_centers(robot, pose)
    side = centers + _BESIDE * (points_on_pulleys(robot, pose, 0.5 * (first + wrap)) - centers)
    return start, side, dead_cable(robot) + radius * (first - off)


def _add_pulleys(world: Element, robot: Robot, pose: Pose, side: Array) -> None:
    radius = pulleys_of(robot).radius
    toward, centers = outward(robot, pose), pulley_centers(robot, pose)
    for i in np.flatnonzero(radius > 0.0):
        body = _add(world, "body", name=f"pulley_{i}")
        size, axis = (radius[i], 0.5 * _WIDTH * radius[i]), (-toward[i, 1], toward[i, 0], 0.0)
        _add(body, "geom", name=f"pulley_{i}", type="cylinder", pos=centers[i], size=size, zaxis=axis, **_DRAWN)
        _add(body, "site", name=f"side_{i}", pos=side[i], rgba="0 0 0 0", size=0.01 * radius[i])


def _add(parent: Element, tag: str, **attributes: str | ArrayLike) -> Element:
    """Add an element to `parent`. Numbers in its attributes are written with all digits."""
    texts = {
        name: value if isinstance(value, str) else " ".join(map(repr, np.ravel(value).tolist()))
        for name, value in attributes.items()
    }
    return SubElement(parent, tag, texts)


def dump_mjcf(robot: Robot, pose: PoseLike, unstrained_length: ArrayLike | None = None) -> str:
    """Create a MuJoCo model of the robot as text, with the platform at a pose.

    A cable of unstrained length L becomes a spatial tendon with the stiffness EA/L. The tendon is slack if it is
    shorter than L, as in the model `Elastic`. A pulley becomes a cylinder that does not swivel. Forces, lengths and
    stiffness agree with the robot at the given pose, and comments in the file state the deviations at other poses. The
    time step is sufficient for the fastest vibration of the platform at any pose. Damping brings the platform to rest.
    The damping of a cable is proportional to its stiffness. If the cables do not resist all motions, the platform's
    joints also have damping.

    Args:
        robot: The robot.
        pose: Initial pose of the platform, a single pose.
        unstrained_length: Unstrained length L off the drum [m], >= 1e-6, shape (m,). None: lengths of straight elastic
            cables that hold the platform at rest at this pose.

    Returns:
        The XML text.

    Raises:
        InvalidValueError: If `pose` is a batch. If a length is below 1e-6 m, or not longer than the dead length. If no
            tensions within the robot's limits hold the platform at `pose`.
        CableGeometryError: If a platform end is inside its pulley.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose((1.0, 0.5, 2.0))
        >>> text = sl.dump_mjcf(robot, pose)
        >>> "<mujoco" in text
        True
    """
    instance(robot, Robot, "robot")
    pose = single_pose(pose)
    lengths = _lengths_at_rest(robot, pose) if unstrained_length is None else checked_lengths(robot, unstrained_length)
    stiffness = robot.cables.axial_stiffness / lengths
    start, side, missing = _lead_of(robot, pose)
    over_pulley = pulleys_of(robot).radius > 0.0
    time_step, stretch_time, drag = step_and_damping(robot, pose, stiffness)
    root = Element("mujoco", model=robot.name)
    root.append(Comment(_NOTE + NOTE if over_pulley.any() else _NOTE))
    # implicitfast integrates damping implicitly, so that damping does not limit the time step
    world, radius = add_world(root, robot, time_step, "implicitfast")
    for i, point in enumerate(start):
        _add(world, "site", name=f"frame_{i}", pos=point, size=radius)
    platform = add_platform(world, robot, pose, radius, drag)
    for i, point in enumerate(robot.platform_anchors):
        _add(platform, "site", name=f"platform_{i}", pos=point, size=radius)
    _add_pulleys(world, robot, pose, side)
    listed = _add(root, "tendon")
    for i, length in enumerate(lengths):
        tendon = _add(
            listed,
            "spatial",
            name=f"cable_{i}",
            stiffness=stiffness[i],
            springlength=(0.0, length - missing[i]),
            damping=stretch_time * stiffness[i],
            width=0.3 * radius,
        )
        _add(tendon, "site", site=f"frame_{i}")
        if over_pulley[i]:
            _add(tendon, "geom", geom=f"pulley_{i}", sidesite=f"side_{i}")
        _add(tendon, "site", site=f"platform_{i}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def add_world(root: Element, robot: Robot, time_step: float, integrator: str) -> tuple[Element, float]:
    """Add gravity, time step [s], view and world. Returns the world and the radius of drawn cable ends [m]."""
    _add(root, "compiler", angle="radian", inertiafromgeom="false")
    step = f"{_DOWN.create_decimal_from_float(time_step):g}"
    _add(root, "option", gravity=(0.0, 0.0, -robot.gravity), timestep=step, integrator=integrator)
    radius = _RADIUS * _add_view(root, robot)
    return _add(root, "worldbody"), radius


def step_and_damping(robot: Robot, pose: Pose, stiffness: Array) -> tuple[float, float, float]:
    """Time step [s], ratio of damping to stiffness of the cables [s], and damping of the joints [N s/m, N m s/rad]."""
    # The joint damping is zero if the cables resist every motion. At every pose, the squared angular frequency has a
    # bound: the sum over the cables of stiffness times the largest mobility of the platform end. Forces that rotate
    # with the platform can increase the frequency further; the large number of steps per period covers this.
    levers = (robot.platform_anchors - robot.center_of_mass) @ pose.matrix.T
    along, about = robot.freedom[:, :3], robot.freedom[:, 3:]
    moved = along + np.cross(about, levers[:, None])  # displacement of the end of cable i in free motion j, (m, n, 3)
    inertia = pose.matrix @ robot.inertia @ pose.matrix.T
    masses = robot.mass * along @ along.T + about @ inertia @ about.T
    mobility = np.swapaxes(moved, 1, 2) @ np.linalg.solve(masses, moved)
    fastest = float(np.sqrt(stiffness @ np.linalg.eigvalsh(mobility)[:, -1]))
    step = min(_LONGEST_STEP, 2.0 * np.pi / (_STEPS * fastest))
    # chords of straight cables from their exit points at the frame to their platform ends, (m, 3)
    exits = points_on_pulleys(robot, pose, np.nan_to_num(touching_angle(robot, pose)))
    cables = pose.transform(robot.platform_anchors) - exits
    distance = np.linalg.norm(cables, axis=1)
    directions = cables / np.where(distance > 0.0, distance, 1.0)[:, None]
    stretch = np.einsum("ik,ijk->ij", directions, moved)
    slowest = eigh((stretch.T * stiffness) @ stretch, masses, eigvals_only=True)[0]
    swing = robot.gravity / max(distance.max(), _SHORTEST)  # squared frequency of a pendulum with the longest cable
    drag = _SWING_DAMPING * robot.mass * np.sqrt(swing) if slowest < swing else 0.0
    return step, _STRETCH_DAMPING / fastest, float(drag)


def _lengths_at_rest(robot: Robot, pose: Pose) -> Array:
    plan = inverse(robot, pose, model=Elastic())
    if not plan.solved:
        place = f"{robot.name} at ({', '.join(f'{x:g}' for x in pose.position)}) m"
        allowed, step = "a pose that straight elastic cables can hold", "Give another pose, or the cables' lengths."
        raise InvalidValueError(place, PoseStatus(int(plan.status)).text, allowed, step)
    return plan.unstrained_length


def checked_lengths(robot: Robot, lengths: ArrayLike) -> Array:
    """Unstrained lengths (m,) off the drum [m], each longer than its dead length."""
    array = checked(lengths, "unstrained_length", "m", low=_SHORTEST)
    if array.shape != (robot.cable_count,):
        allowed, step = f"shape ({robot.cable_count},)", "Give one length per cable."
        raise InvalidValueError("unstrained_length", f"of shape {array.shape}", allowed, step)
    dead = dead_cable(robot)
    if ((array <= dead) & (dead > 0.0)).any():
        raise dead_only(array, dead)
    return array


def _add_view(root: Element, robot: Robot) -> float:
    """Add the center and the extent of the frame for MuJoCo's camera; returns the size of the robot [m]."""
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    size = float(np.linalg.norm(high - low)) + float(np.linalg.norm(np.ptp(robot.platform_anchors, axis=0)))
    _add(root, "statistic", center=0.5 * (low + high), extent=size)
    return size


def add_platform(world: Element, robot: Robot, pose: Pose, radius: float, drag: float) -> Element:
    """Add the platform at `pose`, with joints of the damping `drag`."""
    x, y, z, w = pose.quaternion
    body = _add(world, "body", name="platform", pos=pose.position, quat=(w, x, y, z))
    _add_joints(body, robot, pose, drag)
    inertia = _inertia(robot, pose)
    moments = [inertia[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    _add(body, "inertial", pos=robot.center_of_mass, mass=robot.mass, fullinertia=moments)
    low, high = robot.platform_anchors.min(axis=0), robot.platform_anchors.max(axis=0)
    edges = high - low if robot.platform_size is None else robot.platform_size
    half = np.maximum(0.5 * edges, max(0.5 * _THINNEST * float(edges.max()), radius))
    _add(body, "geom", type="box", pos=0.5 * (low + high), size=half, **_DRAWN)
    return body


def _inertia(robot: Robot, pose: Pose) -> Array:
    """Inertia for MuJoCo. If MuJoCo would refuse the robot's inertia: another inertia, equal in the free motions."""
    least, middle, most = np.linalg.eigvalsh(robot.inertia)
    missing = most - (least + middle) + _ROUNDING * most  # a real body has zero or less, except for rounding
    if least > 0.0 and missing <= 0.0:
        return robot.inertia
    if robot.motion_pattern == "3R3T":  # a flat plate, or an impossible inertia; MuJoCo itself reports the second case
        return robot.inertia + missing * np.eye(3) if missing < 2.0 * _ROUNDING * most else robot.inertia
    axes = robot.freedom[:, 3:] @ pose.matrix  # rotation axis of planar motion in the platform's axes
    moment = np.einsum("ij,jk,ik->", axes, robot.inertia, axes)
    return np.asarray((moment or robot.mass) * np.eye(3))


def _add_joints(body: Element, robot: Robot, pose: Pose, drag: float) -> None:
    """Add a free joint, or one slide or hinge for each free motion, with axes in the frame of the body."""
    damping = {"damping": drag} if drag > 0.0 else {}
    if robot.motion_pattern == "3R3T":
        _add(body, "joint", name="pose", type="free", **damping)
        return
    for k, row in enumerate(robot.freedom):
        kind, axis = ("slide", row[:3]) if row[:3].any() else ("hinge", row[3:])
        _add(body, "joint", name=f"freedom_{k}", type=kind, axis=axis @ pose.matrix, **damping)
