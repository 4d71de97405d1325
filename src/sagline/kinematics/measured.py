"""Pose from lengths and load cells together: both are noisy, each corrects the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.kernels import codes, tables
from sagline.kinematics.forward_rows import Found, solve_rows
from sagline.robot.robot import Robot
from sagline.robot.several import Robots, robot_at
from sagline.statics.stiffness import stiffness

_STEPS = 100
_HALVINGS = 20
_SETTLED = 1e-8  # of the sum of squares: a step that promises less is within 1e-4 standard deviations of the best


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredTension(Result):
    """Load cells at the frame ends of the cables, and how far they and the lengths are to be trusted.

    Attributes:
        frame_end_tension: Readings [N], shape (m,) or (N, m); NaN for a cable without a cell.
        tension_deviation: Standard deviation of a reading [N], > 0, a number or shape (m,).
        length_deviation: Standard deviation of an unstrained length [m], > 0, a number or shape (m,).
    """

    frame_end_tension: Array
    tension_deviation: Array
    length_deviation: Array

    def __init__(self, frame_end_tension: ArrayLike, tension_deviation: ArrayLike, length_deviation: ArrayLike) -> None:
        """Check the three.

        Args:
            frame_end_tension: Readings [N], shape (m,) or (N, m); NaN for a cable without a cell.
            tension_deviation: Standard deviation of a reading [N], > 0.
            length_deviation: Standard deviation of a length [m], > 0.

        Raises:
            InvalidValueError: If a reading is negative or infinite, or a deviation is not positive.
        """
        readings = checked(frame_end_tension, "frame_end_tension", "N", low=0.0, missing=True)
        object.__setattr__(self, "frame_end_tension", readings)
        for name, value, unit in (
            ("tension_deviation", tension_deviation, "N"),
            ("length_deviation", length_deviation, "m"),
        ):
            object.__setattr__(self, name, checked(value, name, unit, above=0.0))


def corrected(robot: Robots, model: CableModel, found: Found, loads: Array, measured: MeasuredTension) -> Array:
    """Replace equilibria at measured lengths by those that fit lengths and tensions best; their poses' covariance.

    Every sample by itself: Gauss-Newton in the lengths, L_true, that minimize
    sum ((L_true - L)/sigma_L)^2 + sum ((T_A - reading)/sigma_T)^2 while the platform stays in equilibrium.

    Args:
        robot: The robot, or one a sample.
        model: Cable model with forces.
        found: Equilibria at the measured lengths (N samples), where the search begins; changed in place.
        loads: External plus inertial wrenches (1 or N, 6).
        measured: The readings and the deviations.

    Returns:
        Covariance of displacement of the center of mass and rotation vector, (N, 6, 6); NaN without an answer.

    Raises:
        InvalidValueError: If the model knows no forces, or a measurement is of the wrong shape.
    """
    if model.code == codes.STRAIGHT:
        raise InvalidValueError("model", "Straight()", "a model with forces", "Use Catenary() with measured tensions.")
    lengths = found.results[tables.LENGTH]
    readings = _fitting("frame_end_tension", measured.frame_end_tension, lengths.shape)
    deviations = (
        _fitting("tension_deviation", measured.tension_deviation, lengths.shape[1:]),
        _fitting("length_deviation", measured.length_deviation, lengths.shape[1:]),
    )
    covariance = np.full((len(lengths), 6, 6), np.nan)
    for i in range(len(lengths)):
        sample = np.array([i])
        one = robot_at(robot, i)
        fit = _Fit(one, model, lengths[i].copy(), locked(loads[i % len(loads)].copy()), readings[i], *deviations)
        answer = found.part(sample)
        if answer.stable[0]:
            answer, covariance[i] = fit.best(answer)
            found.keep(sample, answer, np.array([0]))
    return locked(covariance)


def _fitting(name: str, value: Array, shape: tuple[int, ...]) -> Array:
    try:
        return np.broadcast_to(value, shape)
    except ValueError:
        raise InvalidValueError(
            name, f"of shape {value.shape}", f"a shape that broadcasts to {shape}", f"Reshape {name}."
        ) from None


class _Fit(NamedTuple):
    """One sample to fit."""

    robot: Robot
    model: CableModel
    lengths: Array
    load: Array
    readings: Array
    tension_deviation: Array
    length_deviation: Array

    def best(self, found: Found) -> tuple[Found, Array]:
        """The best fit and the covariance of its pose, from the equilibrium at the measured lengths."""
        known = ~np.isnan(self.readings)
        covariance = np.full((6, 6), np.nan)
        for _ in range(_STEPS):
            stiff = stiffness(found.solution(self.robot, self.model, self.load, ()).state)
            by_length = stiff.length_sensitivity
            misread = stiff.tension_sensitivity / self.tension_deviation[:, None]
            matrix = np.concatenate((np.diag(1.0 / self.length_deviation), misread[known]))
            inverse = np.linalg.inv(matrix.T @ matrix)
            downhill = -matrix.T @ self.misfit(found)
            step = inverse @ downhill
            covariance = by_length @ inverse @ by_length.T
            if step @ downhill <= _SETTLED:
                return found, covariance
            moved = self.moved(found, step)
            if moved is None:
                break
            found = moved
        found.pose_status[:] = codes.FORWARD_NOT_CONVERGED
        return found, covariance

    def misfit(self, found: Found) -> Array:
        """What lengths and tensions miss of their readings, in standard deviations."""
        state = found.solution(self.robot, self.model, self.load, ()).state
        tensions = (state.cables.frame_end_tension - self.readings) / self.tension_deviation
        lengths = (state.unstrained_length - self.lengths) / self.length_deviation
        return np.concatenate((lengths, tensions[~np.isnan(tensions)]))

    def moved(self, found: Found, step: Array) -> Found | None:
        """The equilibrium after a step, halved until the fit is better; None if no part of it helps."""
        lengths = found.results[tables.LENGTH]
        now = self.misfit(found)
        for _ in range(_HALVINGS):
            if (lengths + step > 0.0).all():
                new = solve_rows(
                    self.robot, self.model, locked(lengths + step), locked(found.poses.view()), self.load[None]
                )
                misfit = self.misfit(new)
                if new.stable[0] and misfit @ misfit < now @ now:
                    return new
            step = 0.5 * step
        return None
