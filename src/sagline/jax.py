"""Forward and inverse kinematics for JAX: functions for `jit`, `vmap` and `grad`, with exact derivatives.

The functions call the compiled kernels through the foreign function interface of XLA. The derivatives are those of
`sagline.kinematics.differentiable`; docs/howto/jax.md. A pose without a solution has NaN in all results and
derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any, Final

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from sagline.cables.model import CableModel
from sagline.core.errors import InvalidValueError
from sagline.kernels.jit import VARIABLE, backend, compiled_library
from sagline.kinematics.differentiable import CATENARY, ForwardKinematics, InverseKinematics, Kinematics, Value
from sagline.kinematics.differentiable import Forward as Forward
from sagline.kinematics.differentiable import HasPose as HasPose
from sagline.kinematics.differentiable import Inverse as Inverse
from sagline.kinematics.differentiable import NewArray as NewArray
from sagline.robot.robot import Robot

TARGET: Final = "sagline"
LETTERS: Final = {"float64": "D", "int64": "L", "int8": "B"}


def forward(
    robot: Robot,
    unstrained_length: Value,
    start: HasPose,
    wrench: Value | None = None,
    *,
    frame_anchors: Value | None = None,
    platform_anchors: Value | None = None,
    model: CableModel | str = CATENARY,
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
        [-0.291 -0.321 -0.365 -0.344 -0.378 -0.414 -0.364 -0.325]

    Source:
        docs/model.md, section 6.
    """
    kinematics = _of(ForwardKinematics, robot, model, "forward")
    lengths = _shaped(unstrained_length, "unstrained_length", (kinematics.cables,))
    given = _wrench(wrench), *_anchors(kinematics, frame_anchors, platform_anchors)
    pose, tension = _solve(kinematics, lengths, *given, jax.lax.stop_gradient(_row(start)))
    return Forward(pose[:3], pose[3:], tension)


def inverse(
    robot: Robot,
    pose: HasPose,
    wrench: Value | None = None,
    target: Value | None = None,
    *,
    frame_anchors: Value | None = None,
    platform_anchors: Value | None = None,
    model: CableModel | str = CATENARY,
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
    kinematics = _of(InverseKinematics, robot, model, "inverse")
    m = kinematics.cables
    goal = jnp.zeros(m) if target is None else _shaped(target, "target", (m,))
    given = _wrench(wrench), *_anchors(kinematics, frame_anchors, platform_anchors)
    return Inverse(*_solve(kinematics, _row(pose), *given, goal))


def _of(kind: type[Kinematics], robot: Robot, model: CableModel | str, function: str) -> Kinematics:
    """Tables of a robot. Check the settings of JAX first."""
    if not jax.config.read("jax_enable_x64"):
        step = 'Call jax.config.update("jax_enable_x64", True) at the beginning of the program.'
        raise InvalidValueError("jax_enable_x64", False, "True, because poses need double precision", step)
    register()
    return kind(robot, model, f"sagline.jax.{function}", jnp, ffi_call)


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _solve(kinematics: Kinematics, *inputs: Value) -> tuple[Value, Value]:
    """First result and tensions of one sample."""
    first, tension, _ = kinematics.solve(*(each[None] for each in inputs))
    return first[0], tension[0]


def _jvp(kinematics: Kinematics, primals: Any, tangents: Any) -> tuple[Any, Any]:
    """Results of `_solve` and their changes."""
    inputs = tuple(each[None] for each in primals)
    first, tension, results = kinematics.solve(*inputs)
    changes = [None if isinstance(each, SymbolicZero) else each[None] for each in tangents]
    slopes = kinematics.derivative(inputs, first, results).push(changes)
    return (first[0], tension[0]), (slopes[0][0], slopes[1][0])


_solve.defjvp(_jvp, symbolic_zeros=True)


def _shaped(value: Value, name: str, shape: tuple[int, ...]) -> Value:
    """Array of doubles, of the given shape."""
    array = jnp.asarray(value, dtype=jnp.float64)
    if array.shape != shape:
        step = "Give one sample; use jax.vmap for a batch."
        raise InvalidValueError(name, f"of shape {array.shape}", f"shape {shape}", step)
    return array


def _row(pose: HasPose) -> Value:
    """Position and unit quaternion, (7,)."""
    turn = _shaped(pose.quaternion, "quaternion", (4,))
    return jnp.concatenate((_shaped(pose.position, "position", (3,)), turn / jnp.linalg.norm(turn)))


def _wrench(wrench: Value | None) -> Value:
    return jnp.zeros(6) if wrench is None else _shaped(wrench, "wrench", (6,))


def _anchors(kinematics: Kinematics, frame: Value | None, platform: Value | None) -> tuple[Value, Value]:
    """Frame anchors and platform anchors, (m, 3) each."""
    (of_frame, of_platform), m = kinematics.anchors, kinematics.cables
    return (
        jnp.asarray(of_frame) if frame is None else _shaped(frame, "frame_anchors", (m, 3)),
        jnp.asarray(of_platform) if platform is None else _shaped(platform, "platform_anchors", (m, 3)),
    )


@cache
def register() -> None:
    """Make the compiled kernels known to JAX. Refuse other back ends."""
    if backend() != "c":
        step = "Build the library of compiled kernels with `make env`, or install a wheel."
        raise InvalidValueError(VARIABLE, backend(), "c for sagline.jax", step)
    jax.ffi.register_ffi_target(TARGET, jax.ffi.pycapsule(compiled_library().xla), platform="cpu")


def ffi_call(entry: Callable[..., object], *arguments: Any) -> list[Any]:
    """Outputs of a kernel. Its arguments are numbers, None, arrays, and new arrays for work and output, in tuples."""
    operands: list[Any] = []
    results: list[Any] = []
    numbers: list[float] = []
    sizes: list[int] = []
    plan: list[str] = []

    def form(value: Any) -> str:
        """Format of an argument, as the library declares it."""
        if isinstance(value, tuple) and not isinstance(value, NewArray):
            return f"({''.join(map(form, value))})"
        if value is None:
            return "N"
        if isinstance(value, bool | int | float):
            numbers.append(float(value))
            return "?" if isinstance(value, bool) else "i" if isinstance(value, int) else "f"
        if not isinstance(value, NewArray):
            operands.append(value)
            plan.append("a")
        elif value.is_result:
            results.append(jax.ShapeDtypeStruct(value.shape, value.dtype))
            plan.append("r")
        else:
            sizes.extend(value.shape)
            plan.append("s")
        return f"{LETTERS[np.dtype(value.dtype).name]}{len(value.shape)}"

    text = form(arguments)
    call = jax.ffi.ffi_call(TARGET, results, vmap_method="expand_dims")
    found: list[Any] = call(
        *operands,
        entry=entry.__name__,
        format=text,
        plan="".join(plan),
        sizes=np.array(sizes, dtype=np.int64),
        numbers=np.array(numbers, dtype=np.float64),
    )
    return found
