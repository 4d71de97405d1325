"""Sensitivities of natural frequencies to lengths, cable data, mass, inertia, pose and wrench."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.dynamics.vibration.dynamic_stiffness import check_model, check_solved, single_state
from sagline.dynamics.vibration.flexibility import Flexibility, flexibility_per_length
from sagline.dynamics.vibration.vibration import Vibration, VibrationStatus
from sagline.kernels.dynamics.collocation import INTEGRALS, NODES, STAGES, WEIGHTS
from sagline.kernels.dynamics.string import SMOOTH, TINY
from sagline.robot.equilibrium import Equilibrium, HasState, equilibrium_of, of_result
from sagline.statics.slopes import cable_slopes, motions_of_ends
from sagline.statics.stiffness import mass_matrix, modes, stiffness


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
    together, vibrating = number(together, "together", "", low=0.0), state if isinstance(state, Vibration) else None
    if vibrating is not None and vibrating.status is not VibrationStatus.SOLVED:
        told = f"a vibration with the status {vibrating.status.name}"
        raise InvalidValueError("state", told, "a vibration that was solved", "Use its state for massless frequencies.")
    rest = _Rest(equilibrium_of(state) if vibrating is None else vibrating.state)
    found = modes(rest.state) if vibrating is None else vibrating
    groups = list(_groups(found.frequency, together))
    if vibrating is None:
        flexible = Flexibility(rest.state, rest.slopes.force)
        swings = [_massless(rest, flexible, found.shape[:, k], found.frequency[k]) for k in groups]
    else:
        cables = _string_data(rest)
        swings = [_mode_group(rest, cables, found.frequency[k]) for k in groups]
    m, slopes, rows = rest.state.one_robot.cable_count, [one.square_derivatives(rest) for one in swings], {}
    by_cable = {f"{name}_sensitivity": (m,) for name in ("length", "density", "stiffness")}
    on_platform = {"inertia_sensitivity": (3, 3), "pose_sensitivity": (6,), "wrench_sensitivity": (6,)}
    for name, shape in {**by_cable, "mass_sensitivity": (), **on_platform}.items():
        parts = (_parting(one[name], found.frequency[group]) for one, group in zip(slopes, groups, strict=True))
        rows[name] = locked(np.concatenate((np.empty((0, *shape)), *parts)))
    group = locked(np.repeat(np.arange(len(groups)), np.array([len(each) for each in groups], dtype=int)))
    return FrequencySlopes(rest.state, vibrating is not None, found.frequency, group, **rows)


def _groups(frequency: Array, together: float) -> Iterator[Indices]:
    """Groups of the indices of adjacent frequencies that count as equal. `frequency` is ascending."""
    apart = ~(np.diff(frequency) <= together * frequency[1:])
    borders = [0, *(np.flatnonzero(apart) + 1).tolist(), len(frequency)]
    for first, last in pairwise(borders):
        if last > first:
            yield np.arange(first, last)


def _massless(rest: _Rest, flexible: Flexibility, motion: Array, frequency: Array) -> _ModeGroup:
    """Massless modes of the frequencies `frequency` [Hz]: the change of the force is constant along each cable."""
    ends = motion[:3].T + np.cross(motion[3:].T, rest.slopes.levers[:, None])
    force = ends @ np.swapaxes(rest.slopes.blocks, -1, -2)
    data = np.stack((flexible.by_length, flexible.by_density, flexible.by_stiffness))
    by_force = np.einsum("mai,mbj,mijc->mabc", force, force, flexible.by_force, optimize=True)
    by_datum = np.einsum("mai,mbj,pmij->pmab", force, force, data, optimize=True)
    square = float((2.0 * np.pi * frequency.mean()) ** 2)
    return _ModeGroup(motion, square, force, by_force, by_datum)


def _parting(form: Array, frequency: Array) -> Array:
    """Derivatives (g, ...) of a group's frequencies from `form` (..., g, g), those of the squared angular frequency."""
    known: Flags = np.asarray(np.isfinite(form).all(axis=(-1, -2)))
    squares = np.linalg.eigvalsh(np.where(known[..., None, None], form, 0.0))
    squares = np.where(known[..., None], squares, np.nan)
    return np.asarray(np.moveaxis(squares, -1, 0) / (8.0 * np.pi**2 * frequency.mean()))


