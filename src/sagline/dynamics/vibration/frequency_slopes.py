"""Sensitivities of natural frequencies to lengths, cable data, mass, inertia, pose and wrench."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.dynamics.vibration.dynamic_stiffness import check_model, check_solved, single_state
from sagline.dynamics.vibration.flexibility import Flexibility, flexibility
from sagline.dynamics.vibration.mode_sensitivities import ModeGroup, StateSlopes
from sagline.dynamics.vibration.vibration import Vibration, VibrationStatus
from sagline.robot.equilibrium import Equilibrium, HasState, equilibrium_of, of_result
from sagline.statics.stiffness import modes


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencySlopes(Result):
    """Result of `frequency_slopes`: derivatives of K natural frequencies. They include the change of the equilibrium.

    For each derivative all other data are constant, for example the lengths off the drums and the wrench. If a tension
    distribution method changes the lengths, add length_sensitivity times the length changes.

    Equal frequencies have no separate derivatives, because they split when a parameter changes. Their rows contain the
    derivatives for an increasing parameter, in ascending order. For a decreasing parameter the values have the opposite
    sign. The mean of these values is the derivative of the mean of the equal frequencies.

    Attributes:
        state: The state.
        cable_mass: True if the cable mass vibrates; False for massless frequencies.
        frequency: Natural frequencies [Hz], shape (K,).
        group: Group of each frequency; equal frequencies have the same number, shape (K,).
        length_sensitivity: Derivative with respect to the length of each cable, shape (K, m) [Hz/m].
        density_sensitivity: Derivative with respect to the linear density of each cable, including its weight, shape
            (K, m) [Hz m/kg].
        stiffness_sensitivity: Derivative with respect to the axial stiffness of each cable, shape (K, m) [Hz/N].
        mass_sensitivity: Derivative with respect to the mass, including its weight, at constant inertia, shape (K,)
            [Hz/kg].
        inertia_sensitivity: Derivative with respect to the inertia, platform frame, shape (K, 3, 3) [Hz/(kg m^2)]. The
            change of a frequency is the sum of the elementwise product of this matrix and a symmetric change of the
            inertia.
        pose_sensitivity: Derivative with respect to (displacement of the center of mass, rotation vector), world axes,
            at fixed lengths; the wrench changes to keep equilibrium, shape (K, 6) [Hz/m, Hz/rad].
        wrench_sensitivity: Derivative with respect to the wrench about the center of mass, world axes, shape (K, 6)
            [Hz/N, Hz/(N m)].
    """

    state: Equilibrium
    cable_mass: bool
    frequency: Array
    group: Indices
    length_sensitivity: Array
    density_sensitivity: Array
    stiffness_sensitivity: Array
    mass_sensitivity: Array
    inertia_sensitivity: Array
    pose_sensitivity: Array
    wrench_sensitivity: Array


@of_result
def frequency_slopes(state: Equilibrium | HasState, together: float = 1e-6) -> FrequencySlopes:
    """Analytic derivatives of every natural frequency with respect to the robot's data, pose and wrench.

    Args:
        state: For the massless frequencies of `modes`: a single equilibrium; a plan of a single pose; or a robot and a
            pose. For frequencies with cable mass: a vibration. Cables are exact or weightless, without pulleys and dead
            lengths.
        together: Largest relative difference of adjacent frequencies that count as equal.

    Returns:
        FrequencySlopes; NaN where a frequency is NaN.

    Raises:
        InvalidValueError: If the state has another type, is a batch, or has no lengths. If it has shallow cables,
            pulleys or dead lengths. If the vibration was not solved.

    Examples:
        The cable whose axial stiffness has the largest effect on the first massless frequency, and the effect of the
        mass:

        >>> import numpy as np
        >>> import sagline as sl
        >>> plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((1.0, 0.5, 1.5), np.eye(3)))
        >>> slopes = sl.frequency_slopes(plan.state)
        >>> print(slopes.stiffness_sensitivity[0].argmax())
        5
        >>> print(f"{slopes.mass_sensitivity[0]:.4f} Hz/kg")
        -0.0196 Hz/kg

    Source:
        docs/model.md, section 11.
    """
    together = number(together, "together", "", low=0.0)
    if isinstance(state, Vibration):
        return _with_cable_mass(state, together)
    state = equilibrium_of(state)
    rest = _rest(state)
    found, flexible = modes(state), flexibility(state, rest.slopes.force)
    groups = list(_groups(found.frequency, together))
    squares = (float((2.0 * np.pi * found.frequency[k].mean()) ** 2) for k in groups)
    swings = (_massless(rest, flexible, found.shape[:, k], square) for k, square in zip(groups, squares, strict=True))
    return _result(state, False, found.frequency, groups, [one.square_derivatives(rest) for one in swings])


def _with_cable_mass(vibration: Vibration, together: float) -> FrequencySlopes:
    if vibration.status is not VibrationStatus.SOLVED:
        told = f"a vibration with the status {vibration.status.name}"
        raise InvalidValueError("state", told, "a vibration that was solved", "Use its state for massless frequencies.")
    rest = _rest(vibration.state)
    groups = list(_groups(vibration.frequency, together))
    slopes = [one.square_derivatives(rest) for one in rest.mode_groups(vibration.frequency, groups)]
    return _result(vibration.state, True, vibration.frequency, groups, slopes)


def _rest(state: Equilibrium) -> StateSlopes:
    check_model(single_state(state))
    if state.contact is not None:
        value, allowed = "a robot with pulleys or dead length", "cables from frame anchors"
        raise InvalidValueError("state", value, allowed, "Use the robot without winches: robot.replace(winches=None).")
    check_solved(state)
    return StateSlopes.of(state)


def _groups(frequency: Array, together: float) -> Iterator[Indices]:
    """Groups of the indices of adjacent frequencies that count as equal. `frequency` is ascending."""
    apart = ~(np.diff(frequency) <= together * frequency[1:])
    borders = [0, *(np.flatnonzero(apart) + 1).tolist(), len(frequency)]
    for first, last in pairwise(borders):
        if last > first:
            yield np.arange(first, last)


def _massless(rest: StateSlopes, flexible: Flexibility, motion: Array, square: float) -> ModeGroup:
    """Massless modes: the change of the force is constant along each cable."""
    ends = motion[:3].T + np.cross(motion[3:].T, rest.slopes.levers[:, None])
    force = ends @ np.swapaxes(rest.slopes.blocks, -1, -2)
    data = np.stack((flexible.by_length, flexible.by_density, flexible.by_stiffness))
    by_force = np.einsum("mai,mbj,mijc->mabc", force, force, flexible.by_force, optimize=True)
    by_datum = np.einsum("mai,mbj,pmij->pmab", force, force, data, optimize=True)
    return ModeGroup(motion, square, force, by_force, by_datum)


def _result(
    state: Equilibrium, cable_mass: bool, frequency: Array, groups: list[Indices], slopes: list[dict[str, Array]]
) -> FrequencySlopes:
    m = state.one_robot.cable_count
    by_cable = {f"{name}_sensitivity": (m,) for name in ("length", "density", "stiffness")}
    on_platform = {"inertia_sensitivity": (3, 3), "pose_sensitivity": (6,), "wrench_sensitivity": (6,)}
    rows = {}
    for name, shape in {**by_cable, "mass_sensitivity": (), **on_platform}.items():
        parts = (_parting(one[name], frequency[group]) for one, group in zip(slopes, groups, strict=True))
        rows[name] = locked(np.concatenate((np.empty((0, *shape)), *parts)))
    group = locked(np.repeat(np.arange(len(groups)), np.array([len(each) for each in groups], dtype=int)))
    return FrequencySlopes(state=state, cable_mass=cable_mass, frequency=frequency, group=group, **rows)


def _parting(form: Array, frequency: Array) -> Array:
    """Derivatives (g, ...) of a group's frequencies from `form` (..., g, g), those of the squared angular frequency."""
    known: Flags = np.asarray(np.isfinite(form).all(axis=(-1, -2)))
    squares = np.linalg.eigvalsh(np.where(known[..., None, None], form, 0.0))
    squares = np.where(known[..., None], squares, np.nan)
    return np.asarray(np.moveaxis(squares, -1, 0) / (8.0 * np.pi**2 * frequency.mean()))
