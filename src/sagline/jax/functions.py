"""Forward and inverse kinematics for JAX: functions for `jit`, `vmap` and `grad`, with exact derivatives.

The functions call the compiled kernels through the foreign function interface of XLA. The derivatives are those of the
implicit function theorem; docs/howto/jax.md. A pose without a solution has NaN in all results and derivatives.
"""

from __future__ import annotations

from functools import partial
from typing import Any, Final, NamedTuple, Protocol, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import instance
from sagline.core.errors import InvalidValueError
from sagline.jax.calls import Work, call_kernel, register, result_of
from sagline.kernels import codes, tables
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.forward import distribution
from sagline.kernels.forward.sensitivity import BY_LENGTH, DATA
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.status import STABLE
from sagline.robot.batch import has_routing, refuse_slanted
from sagline.robot.equilibrium import result_rows
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import LIMITS_OF, check_sharing
from sagline.tension.methods import DEFAULT

Value: TypeAlias = Any  # an array of JAX or NumPy, or a tracer
_CATENARY: Final = Catenary()


class HasPose(Protocol):
    """A pose, or a result with position and quaternion."""

    @property
    def position(self) -> Value:
        """Position of the platform origin [m], shape (3,)."""

    @property
    def quaternion(self) -> Value:
        """Rotation platform -> world, scalar last, shape (4,)."""


class Forward(NamedTuple):
    """Result of `forward`.

    Attributes:
        position: Position of the platform origin [m], shape (3,).
        quaternion: Rotation platform -> world, scalar last, shape (4,).
        tension: Tension at the frame end of each cable [N], shape (m,).
    """

    position: Value
    quaternion: Value
    tension: Value


class Inverse(NamedTuple):
    """Result of `inverse`.

    Attributes:
        unstrained_length: Length L off the drum [m], shape (m,).
        tension: Tension at the frame end of each cable [N], shape (m,).
    """

    unstrained_length: Value
    tension: Value


def forward(
    robot: Robot,
    unstrained_length: Value,
    start: HasPose,
    wrench: Value | None = None,
    *,
    frame_anchors: Value | None = None,
    platform_anchors: Value | None = None,
    model: CableModel | str = _CATENARY,
) -> Forward:
    """Equilibrium pose of the platform on cables of given lengths, as a differentiable function of JAX.

    Args:
        robot: The robot, with m cables.
        unstrained_length: L [m], > 0, shape (m,).
        start: Start of the search: a `Pose`, or the result of another call. The result does not depend on it to first
            order.
        wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for zero.
        frame_anchors: Frame anchors [m], shape (m, 3); None for those of the robot.
        platform_anchors: Platform anchors in the platform frame [m], shape (m, 3); None for those of the robot.
        model: Cable model; `Straight` is refused.

    Returns:
        Forward; NaN if no stable equilibrium is found.

    Raises:
        InvalidValueError: If JAX computes in single precision, a shape is wrong, or the robot has guides. If the
            kernels are not compiled.

    Examples:
        Change of the height due to 1 m more length of each cable:

        >>> import jax
        >>> import sagline as sl
        >>> import sagline.jax
        >>> jax.config.update("jax_enable_x64", True)
        >>> robot, pose = sl.load_robot("cogiro"), sl.Pose.from_euler((1.0, 0.5, 1.5), 0.0, 0.0, 0.0)
        >>> lengths = sl.inverse(robot, pose).unstrained_length
        >>> height = lambda lengths: sagline.jax.forward(robot, lengths, pose).position[2]
        >>> print(jax.grad(height)(lengths).round(3))
        [-0.303 -0.268 -0.259 -0.287 -0.245 -0.198 -0.25  -0.208]

    Source:
        docs/model.md, section 6.
    """
    machine = _Machine(robot, model, "forward", slanted=True)
    anchors = machine.anchors(frame_anchors, platform_anchors)
    turn = _vector(start.quaternion, 4)
    row = jax.lax.stop_gradient(jnp.concatenate((_vector(start.position, 3), turn / jnp.linalg.norm(turn))))
    lengths = _shaped(unstrained_length, "unstrained_length", (machine.cables,))
    pose, tension = _forward(machine, lengths, _wrench(wrench), *anchors, row)
    return Forward(pose[:3], pose[3:], tension)


