"""Small motion about an equilibrium with cable mass: decoupled modal response."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from sagline.core.arguments import check_memory
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.initial_conditions import InitialConditions
from sagline.dynamics.simulation.results import EnergyBalance, Simulation, displaced_pose, twist_of_origin
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.dynamics.vibration.vibration import Vibration, VibrationStatus, vibration
from sagline.kernels import codes
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import frame_end_forces, motions_of_ends
from sagline.statics.stiffness import Stiffness, modes, stiffness

UP_TO: Final = 1.5  # highest frequency of dynamic modes / highest massless frequency; higher modes are quasi-static
SHARE: Final = 0.1  # largest step times highest angular frequency [rad]
LONGEST: Final = 1e-3  # s
MOST_STEPS: Final = 10**9
SHORTER: Final = "Simulate a shorter time, or record less often."
SMALL: Final = 0.02  # largest change of a cable length, as a share of the length


def _modal_model(state: Equilibrium, damping: Damping) -> tuple[Vibration, Array, Array, Array, Array]:
    """Modes of `state`, and their response to changes u = (dL, dw) of lengths and wrench, shape (m + 6,)."""
    # Returns: Modes; modal force per unit of u, (K, m + 6); static platform motion due to u minus the static response
    # of the modes, (6, m + 6); frame-end tensions per modal amplitude, (m, K) [N/(m sqrt(kg))]; static tensions due to
    # u minus the static response of the modes, (m, m + 6).
    #
    # source: docs/model.md, section 11
    found = vibration(state, up_to=UP_TO * float(np.nanmax(modes(state).frequency)), damping=damping)
    if found.status is not VibrationStatus.SOLVED:
        step = 'Start at another pose, or give cable_mass="lumped" or "none".'
        raise InvalidValueError("start", found.status.text, 'a state with linear vibrations for "modal"', step)
    rest, square = stiffness(state), (2.0 * np.pi * found.frequency) ** 2
    force = _forces_at_frame(state, found, rest)
    along = frame_end_forces(state)
    size = np.linalg.norm(along, axis=1)
    unit = along / size[:, None]
    let_out = unit * (1.0 + size / state.cables.cable.axial_stiffness)[:, None]
    drive = np.concatenate((np.einsum("kmi,mi->km", force, let_out), found.shape.T), axis=1)
    pulled = np.einsum("kmi,mi->mk", force, unit)
    levers = (state.one_robot.platform_anchors - state.one_robot.center_of_mass) @ state.pose.matrix.T
    ends = motions_of_ends(levers) @ rest.compliance
    by_wrench = np.einsum("mi,mij,mjk->mk", unit, rest.cable_stiffness, ends)
    whole = np.concatenate((rest.length_sensitivity, rest.compliance), axis=1)
    tension = np.concatenate((rest.tension_sensitivity, by_wrench), axis=1)
    slow = drive / square[:, None]
    return found, drive, whole - found.shape @ slow, pulled, tension - pulled @ slow


def _forces_at_frame(state: Equilibrium, found: Vibration, rest: Stiffness) -> Array:
    """Changes of the frame-end forces per modal amplitude, world axes, (K, m, 3) [N/(m sqrt(kg))]."""
    # along a cable f = f_0 - g with g' = rho omega^2 u; the displacement of the cable end is the integral of C f
    material, length = state.cables.cable, state.free_length
    at_frame, points = frame_end_forces(state), found.cable_shape.shape[2]
    square = (2.0 * np.pi * found.frequency) ** 2
    weight = state.cables.cable_weight
    force = np.empty((len(square), len(length), 3))
    for i in range(len(length)):
        s = np.linspace(0.0, length[i], points)
        here = at_frame[i] + np.outer(s / length[i], [0.0, 0.0, weight[i]])
        size = np.linalg.norm(here, axis=1)
        unit, stretch = here / size[:, None], 1.0 / material.axial_stiffness[i]
        shape = np.moveaxis(found.cable_shape[:, i], 1, 0)  # (points, K, 3)
        density = material.linear_density[i] * square[:, None]
        passed = CubicSpline(s, shape).antiderivative()(s) * density
        along = np.einsum("pi,pki->pk", unit, passed)[..., None] * unit[:, None, :]
        bent = along * stretch + (passed - along) * (1.0 / size + stretch)[:, None, None]
        missing = CubicSpline(s, bent).antiderivative()(length[i])
        force[:, i] = (shape[-1] + missing) @ rest.cable_stiffness[i].T
    return force


def _modal_response(frequency: Array, ratio: Array, force: Array, step: float) -> tuple[Array, Array, Array, Array]:
    """Exact response of modes at rest to piecewise linear forces: amplitudes, rates, work and lost energy."""
    # shapes: frequency (K,) [rad/s]; ratio (K,); force (N, K); step [s]; returns (N, K) twice, then (N,) twice
    ringing = frequency * np.sqrt(1.0 - ratio * ratio)
    root = -ratio * frequency + 1j * ringing
    whole = np.exp(root * step)
    mean = (whole - 1.0) / root
    later = (whole - 1.0 - root * step) / (root * root * step)
    moving: NDArray[np.complex128] = np.zeros(force.shape, dtype=np.complex128)
    pushed = force[:-1] * (mean - later) + force[1:] * later
    for n in range(len(force) - 1):
        moving[n + 1] = whole * moving[n] + pushed[n]
    amplitude = moving.imag / ringing
    rate = moving.real - ratio * frequency * amplitude
    drag = 2.0 * ratio * frequency
    speeding = force - drag * rate - frequency**2 * amplitude
    area = (0.5 * step * (force[1:] + force[:-1]) - np.diff(rate, axis=0) - drag * np.diff(amplitude, axis=0)) / (
        frequency**2
    )
    work = np.diff(force * amplitude, axis=0) - np.diff(force, axis=0) / step * area
    power, bend = drag * rate**2, 2.0 * drag * rate * speeding
    taken = 0.5 * step * (power[1:] + power[:-1]) - step * step / 12.0 * np.diff(bend, axis=0)
    start = np.zeros(1)
    supplied = np.concatenate((start, np.cumsum(work.sum(axis=1))))
    return amplitude, rate, supplied, np.concatenate((start, np.cumsum(taken.sum(axis=1))))


def modal_simulation(given: InitialConditions, damping: Damping, step: Any, record: float) -> Simulation:
    """Simulate the small motion of a robot about its initial equilibrium; `step` and `record` in s."""
    state = given.state
    _check(given)
    found, drive, static_motion, pulled, static_tension = _modal_model(state, damping)
    frequency = 2.0 * np.pi * found.frequency
    if (found.loss >= 1.0).any():
        k = int(np.argmax(found.loss >= 1.0))
        value = f"a ratio of {found.loss[k]:.3g} at {found.frequency[k]:.3g} Hz with cable mass"
        raise InvalidValueError("damping", value, "< 1 for modes", 'Give a smaller ratio, or cable_mass="lumped".')
    usual = min(LONGEST, SHARE / frequency[-1])
    fine = usual if step is None else number(step, "step", "s", above=0.0)
    every = max(1, math.ceil(record / fine - 1e-9))
    size = record / every
    count = int(np.ceil(min((given.end - given.begin) / size, MOST_STEPS) - 1e-9))
    cables, points = found.cable_shape.shape[1:3]
    check_memory(
        "duration", 8.0 * count * (5.0 * len(frequency) + 4.0 * cables + 3.0 * cables * points / every), SHORTER
    )
    time: Array = given.begin + size * np.arange(count + 1, dtype=np.float64)
    kept = np.unique(np.append(np.arange(0, count + 1, every), count))  # the last sample is the end
    lengths, wrenches = given.lengths.at(time)[0], given.wrench.at(time)[0]
    change = np.concatenate((lengths - state.unstrained_length, wrenches - state.wrench), axis=1)
    _check_small_changes(np.abs(change[:, : lengths.shape[1]]).max(axis=0), state)
    response = _modal_response(frequency, found.loss, change @ drive.T, size)
    at_steps = state.cables.frame_end_tension + response[0] @ pulled.T + change @ static_tension.T
    (amplitude, rate, supplied, lost), driven = (part[kept] for part in response), change[kept]
    motion = amplitude @ found.shape.T + driven @ static_motion.T
    kinetic, potential = 0.5 * (rate**2).sum(axis=1), 0.5 * ((amplitude * frequency) ** 2).sum(axis=1)
    slopes = np.gradient(driven, time[kept], axis=0)
    moving, pose = rate @ found.shape.T + slopes @ static_motion.T, displaced_pose(state.pose, given.robot, motion)
    return Simulation(
        robot=given.robot,
        time=locked(time[kept].copy()),
        pose=pose,
        twist=twist_of_origin(given.robot, pose, moving[:, :3], moving[:, 3:]),
        tensions=locked(at_steps[kept].copy()),
        length=locked(lengths[kept].copy()),
        energy=EnergyBalance._of(kinetic, potential, supplied, lost, np.zeros_like(lost)),
        events=(),
        cable_mass="modal",
        step=size,
        integrator="exact",
        damping=damping,
        nodes=locked(_shapes(state, found, amplitude)),
        largest_tension=locked(at_steps.max(axis=0)),
    )


def _check(given: InitialConditions) -> None:
    """Reject initial conditions `given` for which modes do not exist."""
    if given.state.contact is not None:
        step = 'Remove the winches of the robot, or give cable_mass="lumped".'
        raise InvalidValueError("start", "a robot with pulleys or dead length", 'none for cable_mass="modal"', step)
    if given.model.code != codes.CATENARY:
        step = 'Plan with Catenary(), or give cable_mass="none".'
        raise InvalidValueError("start: model", type(given.model).__name__, "Catenary() for cables with mass", step)
    if np.abs(given.twist).max() > 0.0 or np.abs(given.rate).max() > 0.0:
        step = 'Give plan.state[0], or cable_mass="lumped".'
        raise InvalidValueError("start", "in motion", 'at rest for cable_mass="modal"', step)


def _check_small_changes(most: Array, state: Equilibrium) -> None:
    share = most / state.free_length
    if (share > SMALL).any():
        i = int(np.argmax(share))
        value, allowed = f"changed by {most[i]:.3g} m", f'<= {SMALL * state.free_length[i]:.3g} m for "modal"'
        step = 'Give cable_mass="lumped", which is valid for large motions.'
        raise InvalidValueError(f"unstrained_length: cable {i}", value, allowed, step)


def _shapes(state: Equilibrium, found: Vibration, amplitude: Array) -> Array:
    """Positions of points on the cables, at equal distances along the unstrained cable, (N, m, points, 3)."""
    count = found.cable_shape.shape[2]
    chord = state.pose.transform(state.one_robot.platform_anchors) - state.exit_point
    level = chord[:, :2] / np.maximum(np.hypot(chord[:, 0], chord[:, 1]), 1e-300)[:, None]
    own = state.cables.points(count)
    at_rest = np.concatenate((own[..., :1] * level[:, None], own[..., 1:]), axis=-1) + state.exit_point[:, None]
    return np.asarray(at_rest + np.tensordot(amplitude, found.cable_shape, axes=1))
