"""Models of MuJoCo with exact sagging cables: cables at a body of a given model, or a complete model of a robot."""

from __future__ import annotations

from typing import Any, Final
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, instance, label, optional
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.files.mjcf import add_platform, add_world, checked_lengths, step_and_damping
from sagline.kernels import tables
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.mujoco.plugin import NAME, load_plugin, mujoco_module
from sagline.robot.batch import has_routing
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.statics.tables import cable_table, refuse_missing_chords

LONGEST_STEP: Final = 1e-3  # s
WINCH, SENSOR, INSTANCE, BODY = "winch", "tensions", "cables", "platform"  # names in a model
ROUTING: Final = {
    "pulley_radius": tables.PULLEY_RADIUS,
    "pulley_entry": tables.ENTRY,
    "dead_cable": tables.DEAD_CABLE,
    "dead_rise": tables.DEAD_RISE,
}


def attach(
    spec: Any,
    robot: Robot,
    *,
    body: str,
    prefix: str = "",
    unstrained_length: ArrayLike | None = None,
    damping: Damping | None = None,
) -> None:
    """Attach all cables of a robot to a body of a model for MuJoCo.

    The cables are exact elastic catenaries without mass, as in `simulate`. Each has an actuator `winch_0`, `winch_1`,
    ..., whose control is the change of the unstrained length since the start [m]; its force is the tension. With the
    dynamics "integrator", the control is the speed of the winch. The sensor `tensions` reads the tensions at the frame
    ends. The sites `frame_0` and `platform_0` are at the ends of cable 0. MuJoCo's viewer and renderer draw the
    cables with their sag.

    Args:
        spec: Specification of the model, a `mujoco.MjSpec`. It is changed. Its gravity must be that of the robot.
        robot: The robot; the frame anchors are in world axes, and the platform anchors in the axes of the body. Mass
            and inertia are those of the body.
        body: Name of the body that the cables hold.
        prefix: Prefix of all new names, for models with several robots.
        unstrained_length: Lengths off the drum at the start [m], shape (m,). None: lengths that hold the robot, with
            its own mass and center of mass, at the initial pose of the body. Another body moves to its equilibrium.
        damping: Energy losses of the cables, as for `simulate`. None: no losses.

    Raises:
        InvalidValueError: If the model has no such body, already has one of the names, has another gravity, or does
            not compile. If the robot has guides or pulleys with slanted swivel axes. If the cables cannot hold the
            robot at the initial pose.
        FileError: If mujoco is not installed, or no C compiler is found.

    Examples:
        >>> import mujoco
        >>> import sagline as sl
        >>> spec = mujoco.MjSpec()
        >>> load = spec.worldbody.add_body(name="load", pos=(0.0, 0.0, 2.0))
        >>> joint = load.add_freejoint()
        >>> box = load.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.5] * 3, mass=91.058)
        >>> sl.mujoco.attach(spec, sl.load_robot("cogiro"), body="load")
        >>> model = spec.compile()
        >>> model.nu, model.nsensordata
        (8, 8)
    """
    mujoco, robot = mujoco_module(), _supported(robot)
    instance(spec, mujoco.MjSpec, "spec")
    names = _names(robot, label(prefix, "prefix") if prefix != "" else "")
    losses = _losses(damping)
    platform = spec.body(label(body, "body"))
    if platform is None or body == "world":  # which does not move
        bodies = ", ".join(each.name for each in spec.bodies[1:] if each.name)
        raise InvalidValueError(
            "body", brief(body), f"a body of the model: {bodies or 'none has a name'}", "Correct it."
        )
    _check_gravity(spec, robot)
    load_plugin()
    pose = _initial_pose(mujoco, spec, body)
    lengths = _lengths(robot, pose, unstrained_length)
    _check_free(spec, names)
    spec.activate_plugin(NAME)
    cables = spec.add_plugin(name=names["instance"], plugin_name=NAME, active=True)
    cables.config = _config(robot, lengths, losses)
    joints = [each for each in platform.joints if each.name]
    _name_plugin(platform.plugin, names["instance"])
    for i in range(robot.cable_count):
        spec.worldbody.add_site(name=names[f"frame_{i}"], pos=robot.frame_anchors[i])
        platform.add_site(name=names[f"platform_{i}"], pos=robot.platform_anchors[i])
        # the actuator has no force on its target: the plug-in applies the forces of the cables
        kind = mujoco.mjtTrn.mjTRN_JOINT if joints else mujoco.mjtTrn.mjTRN_SITE
        target = joints[0].name if joints else names[f"platform_{i}"]
        winch = spec.add_actuator(name=names[f"winch_{i}"], trntype=kind, target=target, gear=np.zeros(6))
        _name_plugin(winch.plugin, names["instance"])
    sensor = spec.add_sensor(name=names["sensor"], type=mujoco.mjtSensor.mjSENS_PLUGIN)
    _name_plugin(sensor.plugin, names["instance"])