def inverse(
    robot: Robot,
    pose: HasPose,
    wrench: Value | None = None,
    target: Value | None = None,
    *,
    frame_anchors: Value | None = None,
    platform_anchors: Value | None = None,
    model: CableModel | str = _CATENARY,
) -> Inverse:
    """Unstrained lengths and tensions at a pose at rest, as a differentiable function of JAX.

    Among the feasible chord tensions, the nearest to `target` are selected: without it, those of `sl.inverse` at a
    single pose with its default method. The derivatives have a kink where a tension reaches or leaves its limit.

    Args:
        robot: The robot, with m cables and at most m degrees of freedom, and vertical swivel axes.
        pose: A `Pose`, or any object with `position` and `quaternion`, such as the result of `forward`.
        wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for zero.
        target: Target chord tensions [N], shape (m,); None for zero, the minimum norm.
        frame_anchors: Frame anchors [m], shape (m, 3); None for those of the robot.
        platform_anchors: Platform anchors in the platform frame [m], shape (m, 3); None for those of the robot.
        model: Cable model; `Straight` is refused.

    Returns:
        Inverse; NaN if no tensions within the limits balance the platform. The derivatives are also NaN for a vertical
        cable, and for a cable that the model only just admits because of its sag.

    Raises:
        InvalidValueError: If JAX computes in single precision, a shape is wrong, the robot has guides or slanted swivel
            axes, or too few cables. If the kernels are not compiled.

    Examples:
        >>> import jax
        >>> import sagline as sl
        >>> import sagline.jax
        >>> jax.config.update("jax_enable_x64", True)
        >>> robot, pose = sl.load_robot("cogiro"), sl.Pose.from_euler((1.0, 0.5, 1.5), 0.0, 0.0, 0.0)
        >>> found = sagline.jax.inverse(robot, pose)
        >>> bool(abs(found.unstrained_length - sl.inverse(robot, pose).unstrained_length).max() < 1e-12)
        True

    Source:
        docs/model.md, sections 5 and 6.
    """
    machine = _Machine(robot, model, "inverse", slanted=False)
    check_sharing(machine.robot, DEFAULT)
    quaternion = _vector(pose.quaternion, 4)
    row = jnp.concatenate((_vector(pose.position, 3), quaternion / jnp.linalg.norm(quaternion)))
    m = machine.cables
    goal = jnp.zeros(m) if target is None else _shaped(target, "target", (m,))
    anchors = machine.anchors(frame_anchors, platform_anchors)
    return Inverse(*_inverse(machine, row, _wrench(wrench), *anchors, goal))


class _Machine:
    """Tables of a robot, and calls of the kernels with them."""

    def __init__(self, robot: Robot, model: CableModel | str, function: str, *, slanted: bool) -> None:
        """Check the robot, the model and the settings of JAX."""
        if not jax.config.read("jax_enable_x64"):
            step = 'Call jax.config.update("jax_enable_x64", True) at the beginning of the program.'
            raise InvalidValueError("jax_enable_x64", False, "True, because poses need double precision", step)
        register()
        own = model_of(model)
        if own.code == codes.STRAIGHT:
            step = "Use Catenary() or Elastic()."
            raise InvalidValueError("model", "Straight()", "a cable model with stiffness", step)
        self.robot = without_guides(instance(robot, Robot, "robot"), f"sagline.jax.{function}", f"sl.{function}")
        if not slanted:
            refuse_slanted(robot)
        self.freedom, self.body, self.table = robot_terms(robot, slanted=True)
        self.cables, self.free = robot.cable_count, robot.degrees_of_freedom
        self.model = own.code, *own.parameters
        self.terms = *self.model, has_routing(robot) or None
        self.limits = LIMITS_OF[robot.tension_limits_of], float("nan")
        self.weight = 0.0 if own.weightless else robot.cables.linear_density * robot.gravity
        self.rows = result_rows(robot)
        self.memory = tuple(Work(array.shape, array.dtype) for array in memory_for(robot.cable_count))

    def anchors(self, frame: Value | None, platform: Value | None) -> tuple[Value, Value]:
        """Frame anchors and platform anchors, (m, 3) each."""
        own, m = self.table[0], self.cables
        return (
            jnp.asarray(own[:, :3]) if frame is None else _shaped(frame, "frame_anchors", (m, 3)),
            jnp.asarray(own[:, 3:6]) if platform is None else _shaped(platform, "platform_anchors", (m, 3)),
        )

    def robots(self, frame: Value, platform: Value) -> tuple[Value, Value, Value]:
        """Free motions, body_table and cable_table with the given anchors."""
        table = jnp.concatenate((frame, platform, self.table[0, :, tables.DENSITY :]), axis=1)
        return self.freedom, self.body, table[None]

    def states(self) -> tuple[Any, ...]:
        """Results of `describe_states` for one pose."""
        m = self.cables
        shapes = (6, 6), (m, 3, 3), (DATA, m, 3), (m, 3), (m, 3), (m, 7)
        return tuple(result_of(1, *shape) for shape in shapes)

    def frame_end_tension(self, results: Value) -> Value:
        """Tensions at the frame ends (m,) of `results` (rows, 1, m)."""
        length = results[tables.LENGTH, 0]
        if self.rows > tables.BARE_ROWS:
            length = length - (results[tables.WRAPPED, 0] + results[tables.DEAD, 0])
        return jnp.hypot(results[tables.HORIZONTAL, 0], results[tables.VERTICAL, 0] - self.weight * length)


