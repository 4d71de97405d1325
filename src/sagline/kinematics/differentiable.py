"""Forward and inverse kinematics with exact derivatives, for hosts that differentiate programs: JAX and PyTorch.

The derivatives are those of the implicit function theorem, for the active limits. The first axis of all arrays is that
of the samples. A host supplies the namespace of its arrays and the function that calls a kernel with them; NumPy is the
default of both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from types import ModuleType
from typing import Any, ClassVar, Final, NamedTuple, Protocol, TypeAlias

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import instance
from sagline.core.arrays import Array, blocks
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes, forward_poses, inverse_poses, tables
from sagline.kernels.cable import swivel
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.forward import distribution, sensitivity
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.status import STABLE
from sagline.robot.batch import has_routing, refuse_slanted
from sagline.robot.equilibrium import result_rows
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import LIMITS_OF, check_sharing
from sagline.tension.methods import DEFAULT

Value: TypeAlias = Any  # an array of the host or of NumPy
CATENARY: Final = Catenary()
BLOCK: Final = 1 << 8  # samples per block, whose derivatives take 2.5 MB


class HasPose(Protocol):
    """A pose, or a result with position and quaternion."""

    @property
    def position(self) -> Value:
        """Position of the platform origin [m], shape (..., 3)."""

    @property
    def quaternion(self) -> Value:
        """Rotation platform -> world, scalar last, shape (..., 4)."""


class Forward(NamedTuple):
    """Result of `forward`.

    Attributes:
        position: Position of the platform origin [m], shape (..., 3).
        quaternion: Rotation platform -> world, scalar last, shape (..., 4).
        tension: Tension at the frame end of each cable [N], shape (..., m).
    """

    position: Value
    quaternion: Value
    tension: Value


class Inverse(NamedTuple):
    """Result of `inverse`.

    Attributes:
        unstrained_length: Length L off the drum [m], shape (..., m).
        tension: Tension at the frame end of each cable [N], shape (..., m).
    """

    unstrained_length: Value
    tension: Value


class NewArray(NamedTuple):
    """Array that is allocated for a call of a kernel: a result, which the call returns, or a work array."""

    shape: tuple[int, ...]
    dtype: Any = np.float64
    is_result: bool = True


def _call_kernel(entry: Callable[..., object], *arguments: Any) -> list[Any]:
    """Outputs of a kernel. Its arguments are numbers, None, arrays, and new arrays for work and output, in tuples."""
    outputs = []

    def real(value: Any) -> Any:
        if isinstance(value, NewArray):
            array = np.empty(value.shape, value.dtype)
            if value.is_result:
                outputs.append(array)
            return array
        if isinstance(value, tuple):
            return tuple(map(real, value))
        return np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value

    entry(*map(real, arguments))
    return outputs


class Derivative(NamedTuple):
    """Linear map from changes of the inputs of N samples to changes of the two results."""

    first: Value  # derivative of the first result by an inner vector, (N, a, k)
    tension: Value  # derivative of the tensions by the inner vector, (N, m, k)
    inner: tuple[Value | None, ...]  # derivative of the inner vector by each input, (N, k, size); None: no effect
    direct: tuple[Value | None, ...]  # further effect on the tensions: of the own row (N, m, c), or of the whole input

    def push(self, changes: Sequence[Value | None]) -> tuple[Value, Value]:
        """Changes of the results due to changes of the inputs; None for zero."""
        vector, tension = 0.0 * self.first[:, 0, :], 0.0
        for change, inner, direct in zip(changes, self.inner, self.direct, strict=True):
            if change is None or inner is None:
                continue
            count, _, size = inner.shape
            flat = change.reshape(count, size)
            vector = vector + _times(inner, flat)
            if direct is not None:
                width = direct.shape[-1]
                tension = tension + (direct * flat.reshape(count, size // width, width)).sum(-1)
        return _times(self.first, vector), _times(self.tension, vector) + tension

    def pull(self, first: Value, tension: Value) -> Iterator[Value]:
        """Gradient by each input that has an effect, in rows (N, size), of gradients by the two results."""
        vector = _times(self.first.swapaxes(1, 2), first) + _times(self.tension.swapaxes(1, 2), tension)
        for inner, direct in zip(self.inner, self.direct, strict=True):
            if inner is None:
                continue
            found = _times(inner.swapaxes(1, 2), vector)
            if direct is not None:
                own = direct * tension[..., None]
                whole = direct.shape[-1] == inner.shape[-1]
                found = found + (own.sum(1) if whole else own.reshape(found.shape))
            yield found


class Kinematics:
    """Tables of a robot, and calls of the kernels with them."""

    slanted: ClassVar[bool]  # swivel axes of any direction

    def __init__(
        self,
        robot: Robot,
        model: CableModel | str,
        function: str,
        numpy: ModuleType = np,
        call: Callable[..., list[Any]] = _call_kernel,
    ) -> None:
        """Check the robot and the model. `function`: public name; `numpy`, `call`: those of the host."""
        own = model_of(model)
        if own.code == codes.STRAIGHT:
            step = "Use Catenary() or Elastic()."
            raise InvalidValueError("model", "Straight()", "a cable model with stiffness", step)
        name = function.rpartition(".")[2]
        self.robot = without_guides(instance(robot, Robot, "robot"), function, f"sl.{name}")
        refuse_slanted(robot, only_platform=self.slanted)
        self.numpy, self.call = numpy, call
        self.freedom, self.body, self.table = robot_terms(robot, slanted=True)
        self.cables, self.free = robot.cable_count, robot.degrees_of_freedom
        self.model = own.code, *own.parameters
        self.terms = *self.model, has_routing(robot) or None
        self.limits = LIMITS_OF[robot.tension_limits_of], float("nan")
        self.weight = 0.0 if own.weightless else robot.cables.linear_density * robot.gravity
        self.rows = result_rows(robot)
        self.memory = tuple(NewArray(work.shape, work.dtype, is_result=False) for work in memory_for(robot.cable_count))

    def solve(self, *inputs: Value) -> tuple[Value, Value, Value]:
        """First result, tensions (N, m), and results of the kernels (N, rows, m)."""
        raise NotImplementedError

    def derivative(self, inputs: Sequence[Value], first: Value, results: Value) -> Derivative:
        """Derivative at the results of `solve`."""
        raise NotImplementedError

    def block(self, inputs: Sequence[Array]) -> int:
        """Largest number of samples in one call of `solve`, for arrays of NumPy."""
        return BLOCK

    @property
    def anchors(self) -> tuple[Value, Value]:
        """Frame anchors and platform anchors of the robot, (m, 3) each."""
        return self.table[0, :, :3], self.table[0, :, 3:6]

    def robots(self, frame: Value, platform: Value) -> tuple[Value, Value, Value]:
        """Free motions, body_table and cable_table with the given anchors (N, m, 3)."""
        rest = self.table[:, :, tables.DENSITY :]
        rest = self.numpy.broadcast_to(rest, (len(frame), *rest.shape[1:]))
        return self.freedom, self.body, self.numpy.concatenate((frame, platform, rest), axis=2)

    def states(self, count: int) -> tuple[NewArray, ...]:
        """Outputs of `describe_states`."""
        m = self.cables
        shapes = (6, 6), (m, 3, 3), (swivel.DATA, m, 3), (m, 3), (m, 3), (m, 7)
        return tuple(NewArray((count, *shape)) for shape in shapes)

    def frame_end_tension(self, results: Value) -> Value:
        """Tensions at the frame ends (N, m) of `results` (rows, N, m)."""
        length = results[tables.LENGTH]
        if self.rows > tables.BARE_ROWS:
            length = length - (results[tables.WRAPPED] + results[tables.DEAD])
        return self.numpy.hypot(results[tables.HORIZONTAL], results[tables.VERTICAL] - self.weight * length)

    def matrix(self, *rows: tuple[Value, ...]) -> Value:
        """Matrices (N, a, b) of elements (N,)."""
        return self.numpy.stack([self.numpy.stack(row, axis=-1) for row in rows], axis=-2)

    def rotation(self, quaternion: Value) -> Value:
        """Rotation matrices (N, 3, 3) of unit quaternions (N, 4)."""
        x, y, z, w = quaternion.T
        return self.matrix(
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
            (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
            (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
        )

    def rates(self, quaternion: Value) -> Value:
        """Twice the derivatives (N, 4, 3) of unit quaternions by rotation vectors in world axes."""
        x, y, z, w = quaternion.T
        return self.matrix((w, z, -y), (-z, w, x), (y, -x, w), (-x, -y, -z))


class ForwardKinematics(Kinematics):
    """Pose (N, 7) and tensions as functions of lengths, wrench, frame anchors and platform anchors; start pose last."""

    slanted = True

    def solve(self, *inputs: Value) -> tuple[Value, Value, Value]:
        """Pose (N, 7), tensions (N, m), and results of the kernels (N, rows, m); NaN without a stable equilibrium."""
        lengths, wrench, frame, platform, start = inputs
        count, m, n, xp = len(lengths), self.cables, self.free, self.numpy
        given = *self.robots(frame, platform), lengths, start, wrench
        works = tuple(NewArray(shape, is_result=False) for shape in ((CABLE_ROWS, m), (n, n), (tables.LAST_COLUMNS,)))
        found = (
            NewArray((count, tables.POSE_COLUMNS)),
            NewArray((self.rows, count, m)),
            NewArray((count, m), np.int8),
            NewArray((count, tables.FORWARD_NUMBERS)),
            NewArray((count,), np.int8),
        )
        pose, results, _, _, status = self.call(forward_poses, self.terms, False, given, works, self.memory, found)
        stable = (status[:, None] == np.array(STABLE)).any(axis=1)[:, None]
        pose, results = xp.where(stable, pose, xp.nan), xp.where(stable, results, xp.nan)
        return pose, self.frame_end_tension(results), results.swapaxes(0, 1)

    def derivative(self, inputs: Sequence[Value], first: Value, results: Value) -> Derivative:
        """Derivative at the results of `solve`. The inner vector is the motion of the platform [m, rad]."""
        _, _, frame, platform, _ = inputs
        count, m, n, xp = len(first), self.cables, self.free, self.numpy
        shapes = (6, 6), (swivel.DATA, 6, m), (6, 3 * m), (6, 3 * m), (m, m), (m, max(m - n, 0))
        found = self.call(
            *(sensitivity.sensitivities_of_states, self.terms, self.robots(frame, platform), first),
            *(results.swapaxes(0, 1), self.memory, self.states(count)),
            tuple(NewArray((count, *shape)) for shape in shapes),
        )
        slopes, compliance, by_data, by_frame, by_platform = found[5:10]
        turn, rates = self.rotation(first[:, 3:]), self.rates(first[:, 3:])
        x, y, z = (turn @ self.body[0, tables.CENTER_X :]).T
        one, zero = xp.ones(count), xp.zeros(count)
        shift = self.matrix(
            (one, zero, zero, zero, -z, y), (zero, one, zero, z, zero, -x), (zero, zero, one, -y, x, zero)
        )
        spin = xp.concatenate((xp.zeros((count, 4, 3)), 0.5 * rates), axis=2)
        return Derivative(
            xp.concatenate((shift, spin), axis=1),
            slopes[..., :6],
            (by_data[:, sensitivity.BY_LENGTH], compliance, by_frame, by_platform, None),
            (slopes[..., 6:], None, -slopes[..., :3], slopes[..., :3] @ turn, None),
        )


class InverseKinematics(Kinematics):
    """Lengths and tensions as functions of pose, wrench, frame anchors, platform anchors and target tensions."""

    slanted = False

    def __init__(self, robot: Robot, *given: Any) -> None:
        """Check also the number of cables."""
        super().__init__(robot, *given)
        check_sharing(self.robot, DEFAULT)

    def block(self, inputs: Sequence[Array]) -> int:
        """One sample if the target tensions differ, because all samples of a call have those of the first one."""
        goals = inputs[-1].reshape(-1, self.cables)
        return BLOCK if (goals == goals[:1]).all() else 1

    def solve(self, *inputs: Value) -> tuple[Value, Value, Value]:
        """Lengths (N, m), tensions (N, m), and results of the kernels (N, rows, m); NaN at an infeasible pose."""
        # All samples have the target tensions of the first one.
        pose, wrench, frame, platform, goal = inputs
        count, m = len(pose), self.cables
        shared = goal[0] if count else self.numpy.zeros(m)
        method = codes.QUADRATIC_PROGRAM, 0.0, codes.CHORD_TENSION, self.numpy.ones(m), shared
        given = self.robots(frame, platform), pose, wrench
        found = (
            NewArray((self.rows, count, m)),
            NewArray((count, m), np.int8),
            NewArray((count, 2)),
            NewArray((count, self.free)),
            NewArray((count,), np.int8),
        )
        work = NewArray((m,), is_result=False), self.memory
        results, *_ = self.call(
            inverse_poses, self.model, method, self.limits, *given, *work, None, False, found, 0, count
        )
        return results[tables.LENGTH], self.frame_end_tension(results), results.swapaxes(0, 1)

    def derivative(self, inputs: Sequence[Value], first: Value, results: Value) -> Derivative:
        """Derivative at the results of `solve`. The inner vector are the lengths."""
        pose, _, frame, platform, goal = inputs
        count, m, xp = len(pose), self.cables, self.numpy
        found = self.call(
            *(distribution.sensitivities_of_lengths, self.terms, self.limits, self.robots(frame, platform), pose),
            *(results.swapaxes(0, 1), goal, self.memory, self.states(count)),
            NewArray((count, m, distribution.LENGTH_COLUMNS * m + 6)),
        )
        levers, slopes, by_inputs = found[3], found[5], found[6]
        turn, rates = self.rotation(pose[:, 3:]), 2.0 * self.rates(pose[:, 3:]).swapaxes(1, 2)
        arms = platform @ turn.swapaxes(1, 2)  # from the platform origin to the platform ends, world axes
        by_end, by_lever = (by_inputs[..., k : k + 3 * m].reshape(count, m, m, 3) for k in (0, 3 * m))
        by_spin = (_cross(xp, arms[:, None], by_end) + _cross(xp, levers[:, None], by_lever)).sum(axis=2)
        moved, force = ((by_end + by_lever) @ turn[:, None]).reshape(count, m, 3 * m), slopes[..., :3]
        by_goal, by_wrench = by_inputs[..., 6 * m : -6], by_inputs[..., -6:]
        whole = xp.eye(m)
        return Derivative(
            xp.broadcast_to(whole, (count, m, m)),
            slopes[..., 6:] * whole,
            (
                *(xp.concatenate((by_end.sum(axis=2), by_spin @ rates), axis=2), by_wrench),
                *(-by_end.reshape(count, m, 3 * m), moved, by_goal),
            ),
            (xp.concatenate((force, _cross(xp, arms, force) @ rates), axis=2), None, -force, force @ turn, None),
        )


def solve_batch(kinematics: Kinematics, inputs: Sequence[Array]) -> tuple[Array, ...]:
    """Results of `solve` for arrays of NumPy with equal leading axes."""
    return _in_blocks(kinematics.solve, inputs, kinematics.block(inputs))


def push_batch(kinematics: Kinematics, changes: Sequence[Array], solved: Sequence[Array]) -> tuple[Array, ...]:
    """Changes of the two results. `solved`: inputs, first result and results of the kernels."""
    count = len(changes)

    def push(*rows: Array) -> tuple[Array, ...]:
        return kinematics.derivative(rows[count:-2], *rows[-2:]).push(rows[:count])

    return _in_blocks(push, (*changes, *solved))


def pull_batch(kinematics: Kinematics, gradients: Sequence[Array], solved: Sequence[Array]) -> tuple[Array, ...]:
    """Gradients by the inputs that have an effect, of gradients by the two results. `solved`: as in `push_batch`."""

    def pull(*rows: Array) -> tuple[Array, ...]:
        return tuple(kinematics.derivative(rows[2:-2], *rows[-2:]).pull(*rows[:2]))

    found = _in_blocks(pull, (*gradients, *solved))
    return tuple(array.reshape(at.shape) for array, at in zip(found, solved, strict=False))


def _in_blocks(
    function: Callable[..., tuple[Array, ...]], arrays: Sequence[Array], size: int = BLOCK
) -> tuple[Array, ...]:
    """Results of a function of rows, block by block. The first array has one axis more than the leading axes."""
    shape = arrays[0].shape[:-1]
    rows = [array.reshape(-1, *array.shape[len(shape) :]) for array in arrays]
    found = [function(*(each[part] for each in rows)) for part in blocks(max(len(rows[0]), 1), size)]
    return tuple(np.concatenate(column).reshape(*shape, *column[0].shape[1:]) for column in zip(*found, strict=True))


def _times(matrices: Value, vectors: Value) -> Value:
    """Products (N, a) of matrices (N, a, b) and vectors (N, b)."""
    return (matrices @ vectors[..., None])[..., 0]


def _cross(numpy: ModuleType, one: Value, other: Value) -> Value:
    """Cross product along the last axis; shorter compiled code than that of `jax.numpy.cross`."""
    x, y, z = one[..., 0], one[..., 1], one[..., 2]
    a, b, c = other[..., 0], other[..., 1], other[..., 2]
    return numpy.stack((y * c - z * b, z * a - x * c, x * b - y * a), axis=-1)