class _Rest:
    """State, and derivatives of its equilibrium."""

    def __init__(self, state: Equilibrium) -> None:
        """Compute force derivatives, compliance and mass of a state, which is checked first."""
        check_model(single_state(state))
        if state.contact is not None:
            value, step = (
                "a robot with pulleys or dead length",
                "Use the robot without winches: robot.replace(winches=None).",
            )
            raise InvalidValueError("state", value, "cables from frame anchors", step)
        check_solved(state)
        slopes, known = cable_slopes(state), stiffness(state)
        self.state, self.slopes = state, slopes  # slopes: derivatives of cable forces
        # derivatives of platform-end forces with respect to length, density and axial stiffness, shape (3, m, 3)
        self.by_datum = np.stack((slopes.by_length, slopes.by_density, slopes.by_stiffness))
        # derivatives of the equilibrium motion with respect to the same data, shape (3, 6, m)
        self.settling = np.stack((known.length_sensitivity, known.density_sensitivity, known.stiffness_sensitivity))
        self.compliance, self.mass = known.compliance, mass_matrix(state)  # (6, 6) each; mass: of the platform


class _ModeGroup(NamedTuple):
    """The g modes of one frequency, and the effect of changes of cable data on each pair of modes."""

    motion: Array  # platform motion, unit modal mass, shape (6, g)
    square: float  # squared angular frequency [1/s^2]
    end_force: Array  # force of the cables on their platform ends, shape (m, g, 3)
    by_force: Array  # derivatives with respect to static platform-end force, integral of f^T dC f, shape (m, g, g, 3)
    # derivatives with respect to length, linear density (including the derivative of mu u^2) and axial stiffness
    by_datum: Array  # shape (3, m, g, g)

    def square_derivatives(self, rest: _Rest) -> dict[str, Array]:
        """Matrices (..., g, g) by fields of `FrequencySlopes`; their eigenvalues are derivatives of omega squared."""
        # the derivatives include the motion of the platform to its new equilibrium
        robot, pose = rest.state.one_robot, _by_pose(rest, self)
        turns = rest.state.pose.matrix.T @ self.motion[3:]
        spins = np.einsum("ia,jb->ijab", turns, turns)
        moved = self.motion[:3]
        own = -np.einsum("mabc,pmc->pmab", self.by_force, rest.by_datum) - self.by_datum
        own = own + _lever_form(self.motion[3:], rest.slopes.levers, rest.by_datum)
        sinking = -robot.gravity * rest.compliance[:, 2]
        length, density, stiff = own + np.einsum("kab,pkm->pmab", pose, rest.settling)
        return {
            "length_sensitivity": length,
            "density_sensitivity": density,
            "stiffness_sensitivity": stiff,
            "mass_sensitivity": np.einsum("kab,k->ab", pose, sinking) - self.square * moved.T @ moved,
            "inertia_sensitivity": -0.5 * self.square * (spins + np.swapaxes(spins, -1, -2)),
            "pose_sensitivity": pose,
            "wrench_sensitivity": np.einsum("kab,kj->jab", pose, rest.compliance),
        }


def _by_pose(rest: _Rest, swings: _ModeGroup) -> Array:
    """Derivatives with respect to free motions of the platform at fixed lengths, (6, g, g)."""
    slopes, turns = rest.slopes, swings.motion[3:]
    unit = np.eye(6)
    moved = np.cross(unit[:, None, 3:], slopes.levers)  # rotation of the levers
    forces = np.einsum("mij,kmj->kmi", slopes.blocks, unit[:, None, :3] + moved)
    form = -np.einsum("mabc,kmc->kab", swings.by_force, forces)
    onto = np.cross(turns.T[:, None, None], moved)  # indices: mode b, motion k, cable m
    pulled = np.einsum("mai,bkmi->kab", swings.end_force, onto)
    form += pulled + np.swapaxes(pulled, -1, -2)
    form += (_lever_form(turns, moved, slopes.force) + _lever_form(turns, slopes.levers, forces)).sum(axis=1)
    inertia = rest.mass[3:, 3:]
    # matrices of the cross product of each axis with a vector
    for k, cross in enumerate(np.swapaxes(np.cross(np.eye(3)[:, None], np.eye(3)), -1, -2)):
        form[3 + k] -= swings.square * turns.T @ (cross @ inertia - inertia @ cross) @ turns
    freedom = rest.state.one_robot.freedom
    return np.asarray(np.einsum("kj,jab->kab", freedom.T @ freedom, form))


def _lever_form(turns: Array, levers: Array, force: Array) -> Array:
    """Geometric stiffness due to rotations of levers r with constant forces T: symmetric part of r T^T - r.T."""
    # shapes: turns (3, g); levers (..., 3); force (..., 3); returns (..., g, g)
    along, pulled = levers @ turns, force @ turns
    mixed = along[..., :, None] * pulled[..., None, :]
    pressed = np.sum(levers * force, axis=-1)[..., None, None] * (turns.T @ turns)
    return np.asarray(0.5 * (mixed + np.swapaxes(mixed, -1, -2)) - pressed)


