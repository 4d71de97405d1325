"""Pose from measured lengths and tensions: a least-squares fit of both."""

from __future__ import annotations

import numpy as np
from attrs import field, fields, frozen

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, reduced, rule
from sagline.core.results import Result
from sagline.kernels import codes, tables
from sagline.kinematics.forward_rows import ForwardRows, solve_forward_rows
from sagline.robot.batch import Robots, robot_at
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.statics.stiffness import stiffness

_STEPS = 100
_HALVINGS = 20
# The fit ends if the predicted decrease of the sum of squares, relative to the sum, is smaller than this number. The
# optimum is then closer than 1e-4 standard deviations.
_TOLERANCE = 1e-8


@frozen(eq=False, weakref_slot=False)
class MeasuredTension(Result):
    """Load cells at the frame ends of the cables, with standard deviations of tensions and lengths.

    Attributes:
        frame_end_tension: Measured tensions [N], shape (m,) or (N, m); NaN for a cable without a load cell.
        tension_deviation: Standard deviation of a measured tension [N], > 0, a number or shape (m,).
        length_deviation: Standard deviation of an unstrained length [m], > 0, a number or shape (m,).

    Raises:
        InvalidValueError: If a measured tension is negative or infinite, or a deviation is not positive.
    """

    frame_end_tension: Array = field(converter=given, metadata=rule("N", low=0.0, missing=True))
    tension_deviation: Array = field(converter=given, metadata=rule("N", above=0.0))
    length_deviation: Array = field(converter=given, metadata=rule("m", above=0.0))

    def __attrs_post_init__(self) -> None:
        """Check the three fields."""
        for about in fields(MeasuredTension):
            object.__setattr__(self, about.name, checked(getattr(self, about.name), about.name, **about.metadata))

    __reduce__ = reduced


def fit_measurements(
    robot: Robots, model: CableModel, found: ForwardRows, loads: Array, measured: MeasuredTension
) -> Array:
    """Replace equilibria at measured lengths by best fits to lengths and tensions. Returns covariances (N, 6, 6)."""
    # For each sample, Gauss-Newton iterations find the lengths L_true with the smallest sum ((L_true - L)/sigma_L)^2 +
    # sum ((T_A - reading)/sigma_T)^2. The platform is in equilibrium at L_true. The search starts at the equilibria at
    # the measured lengths. The covariances are those of displacement of the center of mass and rotation vector, NaN
    # without a solution.
    if model.code == codes.STRAIGHT:
        step = "Use Catenary() with measured tensions."
        raise InvalidValueError("model", "Straight()", "a cable model other than Straight", step)
    lengths = found.results[tables.LENGTH]
    readings = _fitting("frame_end_tension", measured.frame_end_tension, lengths.shape)
    deviations = (
        _fitting("tension_deviation", measured.tension_deviation, lengths.shape[1:]),
        _fitting("length_deviation", measured.length_deviation, lengths.shape[1:]),
    )
    covariance = np.full((len(lengths), 6, 6), np.nan)
    for i in np.flatnonzero(found.stable):
        sample = np.array([i])
        load = locked(loads[i % len(loads)].copy())
        given = robot_at(robot, int(i)), model, lengths[i].copy(), load, readings[i], *deviations
        answer, covariance[i] = _best_fit(found.part(sample), *given)
        found.keep(sample, answer)
    return locked(covariance)


def _fitting(name: str, value: Array, shape: tuple[int, ...]) -> Array:
    try:
        return np.broadcast_to(value, shape)
    except ValueError:
        allowed = f"a shape that broadcasts to {shape}"
        raise InvalidValueError(name, f"of shape {value.shape}", allowed, f"Reshape {name}.") from None


def _best_fit(
    found: ForwardRows,
    robot: Robot,
    model: CableModel,
    measured: Array,
    load: Array,
    readings: Array,
    tension_deviation: Array,
    length_deviation: Array,
) -> tuple[ForwardRows, Array]:
    """Best fit to one sample and covariance of its pose; the search starts at the equilibrium at measured lengths."""
    known = ~np.isnan(readings)

    def misfit(state: Equilibrium) -> Array:
        """Lengths and tensions of `state` minus the measured values, in standard deviations."""
        tensions = (state.cables.frame_end_tension - readings) / tension_deviation
        return np.concatenate(((state.unstrained_length - measured) / length_deviation, tensions[known]))

    def moved(step: Array, now: Array) -> tuple[ForwardRows, Equilibrium] | None:
        """Equilibrium after `step`, which is halved until the fit improves; None if the fit does not improve."""
        lengths, starts = found.results[tables.LENGTH], locked(found.poses.view())
        for _ in range(_HALVINGS):
            if (lengths + step > 0.0).all():
                new = solve_forward_rows(robot, model, locked(lengths + step), starts, load[None])
                there = new.solution(robot, model, load, ()).state
                missed = misfit(there)
                if new.stable[0] and missed @ missed < now @ now:
                    return new, there
            step = 0.5 * step
        return None

    state, covariance = found.solution(robot, model, load, ()).state, np.full((6, 6), np.nan)
    for _ in range(_STEPS):
        stiff, missed = stiffness(state), misfit(state)
        by_length = stiff.length_sensitivity
        misread = stiff.tension_sensitivity / tension_deviation[:, None]
        matrix = np.concatenate((np.diag(1.0 / length_deviation), misread[known]))
        inverse = np.linalg.inv(matrix.T @ matrix)
        downhill = -matrix.T @ missed
        step = inverse @ downhill
        covariance = by_length @ inverse @ by_length.T
        if step @ downhill <= _TOLERANCE:
            return found, covariance
        better = moved(step, missed)
        if better is None:
            break
        found, state = better
    found.pose_status[:] = codes.FORWARD_NOT_CONVERGED
    return found, covariance