def _equilibrium(
    machine: _Machine, lengths: Value, wrench: Value, frame: Value, platform: Value, start: Value
) -> tuple[Value, Value]:
    """Pose (1, POSE_COLUMNS) and results (rows, 1, m) of the forward kinematics; NaN without a stable equilibrium."""
    m, n = machine.cables, machine.free
    given = *machine.robots(frame, platform), lengths[None], start[None], wrench[None]
    works = [Work(shape, np.float64) for shape in ((CABLE_ROWS, m), (n, n), (tables.LAST_COLUMNS,))]
    outputs = (
        *(result_of(1, tables.POSE_COLUMNS), result_of(machine.rows, 1, m), result_of(1, m, dtype=np.int8)),
        *(result_of(1, tables.FORWARD_NUMBERS), result_of(1, dtype=np.int8)),
    )
    pose, results, _, _, status = call_kernel(
        "forward_poses", machine.terms, False, given, tuple(works), machine.memory, outputs
    )
    stable = (status[0] == np.array(STABLE)).any()
    return jnp.where(stable, pose, jnp.nan), jnp.where(stable, results, jnp.nan)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _forward(machine: _Machine, *arguments: Value) -> tuple[Value, Value]:
    """Pose row and frame-end tensions; arguments of `_equilibrium`."""
    pose, results = _equilibrium(machine, *arguments)
    return pose[0], machine.frame_end_tension(results)


def _forward_jvp(machine: _Machine, primals: Any, tangents: Any) -> tuple[Any, Any]:
    """Derivative of `_forward` by the implicit function theorem."""
    m, n = machine.cables, machine.free
    _, _, frame, platform, _ = primals
    lengths, wrench, frames, platforms, _ = tangents
    pose, results = _equilibrium(machine, *primals)
    shapes = (6, 6), (DATA, 6, m), (6, 3 * m), (6, 3 * m), (m, m), (m, max(m - n, 0))
    found = call_kernel(
        *("sensitivities_of_states", machine.terms, machine.robots(frame, platform), pose, results),
        *(machine.memory, machine.states(), tuple(result_of(1, *shape) for shape in shapes)),
    )
    slopes, compliance, by_data, by_frame, by_platform = found[5][0], *(array[0] for array in found[6:10])
    turn = _matrix(pose[0, 3:])
    motion, tension = jnp.zeros(6), jnp.zeros(m)
    if not isinstance(lengths, SymbolicZero):
        motion, tension = by_data[BY_LENGTH] @ lengths, slopes[:, 6] * lengths
    if not isinstance(wrench, SymbolicZero):
        motion += compliance @ wrench
    if not isinstance(frames, SymbolicZero):
        motion += by_frame @ frames.reshape(-1)
        tension -= (slopes[:, :3] * frames).sum(axis=1)
    if not isinstance(platforms, SymbolicZero):
        motion += by_platform @ platforms.reshape(-1)
        tension += (slopes[:, :3] * (platforms @ turn.T)).sum(axis=1)
    tension += slopes[:, :6] @ motion
    shift = motion[:3] - _cross(motion[3:], turn @ machine.body[0, tables.CENTER_X :])
    vector, scalar = pose[0, 3:6], pose[0, 6]
    change = (
        0.5 * (scalar * motion[3:] + _cross(motion[3:], vector)),
        -0.5 * (motion[3:] * vector).sum(keepdims=True),
    )
    return (pose[0], machine.frame_end_tension(results)), (jnp.concatenate((shift, *change)), tension)


_forward.defjvp(_forward_jvp, symbolic_zeros=True)


