"""Pose from lengths and load cells together: both are noisy, each corrects the other."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.arrays import Array, checked, locked
from sagline.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kinematics.forward_rows import solve_rows
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.statics.stiffness import cable_slopes, stiffness
from sagline.statics.tables import pose_rows

_STEPS = 50
_SETTLED = 1e-9  # standard deviations of a length


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredTension:
    """Load cells at the frame ends of the cables, and how far they and the lengths are to be trusted.

    Attributes:
        frame_end_tension: Readings [N], shape (m,) or (N, m); NaN for a cable without a cell.
        tension_deviation: Standard deviation of a reading [N], > 0, a number or shape (m,).
        length_deviation: Standard deviation of an unstrained length [m], > 0, a number or shape (m,).
    """

    frame_end_tension: Array
    tension_deviation: Array
    length_deviation: Array

    def __init__(
        self, frame_end_tension: ArrayLike, tension_deviation: ArrayLike, length_deviation: ArrayLike
    ) -> None:
        """Check the three.

        Raises:
            InvalidValueError: If a reading is negative or infinite, or a deviation is not positive.
        """
        readings = np.array(frame_end_tension, dtype=np.float64)
        checked(np.where(np.isnan(readings), 0.0, readings), "frame_end_tension", "N", low=0.0)
        object.__setattr__(self, "frame_end_tension", locked(readings))
        for name, value, unit in (
            ("tension_deviation", tension_deviation, "N"),
            ("length_deviation", length_deviation, "m"),
        ):
            object.__setattr__(self, name, checked(value, name, unit, above=0.0))


def corrected(solution: ForwardSolution, measured: MeasuredTension) -> ForwardSolution:
    """The equilibrium whose lengths and frame-end tensions fit both measurements best, and the pose's covariance.

    Every sample by itself: Gauss-Newton in the lengths, L_true, that minimize
    sum ((L_true - L)/sigma_L)^2 + sum ((T_A - reading)/sigma_T)^2 while the platform stays in equilibrium.

    Args:
        solution: The equilibrium at the measured lengths, where the search begins.
        measured: The readings and the deviations.
    """
    state = solution.state
    shape = state.cables.unstrained_length.shape
    for name, value in (
        ("frame_end_tension", measured.frame_end_tension),
        ("tension_deviation", measured.tension_deviation),
        ("length_deviation", measured.length_deviation),
    ):
        _check_fits(name, value.shape, shape)
    readings = np.atleast_2d(np.broadcast_to(measured.frame_end_tension, shape))
    deviations = (
        np.broadcast_to(measured.tension_deviation, shape[-1:]),
        np.broadcast_to(measured.length_deviation, shape[-1:]),
    )
    answers = [_fitted(_sample(solution, i), readings[i], *deviations) for i in range(len(readings))]
    return _stacked(answers) if state.pose.shape else answers[0]


def _check_fits(name: str, given: tuple[int, ...], shape: tuple[int, ...]) -> None:
    try:
        fits = np.broadcast_shapes(given, shape) == shape
    except ValueError:
        fits = False
    if not fits:
        raise InvalidValueError(name, f"of shape {given}", f"a shape that broadcasts to {shape}", f"Reshape {name}.")


def _fitted(solution: ForwardSolution, readings: Array, tension_deviation: Array, length_deviation: Array) -> ForwardSolution:
    """One sample: damped Gauss-Newton from the solution at the measured lengths."""
    measured = solution.state.cables.unstrained_length
    m = len(measured)
    if not solution.stable:
        return replace(solution, covariance=locked(np.full((6, 6), np.nan)))
    weighted = ~np.isnan(readings)

    def residuals(now: ForwardSolution) -> Array:
        cables = now.state.cables
        misread = (cables.frame_end_tension - readings) / tension_deviation
        return np.concatenate(((cables.unstrained_length - measured) / length_deviation, misread[weighted]))

    converged = False
    for _ in range(_STEPS):
        by_length = stiffness(solution.state).length_sensitivity
        tensions_by_length = frame_end_slopes(solution.state, by_length) / tension_deviation[:, None]
        matrix = np.concatenate((np.eye(m) / length_deviation[:, None], tensions_by_length[weighted]))
        now = residuals(solution)
        inverse = np.linalg.inv(matrix.T @ matrix)
        step = -inverse @ (matrix.T @ now)
        converged = bool(np.all(np.abs(step) <= _SETTLED * length_deviation))
        covariance = by_length @ inverse @ by_length.T
        if converged:
            break
        moved = _moved(solution, step, float(now @ now), residuals)
        if moved is None:
            break
        solution = moved
    status = solution.status if converged else np.full((), codes.FORWARD_NOT_CONVERGED, dtype=np.int8)
    return replace(solution, status=locked(np.array(status)), covariance=locked(covariance))


def _moved(solution, step, cost, residuals):  # type: ignore[no-untyped-def]
    """The solution after a step, halved until the fit is no worse; None if no part of it helps."""
    state = solution.state
    lengths = state.cables.unstrained_length
    load = np.atleast_2d(state.wrench)
    for _ in range(20):
        tried = lengths + step
        if (tried > 0.0).all():
            found = solve_rows(state.robot, state.cables.model, locked(tried[None]), pose_rows(state.pose), locked(load))
            new = found.solution(state.robot, state.cables.model, state.wrench, ())
            misfit = residuals(new)
            if new.stable and misfit @ misfit <= cost * (1.0 + 1e-12):
                return new
        step = 0.5 * step
    return None


def frame_end_slopes(state: Equilibrium, motion_by_length: Array) -> Array:
    """d(tension at the frame end of cable i)/dL_j while the platform keeps its balance, shape (m, m) [N/m]."""
    robot, cables = state.robot, state.cables
    slopes = cable_slopes(state)
    # the platform end moves by dp + dphi x r
    ends = motion_by_length[None, :3] + np.cross(
        motion_by_length[3:].T[None], slopes.levers[:, None], axis=-1
    ).transpose(0, 2, 1)
    forces = slopes.blocks @ ends
    index = np.arange(robot.cable_count)
    forces[index, :, index] += slopes.by_length
    weight = robot.cables.linear_density * robot.gravity * (not cables.model.weightless)
    forces[index, 2, index] -= weight
    reach = state.pose.position + robot.platform_anchors @ state.pose.matrix.T - robot.frame_anchors
    with np.errstate(invalid="ignore"):  # a vertical cable pulls nowhere sideways
        level = np.where(cables.span[:, None] > 0.0, reach[:, :2] / cables.span[:, None], 0.0)
    pull = np.column_stack((level * cables.horizontal_tension[:, None], cables.vertical_force - cables.cable_weight))
    tension = np.linalg.norm(pull, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):  # a cable without force has no direction
        direction = np.where(tension[:, None] > 0.0, pull / tension[:, None], 0.0)
    slope: Array = np.einsum("ik,ikj->ij", direction, forces)
    return slope


def _sample(solution: ForwardSolution, index: int) -> ForwardSolution:
    """One sample of a batch, as a single solution."""
    state = solution.state
    if not state.pose.shape:
        return solution
    cables = state.cables
    one = replace(
        cables, **{name: locked(np.array(getattr(cables, name)[index])) for name in _CABLE_ARRAYS}
    )
    return ForwardSolution(
        Equilibrium(state.robot, state.pose[index], locked(np.array(state.wrench[index])), one),
        *(locked(np.array(getattr(solution, name)[index])) for name in _ARRAYS),
    )


def _stacked(answers: list[ForwardSolution]) -> ForwardSolution:
    """Single solutions as one batch."""
    first = answers[0].state
    cables = replace(
        first.cables,
        **{name: _stack([getattr(a.state.cables, name) for a in answers]) for name in _CABLE_ARRAYS},
    )
    pose = Pose._adopt(
        np.stack([a.pose.position for a in answers]), np.stack([a.pose.quaternion for a in answers])
    )
    wrench = _stack([a.state.wrench for a in answers])
    return ForwardSolution(
        Equilibrium(first.robot, pose, wrench, cables),
        *(_stack([getattr(a, name) for a in answers]) for name in (*_ARRAYS, "covariance")),
    )


def _stack(arrays: list[NDArray[np.generic]]) -> NDArray[np.generic]:
    return locked(np.stack(arrays))


_ARRAYS = ("status", "stiffness_min", "energy", "wrench_residual", "iterations")
_CABLE_ARRAYS = (
    "span",
    "rise",
    "unstrained_length",
    "horizontal_tension",
    "vertical_force",
    "chord_tension",
    "status",
)
