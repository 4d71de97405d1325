"""Linear model of a robot about a state, for control design: matrices A, B, C, D with names and units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.dynamics.vibration.dynamic_stiffness import Damping, single_state
from sagline.dynamics.vibration.flexibility import Flexibility
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.statics.slopes import (
    CableSlopes,
    cable_slopes,
    frame_end_forces,
    motions_of_ends,
    on_platform,
    wrenches_by_length,
)
from sagline.statics.stiffness import mass_matrix, modes

if TYPE_CHECKING:
    from scipy.signal import StateSpace

Inputs: TypeAlias = Literal["lengths", "speeds"]
_Matrices: TypeAlias = tuple[Array, Array, Array, Array]  # A, B, C, D

_TINY = 1e-300
_MOTIONS = (*(f"displacement {axis}" for axis in "xyz"), *(f"rotation {axis}" for axis in "xyz"))
_MOTION_UNITS = ("m",) * 3 + ("rad",) * 3
_WRENCHES = (*(f"force {axis}" for axis in "xyz"), *(f"moment {axis}" for axis in "xyz"))
_WRENCH_UNITS = ("N",) * 3 + ("N m",) * 3


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Linearized(Result):
    """Result of `linearized`: dx/dt = A x + B u, y = C x + D u for deviations from a state, with massless cables.

    A motion is (displacement of the center of mass, rotation vector). A wrench acts on the platform about its center of
    mass. Both are in world axes. n is the number of free motions, m the number of cables.

    Attributes:
        state: The state.
        damping: Energy losses.
        A: System matrix, shape (X, X). X = 2 n with lengths as inputs, X = 2 n + m with winch speeds as inputs.
        B: Input matrix, shape (X, m + 6).
        C: Output matrix, shape (6 + 2 m, X).
        D: Feedthrough matrix, shape (6 + 2 m, m + 6).
        state_names: Names of the X states.
        input_names: Names of the inputs: lengths of the cables off the drums, or their rates, then the wrench.
        input_units: Units of the inputs.
        output_names: Names of the outputs: motion of the platform, tensions at the frame ends, lengths off the drums.
        output_units: Units of the outputs.
    """

    state: Equilibrium
    damping: Damping
    A: Array
    B: Array
    C: Array
    D: Array
    state_names: tuple[str, ...]
    input_names: tuple[str, ...]
    input_units: tuple[str, ...]
    output_names: tuple[str, ...]
    output_units: tuple[str, ...]

    @property
    def poles(self) -> Any:
        """Eigenvalues of A [1/s], complex, shape (X,). Without damping they are +-i omega of the massless modes."""
        return locked(np.linalg.eigvals(self.A).astype(complex))

    def state_space(self) -> StateSpace:
        """The system as a SciPy object for simulation, responses and controller design.

        Returns:
            A `scipy.signal.StateSpace`.
        """
        from scipy.signal import StateSpace  # this import is slow

        return StateSpace(self.A, self.B, self.C, self.D)


@of_equilibrium
def linearized(state: Equilibrium, damping: Damping | None = None, inputs: Inputs = "lengths") -> Linearized:
    """Linear model of the robot about a state; inputs are winches and wrench, outputs are pose, tensions and lengths.

    The cables have no mass in this model, so that it is not valid above the first string frequency (see `vibration`).
    The static gains are the compliance and the sensitivities of `stiffness`. The poles are the frequencies of `modes`.

    Args:
        state: A single equilibrium; a plan or a solution with a single pose; or a robot and a pose.
            An unstable equilibrium has unstable poles.
        damping: Damping with `loss_time` (to first order) or `modal_damping`; by default no damping.
        inputs: Inputs of the winches: "lengths" (off the drums), or "speeds" (rates of these lengths, with the lengths
            as states).

    Returns:
        The system.

    Raises:
        InvalidValueError: If the state has another type, is a batch, or has no lengths. If `damping` has `air_damping`,
            which acts only on cables with mass. If it has `loss_time` and `inputs` is "lengths", because the tensions
            then depend on winch speeds.

    Examples:
        Static displacement of the platform due to 1 mm of cable 0 that is wound in:

        >>> import numpy as np
        >>> import sagline as sl
        >>> plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((1.0, 0.5, 1.5), np.eye(3)))
        >>> system = sl.linearized(plan.state, sl.Damping(modal_damping=0.01))
        >>> gain = system.D - system.C @ np.linalg.solve(system.A, system.B)
        >>> print(f"{system.output_names[2]} {1e3 * -1e-3 * gain[2, 0]:.3f} mm")
        displacement z 0.303 mm

    Source:
        docs/model.md, section 11.
    """
    damping = Damping() if damping is None else instance(damping, Damping, "damping")
    choice(inputs, "inputs", ("lengths", "speeds"))
    _check(state, damping, inputs)
    found = _driven_by_speeds(state, damping)
    n, m = len(state.one_robot.freedom), state.one_robot.cable_count
    free = [f"motion {k}" for k in range(n)]
    lengths = tuple(f"length {k}" for k in range(m))
    winches, unit = tuple(f"speed {k}" for k in range(m)), "m/s"
    states = (*free, *(f"rate of {name}" for name in free), *lengths)
    if inputs == "lengths":
        found, states, winches, unit = _driven_by_lengths(found, 2 * n), states[: 2 * n], lengths, "m"
    outputs = (*_MOTIONS, *(f"tension {k}" for k in range(m)), *lengths)
    output_units = (*_MOTION_UNITS, *("N",) * m, *("m",) * m)
    names = (states, (*winches, *_WRENCHES), (unit,) * m + _WRENCH_UNITS, outputs, output_units)
    A, B, C, D = (locked(matrix) for matrix in found)
    return Linearized(state, damping, A, B, C, D, *names)


def _check(state: Equilibrium, damping: Damping, inputs: Inputs) -> None:
    single_state(state)
    if damping.air_damping:
        value = f"{damping.air_damping:g} N s/m^2"
        raise InvalidValueError("air_damping", value, "0 for massless cables", "Use vibration, or omit air_damping.")
    if not damping.loss_time:
        return
    item, value = "loss_time", f"{damping.loss_time:g} s"
    if state.contact is not None:
        allowed, step = "0 for cables with pulleys or dead length", "Give modal_damping instead."
        raise InvalidValueError(item, value, allowed, step)
    if inputs == "lengths":
        allowed = '0 with inputs="lengths": a step of a length would cause infinite tensions'
        raise InvalidValueError(item, value, allowed, 'Use inputs="speeds", or give modal_damping.')


def _driven_by_speeds(state: Equilibrium, damping: Damping) -> _Matrices:
    """System with the free motions, their rates, and the lengths as states."""
    robot, slopes = state.one_robot, _solved_slopes(state)
    freedom, n, m = robot.freedom, len(robot.freedom), robot.cable_count
    freed = np.linalg.inv(freedom @ mass_matrix(state) @ freedom.T) @ freedom  # maps a wrench to the acceleration
    loss = _stretch_loss(state, slopes, damping.loss_time)
    by_motion, by_speed, tension_by_motion, tension_by_speed = loss
    drag = by_motion + _modal_drag(state, damping.modal_damping)
    size, outputs = 2 * n + m, 6 + 2 * m
    place, speed, length, tensions = slice(0, n), slice(n, 2 * n), slice(2 * n, None), slice(6, 6 + m)
    A, B = np.zeros((size, size)), np.zeros((size, m + 6))
    C, D = np.zeros((outputs, size)), np.zeros((outputs, m + 6))
    A[place, speed] = np.eye(n)
    A[speed, place] = -freed @ slopes.matrix @ freedom.T
    A[speed, speed] = -freed @ drag @ freedom.T
    A[speed, length] = -freed @ wrenches_by_length(state, slopes)
    B[speed, :m], B[speed, m:] = -freed @ by_speed, freed
    B[length, :m] = np.eye(m)
    C[:6, place] = freedom.T
    C[tensions, place] = slopes.tension_by_motion @ freedom.T
    C[tensions, speed] = tension_by_motion @ freedom.T
    C[tensions, length] = np.diag(slopes.tension_by_length)
    C[6 + m :, length] = np.eye(m)
    D[tensions, :m] = np.diag(tension_by_speed)
    return A, B, C, D


def _driven_by_lengths(found: _Matrices, size: int) -> _Matrices:
    """System with lengths as inputs, for tensions that do not depend on length rates."""
    A, B, C, D = found
    m = len(A) - size
    B, D = (np.concatenate(pair, axis=1) for pair in ((A[:size, size:], B[:size, m:]), (C[:, size:], D[:, m:])))
    return A[:size, :size], B, C[:, :size], D


def _solved_slopes(state: Equilibrium) -> CableSlopes:
    slopes = cable_slopes(state)
    if np.isfinite(slopes.matrix).all():
        return slopes
    step = "See the status of the plan. Straight cables have no stiffness; use another model."
    raise InvalidValueError("state", "a state without lengths or stiffness", "a state that was solved", step)


def _stretch_loss(state: Equilibrium, slopes: CableSlopes, loss_time: float) -> tuple[Array, Array, Array, Array]:
    """Stretch loss to first order: K(omega) = K + i omega eta K S K. S is the stretch part of the flexibility."""
    # matrices: damping wrench per platform velocity (6, 6) and per length rates (6, m); frame-end tension per platform
    # velocity (m, 6) and per rate of the length of the same cable (m,)
    m = state.one_robot.cable_count
    if not loss_time:
        return np.zeros((6, 6)), np.zeros((6, m)), np.zeros((m, 6)), np.zeros(m)
    follows = loss_time * slopes.blocks @ Flexibility(state, slopes.force).stretch
    per_motion = follows @ slopes.blocks  # N s/m, at the platform ends
    per_speed = (follows @ slopes.by_length[..., None])[..., 0]  # cable that is paid out has no strain
    if not np.isfinite(per_motion).all():
        step = "Use modal_damping, or tighten the cable."
        raise InvalidValueError("state", "a state with a folded cable", "cables that stretch, for loss_time", step)
    forces = np.swapaxes(per_motion @ motions_of_ends(slopes.levers), -1, -2)
    by_motion = np.stack([on_platform(forces[:, k], slopes.levers).sum(axis=-1) for k in range(6)], axis=-1)
    at_frame = frame_end_forces(state)
    direction = at_frame / np.maximum(np.linalg.norm(at_frame, axis=-1, keepdims=True), _TINY)
    return (
        by_motion,
        on_platform(per_speed, slopes.levers),
        np.einsum("ia,ika->ik", direction, forces),
        np.einsum("ia,ia->i", direction, per_speed),
    )


def _modal_drag(state: Equilibrium, ratio: float) -> Array:
    """Damping matrix (6, 6) of the platform that gives every stable massless mode the damping ratio `ratio`."""
    found, mass = modes(state), mass_matrix(state)
    momenta = mass @ found.shape
    return np.asarray(momenta * (2.0 * ratio * 2.0 * np.pi * np.nan_to_num(found.frequency)) @ momenta.T)