def model_of(
    robot: Robot,
    pose: PoseLike,
    *,
    unstrained_length: ArrayLike | None = None,
    damping: Damping | None = None,
) -> Any:
    """Model of a robot for MuJoCo: the body `platform`, and all cables with `attach`.

    The platform has the mass and inertia of the robot, and the joints of its motion pattern. The integrator is RK4, and
    the time step is at most 1 ms and at most a twentieth of the shortest period of vibration.

    Args:
        robot: The robot.
        pose: Initial pose of the platform, a single pose. If a robot has fewer cables than degrees of freedom, the
            platform turns to its equilibrium at this position.
        unstrained_length: Lengths off the drum at the start [m], shape (m,). None: the lengths that hold the robot at
            the pose.
        damping: Energy losses of the cables, as for `simulate`. None: no losses.

    Returns:
        The specification, a `mujoco.MjSpec`; `compile()` creates the model.

    Raises:
        InvalidValueError: If the robot has guides or pulleys with slanted swivel axes, or the cables cannot hold it at
            the pose.
        FileError: If mujoco is not installed, or no C compiler is found.

    Examples:
        The platform falls by 1.8 mm in the first 20 ms if the winches pay out 10 mm:

        >>> import mujoco
        >>> import sagline as sl
        >>> spec = sl.mujoco.model_of(sl.load_robot("cogiro"), (0.0, 0.0, 2.0))
        >>> model = spec.compile()
        >>> data = mujoco.MjData(model)
        >>> data.ctrl[:] = 0.01
        >>> mujoco.mj_step(model, data, nstep=20)
        >>> print(f"{1e3 * (data.qpos[2] - 2.0):.1f} mm")
        -1.8 mm
    """
    mujoco, robot = mujoco_module(), _supported(robot)
    pose = single_pose(pose)
    if unstrained_length is None:
        plan = _plan_at(robot, pose)
        pose, lengths = plan.state.pose, plan.unstrained_length
    else:
        lengths = _lengths(robot, pose, unstrained_length)
    step, _, _ = step_and_damping(robot, pose, robot.cables.axial_stiffness / lengths)
    root = Element("mujoco", model=robot.name)
    world, radius = add_world(root, robot, min(step, LONGEST_STEP), "RK4")
    add_platform(world, robot, pose, radius, 0.0)
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO  # for bodies that users add
    attach(spec, robot, body=BODY, unstrained_length=lengths, damping=damping)
    return spec


def _supported(robot: Robot) -> Robot:
    """The robot, or InvalidValueError if the plug-in does not support its winches."""
    found = without_guides(instance(robot, Robot, "robot"), "MuJoCo", "simulate")
    cable_table(found)  # refuses slanted swivel axes
    return found