PHASE = 0.45 * np.pi  # largest phase of a transverse wave in an element [rad]
HALVINGS = 40  # largest number of bisections of a cable; it limits the number of very short elements at a fold
CLOSE = 1e-5  # relative step of the frequency for the numerical derivative of the equations
_UP = np.array([0.0, 0.0, 1.0])


class _StringData(NamedTuple):
    """Cable at rest: force on its platform end (3,) [N], weight per length, length, EA and density."""

    force: Array
    weight: float
    length: float
    stiffness: float
    density: float


class _Waves:
    """Waves of a cable due to unit forces on its frame end: displacement and force for each component of the force."""

    def __init__(self, cable: _StringData, omega: float) -> None:
        """Solve by collocation at Gauss points of the cable's elements."""
        edges = _edges(cable, omega)
        size = np.diff(edges)
        place = edges[:-1, None] + size[:, None] * NODES  # (e, STAGES)
        below = cable.length - place
        force = cable.force - cable.weight * below[..., None] * _UP
        rates = np.zeros((*place.shape, 6, 6))
        rates[..., :3, 3:] = flexibility_per_length(force, cable.stiffness)
        rates[..., 3:, :3] = -cable.density * omega**2 * np.eye(3)
        within = np.einsum("e,st,etij->esitj", size, INTEGRALS, rates).reshape(len(size), 6 * STAGES, 6 * STAGES)
        start = np.tile(np.eye(6), (STAGES, 1))
        stages = np.linalg.solve(np.eye(6 * STAGES) - within, np.broadcast_to(start, (len(size), *start.shape)))
        stages = stages.reshape(len(size), STAGES, 6, 6)
        across = np.eye(6) + np.einsum("e,s,esij,esjk->eik", size, WEIGHTS, rates, stages, optimize=True)
        at = np.concatenate((np.zeros((3, 3)), np.eye(3)))
        within_each = np.empty((len(size), STAGES, 6, 3))
        for e in range(len(size)):
            within_each[e] = stages[e] @ at
            at = across[e] @ at
        found = within_each.reshape(-1, 6, 3)
        # force: force in the cable at rest, shape (P, 3) [N]
        # below: length from the point to the platform end, shape (P,) [m]
        self.force, self.below = force.reshape(-1, 3), below.reshape(-1)
        self.share = (size[:, None] * WEIGHTS).reshape(-1)  # length of cable that the point represents, shape (P,) [m]
        # moved: displacement, one column per force component, shape (P, 3, 3)
        # pulled: change of the force, shape (P, 3, 3)
        # end: displacement and force at the platform end, shape (2, 3, 3)
        self.moved, self.pulled, self.end = found[:, :3], found[:, 3:], at.reshape(2, 3, 3)


def _string_data(rest: _Rest) -> tuple[_StringData, ...]:
    """String data of the cables of the state `rest`."""
    cables = rest.state.cables
    gravity = 0.0 if cables.model.weightless else cables.gravity
    material = cables.cable.linear_density, cables.cable.axial_stiffness
    density, stiffness = (np.broadcast_to(field, cables.shape) for field in material)
    return tuple(
        _StringData(rest.slopes.force[i], gravity * float(density[i]), length, float(stiffness[i]), float(density[i]))
        for i, length in enumerate(cables.unstrained_length.tolist())
    )


def _mode_group(rest: _Rest, cables: tuple[_StringData, ...], frequency: Array) -> _ModeGroup:
    """Modes of the adjacent frequencies `frequency` [Hz], which count as equal."""
    omega, group = 2.0 * np.pi * float(frequency.mean()), len(frequency)
    omega *= 1.0 + _correction(rest, cables, omega, group)  # this step multiplies the error by the factor CLOSE
    waves = [_Waves(cable, omega) for cable in cables]
    matrix, scale = _equations(rest, waves, omega)
    vectors = scale[:, None] * np.linalg.svd(matrix)[2][-group:].T
    freedom = rest.state.one_robot.freedom
    motion = freedom.T @ vectors[: len(freedom)]
    pulls = vectors[len(freedom) :].reshape(len(cables), 3, group)
    mass = motion.T @ rest.mass @ motion
    for cable, wave, pull in zip(cables, waves, pulls, strict=True):
        moved = wave.moved @ pull
        mass = mass + cable.density * np.einsum("p,pia,pib->ab", wave.share, moved, moved)
    units = np.linalg.inv(np.linalg.cholesky(mass)).T
    return _forms(rest, cables, waves, motion @ units, pulls @ units, omega)


