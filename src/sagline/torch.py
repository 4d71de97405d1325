"""Forward and inverse kinematics for PyTorch: functions of tensors in batches, with exact derivatives.

The functions call the compiled kernels with the memory of the tensors. The derivatives are those of
`sagline.kinematics.differentiable`; docs/howto/torch.md. A sample without a solution has NaN in all results and
derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, Final, TypeAlias

import numpy as np
import torch

from sagline.cables.model import CableModel
from sagline.cables.models import model_of
from sagline.core.arguments import instance
from sagline.core.arrays import Array, numbers
from sagline.core.errors import InvalidValueError
from sagline.kinematics.differentiable import (
    CATENARY,
    ForwardKinematics,
    InverseKinematics,
    Kinematics,
    pull_batch,
    push_batch,
    solve_batch,
)
from sagline.kinematics.differentiable import Forward as Forward
from sagline.kinematics.differentiable import HasPose as HasPose
from sagline.kinematics.differentiable import Inverse as Inverse
from sagline.robot.robot import Robot

Value: TypeAlias = Any  # a tensor, or numbers
ROBOTS: Final = 16  # number of robots whose tables are kept


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
    """Equilibrium poses of the platform on cables of given lengths, as differentiable functions of tensors.

    The leading axes of all arguments are broadcast against each other.

    Args:
        robot: The robot, with m cables.
        unstrained_length: L [m], > 0, shape (..., m).
        start: Start of the search: a `Pose`, or the result of another call, shape (...). The result does not depend on
            it to first order.
        wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (..., 6); None for
            zero.
        frame_anchors: Frame anchors [m], shape (..., m, 3); None for those of the robot.
        platform_anchors: Platform anchors in the platform frame [m], shape (..., m, 3); None for those of the robot.
        model: Cable model; `Straight` is refused.

    Returns:
        Forward, with tensors of doubles; NaN for samples without a stable equilibrium.

    Raises:
        InvalidValueError: If a tensor is not of doubles or not in the memory of the processor, a shape is wrong, or the
            robot has guides.

    Examples:
        Change of the height due to 1 m more length of each cable:

        >>> import torch
        >>> import sagline as sl
        >>> import sagline.torch
        >>> robot, pose = sl.load_robot("cogiro"), sl.Pose.from_euler((1.0, 0.5, 1.5), 0.0, 0.0, 0.0)
        >>> lengths = torch.tensor(sl.inverse(robot, pose).unstrained_length, requires_grad=True)
        >>> sagline.torch.forward(robot, lengths, pose).position[2].backward()
        >>> print(lengths.grad.numpy().round(3))
        [-0.291 -0.321 -0.365 -0.344 -0.378 -0.414 -0.364 -0.325]

    Source:
        docs/model.md, section 6.
    """
    kinematics = _tables(ForwardKinematics, instance(robot, Robot, "robot"), model_of(model))
    lengths = _given(unstrained_length, "unstrained_length", kinematics.cables)
    rest = _inputs(kinematics, wrench, frame_anchors, platform_anchors)
    pose, tension = _solve(kinematics, lengths, *rest, _row(start).detach())
    return Forward(pose[..., :3], pose[..., 3:], tension)


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
    """Unstrained lengths and tensions at poses at rest, as differentiable functions of tensors.

    Among the feasible chord tensions, the nearest to `target` are selected: without it, those of `sl.inverse` at a
    single pose with its default method. The derivatives have a kink where a tension reaches or leaves its limit. The
    leading axes of all arguments are broadcast against each other.

    Args:
        robot: The robot, with m cables and at most m degrees of freedom, and vertical swivel axes.
        pose: A `Pose`, or any object with `position` and `quaternion`, such as the result of `forward`, shape (...).
        wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (..., 6); None for
            zero.
        target: Target chord tensions [N], shape (..., m); None for zero, the minimum norm.
        frame_anchors: Frame anchors [m], shape (..., m, 3); None for those of the robot.
        platform_anchors: Platform anchors in the platform frame [m], shape (..., m, 3); None for those of the robot.
        model: Cable model; `Straight` is refused.

    Returns:
        Inverse, with tensors of doubles; NaN for samples in which no tensions within the limits balance the platform.
        The derivatives are also NaN for a vertical cable, and for a cable that the model only just admits because of
        its sag.

    Raises:
        InvalidValueError: If a tensor is not of doubles or not in the memory of the processor, a shape is wrong, the
            robot has guides or slanted swivel axes, or too few cables.

    Examples:
        >>> import sagline as sl
        >>> import sagline.torch
        >>> robot, pose = sl.load_robot("cogiro"), sl.Pose.from_euler((1.0, 0.5, 1.5), 0.0, 0.0, 0.0)
        >>> found = sagline.torch.inverse(robot, pose)
        >>> bool(abs(found.unstrained_length.numpy() - sl.inverse(robot, pose).unstrained_length).max() < 1e-12)
        True

    Source:
        docs/model.md, sections 5 and 6.
    """
    kinematics = _tables(InverseKinematics, instance(robot, Robot, "robot"), model_of(model))
    goal = np.zeros(kinematics.cables) if target is None else target
    rest = _inputs(kinematics, wrench, frame_anchors, platform_anchors)
    return Inverse(*_solve(kinematics, _row(pose), *rest, _given(goal, "target", kinematics.cables)))


@lru_cache(maxsize=ROBOTS)
def _tables(kind: type[Kinematics], robot: Robot, model: CableModel) -> Kinematics:
    """Tables of a robot for one of the two functions."""
    return kind(robot, model, f"sagline.torch.{'forward' if kind is ForwardKinematics else 'inverse'}")


def _given(value: Value, name: str, *shape: int) -> torch.Tensor:
    """Tensor of doubles whose last axes have the given shape."""
    if not isinstance(value, torch.Tensor):
        value = torch.from_dlpack(numbers(value, name, ""))
    if value.dtype != torch.float64:
        raise InvalidValueError(name, f"of {value.dtype}", "torch.float64", f"Call {name}.double().")
    if value.device.type != "cpu":
        raise InvalidValueError(name, f"on {value.device}", "a tensor on cpu", f"Call {name}.cpu().")
    if value.shape[-len(shape) :] != shape:
        allowed = f"shape (..., {', '.join(map(str, shape))})"
        raise InvalidValueError(name, f"of shape {tuple(value.shape)}", allowed, f"Reshape {name}.")
    return value


def _row(pose: HasPose) -> torch.Tensor:
    """Positions and unit quaternions, (..., 7)."""
    turn = _given(pose.quaternion, "quaternion", 4)
    place = _given(pose.position, "position", 3)
    return torch.cat(_alike((place, turn / torch.linalg.vector_norm(turn, dim=-1, keepdim=True)), (1, 1)), dim=-1)


def _inputs(kinematics: Kinematics, wrench: Value | None, *anchors: Value | None) -> list[torch.Tensor]:
    """Wrench, frame anchors and platform anchors."""
    names, m = ("frame_anchors", "platform_anchors"), kinematics.cables
    placed = [own if given is None else given for own, given in zip(kinematics.anchors, anchors, strict=True)]
    return [
        _given(np.zeros(6) if wrench is None else wrench, "wrench", 6),
        *(_given(given, name, m, 3) for given, name in zip(placed, names, strict=True)),
    ]


def _alike(tensors: Sequence[torch.Tensor], axes: Sequence[int]) -> list[torch.Tensor]:
    """Tensors with equal leading axes; `axes`: numbers of their other axes."""
    leading = [tensor.shape[: tensor.ndim - k] for tensor, k in zip(tensors, axes, strict=True)]
    try:
        shape = torch.broadcast_shapes(*leading)
    except RuntimeError:
        found = ", ".join(sorted({str(tuple(each)) for each in leading if each}))
        step = "Give all arguments the same leading axes, or none."
        raise InvalidValueError("leading axes", found, "shapes that broadcast", step) from None
    return [tensor.expand(*shape, *tensor.shape[tensor.ndim - k :]) for tensor, k in zip(tensors, axes, strict=True)]


def _solve(kinematics: Kinematics, *inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """First result and tensions; the inputs are those of `kinematics.solve`."""
    first, tension, _ = _Solve.apply(kinematics, *_alike(inputs, (1, 1, 2, 2, 1)))
    return first, tension


def _call(function: Callable[..., tuple[Array, ...]], *given: Any) -> tuple[torch.Tensor, ...]:
    """Results of a function of arrays, as tensors; tensors and arrays have the same memory."""
    arrays = [[np.from_dlpack(each.detach()) for each in part] if isinstance(part, tuple) else part for part in given]
    return tuple(map(torch.from_dlpack, function(*arrays)))


class _Batched(torch.autograd.Function):  # type: ignore[misc]
    """Function of tables and tensors with equal leading axes."""

    @classmethod
    def vmap(cls, info: Any, in_dims: Any, kinematics: Any, *tensors: Any) -> tuple[Any, Any]:
        """Move the axis of `torch.func.vmap` to the leading axes."""
        moved = [
            tensor.expand(info.batch_size, *tensor.shape) if axis is None else tensor.movedim(axis, 0)
            for tensor, axis in zip(tensors, in_dims[1:], strict=True)
        ]
        found = cls.apply(kinematics, *moved)
        return found, (0,) * len(found)


class _Solve(_Batched):
    """First result, tensions and results of the kernels."""

    @staticmethod
    def forward(kinematics: Kinematics, *inputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return _call(solve_batch, kinematics, inputs)

    @staticmethod
    def setup_context(context: Any, inputs: Any, output: Any) -> None:
        context.kinematics, *given = inputs
        context.mark_non_differentiable(output[2])
        context.save_for_backward(*given, output[0], output[2])
        context.save_for_forward(*given, output[0], output[2])

    @staticmethod
    def backward(context: Any, *gradients: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        found = _Pull.apply(context.kinematics, *gradients[:2], *context.saved_tensors)
        return (None, *found, *(None,) * (len(context.saved_tensors) - 2 - len(found)))

    @staticmethod
    def jvp(context: Any, _: None, *changes: torch.Tensor | None) -> tuple[torch.Tensor | None, ...]:
        solved = context.saved_tensors
        full = [torch.zeros_like(at) if change is None else change for change, at in zip(changes, solved, strict=False)]
        return (*_Push.apply(context.kinematics, *full, *solved), None)


class _Linear(_Batched):
    """First derivatives of `_Solve`, which have no derivatives."""

    @staticmethod
    def setup_context(context: Any, inputs: Any, output: Any) -> None:
        pass

    @staticmethod
    def backward(context: Any, *gradients: torch.Tensor) -> Any:
        step = "Use an optimizer that needs gradients only."
        raise InvalidValueError("the order of the derivative", 2, "1, the first derivatives of sagline.torch", step)

    jvp = backward


class _Pull(_Linear):
    """Gradients by the inputs, of gradients by first result and tensions."""

    @staticmethod
    def forward(kinematics: Kinematics, *tensors: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return _call(pull_batch, kinematics, tensors[:2], tensors[2:])


class _Push(_Linear):
    """Changes of first result and tensions due to changes of the five inputs."""

    @staticmethod
    def forward(kinematics: Kinematics, *tensors: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return _call(push_batch, kinematics, tensors[:5], tensors[5:])