def _losses(damping: Damping | None) -> Damping:
    """The damping of cables in time. None gives no damping."""
    found = optional(damping, Damping, "damping") or Damping()
    if found.modal_damping > 0.0:
        step = "Give loss_time or air_damping."
        raise InvalidValueError("damping: modal_damping", f"{found.modal_damping:g}", "0 in time", step)
    return found


def _names(robot: Robot, prefix: str) -> dict[str, str]:
    """Names of all new elements."""
    found = {"instance": f"{prefix}{INSTANCE}", "sensor": f"{prefix}{SENSOR}"}
    for i in range(robot.cable_count):
        found |= {f"{kind}_{i}": f"{prefix}{kind}_{i}" for kind in ("frame", BODY, WINCH)}
    return found


def _check_free(spec: Any, names: dict[str, str]) -> None:
    """Refuse names that elements of the model already have."""
    taken = {each.name for each in (*spec.sites, *spec.actuators, *spec.sensors, *spec.plugins)}
    if both := [name for name in names.values() if name in taken]:
        raise InvalidValueError("prefix", f"gives the name {both[0]}", "a new name", "Give another prefix.")


def _check_gravity(spec: Any, robot: Robot) -> None:
    """Refuse a model with a gravity other than that of the robot."""
    given, expected = np.asarray(spec.option.gravity), np.array([0.0, 0.0, -robot.gravity])
    if not np.array_equal(given, expected):
        step = "Set spec.option.gravity, or replace the gravity of the robot."
        allowed = f"(0, 0, {-robot.gravity:g}) m/s^2, as the robot has"
        raise InvalidValueError("spec: gravity", f"({', '.join(f'{x:g}' for x in given)}) m/s^2", allowed, step)


def _initial_pose(mujoco: Any, spec: Any, body: str) -> Pose:
    """Pose of a body at the start of the model."""
    try:
        model = spec.copy().compile()
    except ValueError as error:
        step = "Compile the specification before, and correct it."
        raise InvalidValueError("spec", str(error).splitlines()[0], "a model that compiles", step) from None
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    w, x, y, z = data.body(body).xquat
    return Pose.from_quaternion(np.array(data.body(body).xpos), (x, y, z, w))


def _lengths(robot: Robot, pose: Pose, given: ArrayLike | None) -> Array:
    """Unstrained lengths at the start, (m,)."""
    if given is None:
        return _plan_at(robot, pose).unstrained_length
    lengths = checked_lengths(robot, given)
    refuse_missing_chords(robot, pose)
    return lengths


def _plan_at(robot: Robot, pose: Pose) -> Plan:
    """Plan of the robot at a pose, which must be feasible."""
    plan = inverse(robot, pose)
    if not plan.feasible:
        item = f"{robot.name} at ({', '.join(f'{x:g}' for x in pose.position)}) m"
        step = "Give another pose, or unstrained_length."
        raise InvalidValueError(item, PoseStatus(int(plan.status)).text, "a pose that the cables can hold", step)
    return plan


def _config(robot: Robot, lengths: Array, losses: Damping) -> dict[str, str]:
    """Attributes of the plug-in, as texts from which C reads the same numbers."""
    values = {
        "frame_anchors": robot.frame_anchors,
        "platform_anchors": robot.platform_anchors,
        "linear_density": robot.cables.linear_density,
        "axial_stiffness": robot.cables.axial_stiffness,
        "unstrained_length": lengths,
        "loss_time": np.array(losses.loss_time),
        "air_damping": np.array(losses.air_damping),
    }
    if has_routing(robot):
        values |= {name: cable_table(robot)[0][:, column] for name, column in ROUTING.items()}
    return {name: " ".join(map(repr, np.ravel(value).tolist())) for name, value in values.items()}


def _name_plugin(plugin: Any, instance_name: str) -> None:
    """Let an element of a model belong to an instance of the plug-in."""
    plugin.plugin_name, plugin.name, plugin.active = NAME, instance_name, True