def _correction(rest: _Rest, cables: tuple[_StringData, ...], omega: float, group: int) -> float:
    """Relative error of a frequency, to first order, from the singular values of the equations."""
    matrix, scale = _equations(rest, [_Waves(cable, omega) for cable in cables], omega)
    near = omega * (1.0 + CLOSE)
    other, _ = _equations(rest, [_Waves(cable, near) for cable in cables], near, scale)
    left, values, right = np.linalg.svd(matrix)
    left, right = left[:, -group:], right[-group:]
    change = left.T @ (other - matrix) @ right.T / CLOSE
    return float(-np.trace(np.linalg.solve(change, np.diag(values[-group:]))) / group)


def _equations(rest: _Rest, waves: list[_Waves], omega: float, scale: Array | None = None) -> tuple[Array, Array]:
    """Balance of free motions and continuity at cable ends, (n + 3 m, n + 3 m), and the scale of its columns."""
    freedom, levers = rest.state.one_robot.freedom, rest.slopes.levers
    n, ends = len(freedom), motions_of_ends(levers)
    matrix = np.zeros((n + 3 * len(waves), n + 3 * len(waves)))
    held = -(omega**2) * rest.mass
    held[3:, 3:] += _lever_form(np.eye(3), levers, rest.slopes.force).sum(axis=0)
    matrix[:n, :n] = freedom @ held @ freedom.T
    for i, wave in enumerate(waves):
        own = slice(n + 3 * i, n + 3 * i + 3)
        matrix[:n, own] = freedom @ ends[i].T @ wave.end[1]
        matrix[own, :n] = ends[i] @ freedom.T
        matrix[own, own] = -wave.end[0]
    matrix[:n] /= np.abs(rest.slopes.matrix).max()
    scale = 1.0 / np.linalg.norm(matrix, axis=0) if scale is None else scale
    return matrix * scale, scale


def _edges(cable: _StringData, omega: float) -> Array:
    """Borders of the elements of a cable. Each element is short compared with N/w and with a transverse wave."""
    edges = np.array([0.0, cable.length])
    for _ in range(HALVINGS):
        size = np.diff(edges)
        long = size > _longest(cable, omega, edges[:-1], edges[1:])
        if not long.any():
            break
        edges = np.sort(np.concatenate((edges, edges[:-1][long] + 0.5 * size[long])))
    return edges


def _longest(cable: _StringData, omega: float, start: Array, end: Array) -> Array:
    """Largest allowed element lengths [m] in the parts of a cable from `start` to `end`."""
    low, high = (cable.force[2] - cable.weight * (cable.length - s) for s in (start, end))
    least = np.hypot(np.hypot(*cable.force[:2]), np.maximum(np.maximum(low, -high), 0.0)) + TINY
    slowness = np.sqrt(cable.density * (1.0 / least + 1.0 / cable.stiffness))
    return np.asarray(np.minimum(SMOOTH * least / (cable.weight + TINY), PHASE / (omega * slowness)))


def _forms(
    rest: _Rest, cables: tuple[_StringData, ...], waves: list[_Waves], motion: Array, pulls: Array, omega: float
) -> _ModeGroup:
    gravity = 0.0 if rest.state.cables.model.weightless else rest.state.cables.gravity
    end_force, by_force, by_datum = [], [], []
    for cable, wave, pull in zip(cables, waves, pulls, strict=True):
        moved, pulled = wave.moved @ pull, wave.pulled @ pull
        turned = _turned(wave.force, pulled)
        heavier = -np.einsum("p,pab->ab", wave.share * wave.below, turned[..., 2])
        swung = np.einsum("p,pia,pib->ab", wave.share, moved, moved)
        softer = np.einsum("p,pia,pib->ab", wave.share, pulled, pulled)
        at_frame = flexibility_per_length(cable.force - cable.weight * cable.length * _UP, cable.stiffness)
        end_force.append((wave.end[1] @ pull).T)
        by_force.append(np.einsum("p,pabc->abc", wave.share, turned))
        by_datum.append((pull.T @ at_frame @ pull, gravity * heavier + omega**2 * swung, -softer / cable.stiffness**2))
    data = np.swapaxes(np.array(by_datum), 0, 1)
    return _ModeGroup(motion, omega**2, np.array(end_force), np.array(by_force), data)


def _turned(force: Array, pulled: Array) -> Array:
    """Derivatives (P, g, g, 3) of f^T dC f with respect to the static force, for each pair of modes."""
    size = np.linalg.norm(force, axis=-1)[:, None, None]
    along = np.einsum("pi,pig->pg", force, pulled)
    both = np.einsum("pia,pib->pab", pulled, pulled)
    mixed = along[:, :, None, None] * np.swapaxes(pulled, 1, 2)[:, None]  # along[a] times each component of pulled[b]
    straight = 3.0 * along[:, :, None] * along[:, None, :] / size**2 - both
    turned = straight[..., None] * force[:, None, None, :] - mixed - np.swapaxes(mixed, 1, 2)
    return np.asarray(turned / size[..., None] ** 3)
