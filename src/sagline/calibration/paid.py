"""The lengths that the winches say are off their drums, and how these follow zeros, drum radii and stiffness."""

from __future__ import annotations

import numpy as np

from sagline.cables.cable import Cable
from sagline.calibration.unknowns import Parameters
from sagline.core.arrays import Array
from sagline.kernels.calibration import kinds
from sagline.robot.drum import Drums, drums_of
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

STEP = 1e-4  # of a drum radius or a zero, for differences: lengths are all but linear in both, but for a slanted exit
SLOPES = 3  # by length_zero, drum_radius and axial_stiffness, in the order of `kernels.calibration.observe`


def paid_out(drums: Drums, counts: Array) -> Array:
    """Unstrained lengths off the drums at counts [m], both of shape (N, m).

    Raises:
        InvalidValueError: If the winches lack what is needed, or counts run off a drum; the message names it.
    """
    lengths: Array = drums.lengths_at(counts) / (1.0 + drums.rest_strain)
    return lengths


def can_count(robot: Robot) -> bool:
    """Whether a robot's winches know enough to tell lengths from counts."""
    winches = robot.winches
    known = winches is not None and winches.drum_radius is not None and winches.groove_pitch is not None
    return winches is not None and known and winches.counts_per_turn is not None and winches.length_zero is not None


def counts_of(drums: Drums, lengths: Array) -> Array:
    """Counts, not rounded, at unstrained lengths off the drums [m], both of shape (N, m).

    Raises:
        InvalidValueError: As of `paid_out`.
    """
    return drums.counts(lengths * (1.0 + drums.rest_strain))


def paid_slopes(robot: Robot, parameters: Parameters, counts: Array | None, lengths: Array) -> Array:
    """How lengths that the winches say follow the winches' data.

    Args:
        robot: The robot.
        parameters: What is looked for; slopes by drum_radius are zero where that is not.
        counts: What they follow from, (N, m); None where lengths are read.
        lengths: The lengths [m], (N, m).

    Returns:
        By length_zero, by drum_radius, by axial_stiffness [m/N], (3, N, m).
    """
    slopes = np.zeros((SLOPES, *lengths.shape))
    if counts is None or robot.winches is None:
        slopes[0] = 1.0
        return slopes
    drum = bool((parameters.where[kinds.DRUM] >= 0).any())
    winches, stiffness = robot.winches, robot.cables.axial_stiffness
    strain = winches.winding_tension / stiffness
    slopes[2] = lengths * strain / (stiffness * (1.0 + strain))
    if winches.drum_distance is None and (winches.layers == 1.0).all():  # every turn is as long as the others
        slopes[0] = 1.0 / (1.0 + strain)
        if drum:
            slopes[1] = _turns_let_out(winches, counts) * _turn_slope(robot, winches) / (1.0 + strain)
        return slopes
    slopes[0] = _difference(robot, winches, counts, "length_zero")
    if drum:
        slopes[1] = _difference(robot, winches, counts, "drum_radius")
    return slopes


def _turns_let_out(winches: Winch, counts: Array) -> Array:
    """Since the zero of the counts, (N, m)."""
    per_turn = _given(winches, "counts_per_turn")
    turns: Array = (counts - winches.count_zero) / (winches.gear * per_turn)
    return turns


def _turn_slope(robot: Robot, winches: Winch) -> Array:
    """How the length of a turn, a helix, follows the radius of its drum, (m,)."""
    circle = 2.0 * np.pi * (_given(winches, "drum_radius") + 0.5 * _given(robot.cables, "diameter"))
    slope: Array = 2.0 * np.pi * circle / np.hypot(circle, _given(winches, "groove_pitch"))
    return slope


def _difference(robot: Robot, winches: Winch, counts: Array, name: str) -> Array:
    value = _given(winches, name)
    step = STEP * value
    low, high = (
        paid_out(drums_of(robot.replace(winches=winches.replace(**{name: value + sign * step}))), counts)
        for sign in (-1.0, 1.0)
    )
    slope: Array = (high - low) / (2.0 * step)
    return slope


def _given(of: Winch | Cable, name: str) -> Array:
    """A field that `drums_of` has found to be there."""
    value: Array = getattr(of, name)
    return value