def _plan(machine: _Machine, row: Value, wrench: Value, frame: Value, platform: Value, goal: Value) -> Value:
    """Results (rows, 1, m) of the inverse kinematics; NaN if the pose is infeasible."""
    m, n = machine.cables, machine.free
    method = codes.QUADRATIC_PROGRAM, 0.0, codes.CHORD_TENSION, jnp.ones(m), goal
    results, *_ = call_kernel(
        *("inverse_poses", machine.model, method, machine.limits, machine.robots(frame, platform), row[None]),
        *(wrench[None], Work((m,), np.float64), machine.memory, None, False),
        (
            *(result_of(machine.rows, 1, m), result_of(1, m, dtype=np.int8), result_of(1, 2), result_of(1, n)),
            result_of(1, dtype=np.int8),
        ),
        *(0, 1),
    )
    return results


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _inverse(machine: _Machine, *arguments: Value) -> tuple[Value, Value]:
    """Lengths and frame-end tensions; arguments of `_plan`."""
    results = _plan(machine, *arguments)
    return results[tables.LENGTH, 0], machine.frame_end_tension(results)


def _inverse_jvp(machine: _Machine, primals: Any, tangents: Any) -> tuple[Any, Any]:
    """Derivative of `_inverse` by the implicit function theorem, for the active limits."""
    m = machine.cables
    row, _, frame, platform, goal = primals
    results = _plan(machine, *primals)
    found = call_kernel(
        *("sensitivities_of_lengths", machine.terms, machine.limits, machine.robots(frame, platform), row[None]),
        *(results, goal[None], machine.memory, machine.states(), result_of(1, m, distribution.LENGTH_COLUMNS * m + 6)),
    )
    levers, slopes, by_inputs = found[3][0], found[5][0], found[6][0]
    change, wrench, frames, platforms, goals = tangents
    turn = _matrix(row[3:])
    ends, arms = jnp.zeros((m, 3)), jnp.zeros((m, 3))  # displacements of platform ends; changes of levers
    if not isinstance(change, SymbolicZero):
        vector, scalar = row[3:6], row[6]
        spin = 2.0 * (scalar * change[3:6] - change[6] * vector + _cross(vector, change[3:6]))
        ends, arms = change[:3] + _cross(spin, platform @ turn.T), _cross(spin, levers)
    if not isinstance(platforms, SymbolicZero):
        moved = platforms @ turn.T
        ends, arms = ends + moved, arms + moved
    if not isinstance(frames, SymbolicZero):
        ends = ends - frames
    lengths = by_inputs[:, : 3 * m] @ ends.reshape(-1) + by_inputs[:, 3 * m : 6 * m] @ arms.reshape(-1)
    if not isinstance(goals, SymbolicZero):
        lengths += by_inputs[:, 6 * m : distribution.LENGTH_COLUMNS * m] @ goals
    if not isinstance(wrench, SymbolicZero):
        lengths += by_inputs[:, distribution.LENGTH_COLUMNS * m :] @ wrench
    tension = (slopes[:, :3] * ends).sum(axis=1) + slopes[:, 6] * lengths
    return (results[tables.LENGTH, 0], machine.frame_end_tension(results)), (lengths, tension)


_inverse.defjvp(_inverse_jvp, symbolic_zeros=True)


def _shaped(value: Value, name: str, shape: tuple[int, ...]) -> Value:
    """Array of doubles, of the given shape."""
    array = jnp.asarray(value, dtype=jnp.float64)
    if array.shape != shape:
        step = "Give one sample; use jax.vmap for a batch."
        raise InvalidValueError(name, f"of shape {array.shape}", f"shape {shape}", step)
    return array


def _vector(value: Value, size: int) -> Value:
    return _shaped(value, "position" if size == 3 else "quaternion", (size,))


def _wrench(wrench: Value | None) -> Value:
    return jnp.zeros(6) if wrench is None else _shaped(wrench, "wrench", (6,))


def _cross(one: Value, other: Value) -> Value:
    """Cross product of vectors (3,) or (m, 3); shorter compiled code than that of `jnp.cross`."""
    x, y, z = one[..., 0], one[..., 1], one[..., 2]
    a, b, c = other[..., 0], other[..., 1], other[..., 2]
    return jnp.stack((y * c - z * b, z * a - x * c, x * b - y * a), axis=-1)


def _matrix(quaternion: Value) -> Value:
    """Rotation matrix (3, 3) of a unit quaternion (4,)."""
    x, y, z, w = quaternion
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    return jnp.stack([jnp.stack(row) for row in rows])
