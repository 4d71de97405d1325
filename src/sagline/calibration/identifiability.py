"""Unobservable directions of the parameters: combinations that change no reading, each with its name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np

from sagline.calibration.findings import Direction
from sagline.calibration.log import Sensors
from sagline.calibration.parameters import KINDS, Parameters
from sagline.calibration.symmetries import Generator, Symmetries, symmetries
from sagline.core.arrays import Array, Indices, locked
from sagline.kernels.calibration import kinds
from sagline.robot.robot import Robot

OPEN: Final = 1e-12  # rounding error of slopes that cancel, relative to the largest singular value
_SPREAD: Final = 1e-9  # a direction with a larger singular value, relative to the largest, is always observable
_FIXED: Final = 5e-2  # a parameter counts as known if its stated deviation, relative to the usual deviation, is smaller
_WIDE: Final = 1e3  # largest prior deviation, relative to the usual deviation of an unknown value
_SAME: Final = 1e-6  # two directions count as equal below this sine of the angle between them
_TINY: Final = 1e-300
_NAMED: Final = 3  # number of parameters in the text of a direction that is not a symmetry


class PriorUnits(NamedTuple):
    """Unknowns in standard deviations of their priors.

    Attributes:
        scale: One standard deviation in the internal parameters, (P,).
        units: One standard deviation in the units of the parameters, (P,).
        free: Indices of the parameters that do not count as known.
    """

    scale: Array
    units: Array
    free: Indices


def append_rows(triangle: Array, matrix: Array) -> Array:
    """Triangular factor (at most P, P) of the previous factor and additional rows (..., P), without rows with NaN.

    Householder reflections keep all digits of small singular values; normal equations would lose half of them.
    """
    rows = matrix.reshape(-1, matrix.shape[-1])
    rows = rows[~np.isnan(rows).any(axis=1) & rows.any(axis=1)]
    return np.asarray(np.linalg.qr(np.vstack((triangle, rows)), mode="r"))


def prior_units(parameters: Parameters) -> PriorUnits:
    """Units of the directions: prior deviations, or the usual deviation of an unknown value if there is no prior.

    A larger prior deviation is reduced to `_WIDE`, because rounding would otherwise hide the other parameters.
    """
    usual = np.array([KINDS[name].assumed for name in parameters.names])
    usual = np.where(parameters.logarithmic, usual * np.abs(parameters.prior), usual)
    units = np.where(np.isfinite(parameters.prior_deviation), parameters.prior_deviation, usual)
    units = np.minimum(units, _WIDE * usual)
    scale = units / np.where(parameters.logarithmic, np.abs(parameters.prior), 1.0)
    common = np.array([KINDS[name].deviation for name in parameters.names])
    fixed = parameters.stated & (scale < _FIXED * common)
    return PriorUnits(scale, units, np.flatnonzero(~fixed).astype(np.int64))


def _open_directions(triangle: Array, frame: PriorUnits) -> Array:
    """Unit vectors, in standard deviations of the priors, that change no reading, as columns (P, d)."""
    vectors = np.zeros((len(frame.scale), 0))
    if not frame.free.size:
        return vectors
    scaled = triangle[:, frame.free] * frame.scale[frame.free]
    _, values, rows = np.linalg.svd(scaled, full_matrices=True)
    values = np.concatenate((values, np.zeros(len(rows) - len(values))))
    vectors = np.zeros((len(frame.scale), len(rows) - numerical_rank(values)))
    vectors[frame.free] = rows[numerical_rank(values) :].T
    return vectors


def numerical_rank(values: Array) -> int:
    """Number of singular values (descending) before the widest gap near `OPEN`; smaller ones are rounding errors."""
    largest = values[0] if values.size else 0.0
    if largest == 0.0:
        return 0
    share = np.maximum(values / largest, 1e-18)
    first = int(np.sum(share > _SPREAD))
    last = int(np.sum(share > OPEN))
    if last == len(share) or first == last == 0:
        return last
    gaps = share[max(first, 1) - 1 : last] / share[max(first, 1) : last + 1]
    return max(first, 1) + int(np.argmax(gaps))


def gauge_of(
    triangle: Array, parameters: Parameters, values: Array, robot: Robot, sensors: Sensors
) -> tuple[Direction, ...]:
    """Unobservable directions of the unknowns, with names; only the priors determine the values along them."""
    frame = prior_units(parameters)
    size = np.linalg.norm(triangle, axis=0) * frame.scale
    alone = [int(index) for index in frame.free if size[index] <= OPEN * size.max()]
    unit = np.eye(len(size))
    found = [_direction(*_largest(unit[index], parameters), frame) for index in alone]
    frame = frame._replace(free=np.setdiff1d(frame.free, alone))
    left = _open_directions(triangle, frame)
    known = symmetries(robot, sensors, _rotation_of_frame(parameters, values), counted=parameters.counted)
    known = known._replace(matters=known.matters & ~np.isin(parameters.where, alone))
    vectors, named = _symmetric_part(left, frame, parameters.where, known)
    found += [_direction(name, vector, step, frame) for vector, (name, step) in zip(vectors.T, named, strict=True)]
    fit_suspects = np.linalg.qr(vectors)[0]
    rest = left - fit_suspects @ (fit_suspects.T @ left)
    basis, size, _ = np.linalg.svd(rest, full_matrices=False)
    for vector in _sparse(basis[:, size > 0.5]).T:
        found.append(_direction(*_largest(vector, parameters), frame))
    return tuple(found)


def _rotation_of_frame(parameters: Parameters, values: Array) -> Array:
    """Rotation vector of the measuring system, if it is estimated [rad], (3,); zero if it is known."""
    where = parameters.where[kinds.TURN : kinds.TURN + 3, 0]
    return np.where(where >= 0, values[where], 0.0)


def _direction(name: str, vector: Array, step: str, frame: PriorUnits) -> Direction:
    unit = vector / np.linalg.norm(vector)
    unit = unit * np.sign(unit[np.argmax(np.abs(unit))])
    return Direction(name, locked(frame.units * unit), 1.0, step)


def _symmetric_part(
    left: Array, frame: PriorUnits, where: Indices, known: Symmetries
) -> tuple[Array, list[tuple[str, str]]]:
    """Symmetries within the span of the unobservable directions (P, d), with names and steps."""
    vectors, shares = _admissible_symmetries(frame, where, known)
    if not vectors.shape[1] or not left.shape[1]:
        return np.zeros((len(frame.scale), 0)), []
    basis, upper = np.linalg.qr(vectors)
    _, sines, turned = np.linalg.svd(basis - left @ (left.T @ basis), full_matrices=False)
    inside = np.linalg.solve(upper, turned[sines < _SAME].T)  # directions that are symmetries and unobservable
    mixed = _echelon((shares @ inside).T).T
    found = vectors @ np.linalg.lstsq(shares, mixed, rcond=None)[0]
    return found, [_named(column, known.each) for column in mixed.T]


def _admissible_symmetries(frame: PriorUnits, where: Indices, known: Symmetries) -> tuple[Array, Array]:
    """Combinations of symmetries that change only unknowns: vectors (P, k), and coefficients of the symmetries (g, k).

    Both are in standard deviations. Known values do not change, and values that all cables share change equally. Zeros
    and radii of the drums change so that the drums pay out the required lengths.
    """
    free = np.isin(where, frame.free)
    conditions = [known.table[known.matters & ~free], known.lengths]
    single = np.zeros((len(frame.scale), known.table.shape[-1]))
    for index in frame.free:
        same = known.table[where == index]
        conditions.append(same[1:] - same[0])
        single[index] = same[0] / frame.scale[index]
    condition = np.vstack(conditions)
    combined = _null(condition / np.maximum(np.abs(condition).max(axis=1, keepdims=True), _TINY))
    vectors = single @ combined
    _, size, rows = np.linalg.svd(vectors, full_matrices=False)
    kept = rows[size > _SAME * max(size.max(initial=0.0), _TINY)].T
    shares = np.linalg.norm(single, axis=0)[:, None] * (combined @ kept)
    return vectors @ kept, shares[: len(known.each)]


def _null(matrix: Array) -> Array:
    """Orthonormal basis of the null space of a matrix, as columns."""
    _, values, rows = np.linalg.svd(matrix, full_matrices=True)
    rank = int(np.sum(values > 1e-9 * max(values.max(initial=0.0), _TINY)))
    return np.asarray(rows[rank:].T)


def _echelon(rows: Array) -> Array:
    """Reduced row echelon form."""
    rows = rows.copy()
    lead = 0
    for column in range(rows.shape[1]):
        if lead == len(rows):
            break
        pivot = lead + int(np.argmax(np.abs(rows[lead:, column])))
        if abs(rows[pivot, column]) < _SAME * np.abs(rows[lead:]).max():
            continue
        rows[[lead, pivot]] = rows[[pivot, lead]]
        rows[lead] /= rows[lead, column]
        others = np.arange(len(rows)) != lead
        rows[others] -= np.outer(rows[others, column], rows[lead])
        lead += 1
    return rows


def _named(shares: Array, known: Sequence[Generator]) -> tuple[str, str]:
    """Name and step of a combination of symmetries: step of the first symmetry, names without later shifts."""
    size = np.abs(shares)
    taken = [known[index] for index in map(int, np.flatnonzero(size > _SAME * size.max()))]
    first = taken[0]
    also = [one.name for one in taken[1:] if "shifted" not in one.name]
    return " and ".join([first.name, *also]), first.step


def _sparse(basis: Array) -> Array:
    """Sparse basis of the span of some columns, as columns."""
    return _echelon(basis.T).T if basis.size else basis


def _largest(vector: Array, parameters: Parameters) -> tuple[str, Array, str]:
    """Name, vector and step of a direction, from the parameters that it changes most."""
    size = np.abs(vector)
    order = np.argsort(-size, kind="stable")
    moved = [int(index) for index in order if size[index] > 1e-3 * size.max()]
    name = " with ".join(parameters.labels[index] for index in moved[:_NAMED])
    if len(moved) > _NAMED:
        name += f" and {len(moved) - _NAMED} more"
    return name, vector, easiest_measurement(parameters.names[index] for index in moved)


STEPS: Final = {  # the easiest measurement first
    "pulley_radius": "measure the pulley with a caliper",
    "mass": "weigh the platform",
    "linear_density": "weigh some meters of the cable",
    "drum_radius": "measure the drum and its cable with a caliper, or pay out a length along a tape",
    "dead_cable": "measure the distance from drum to pulley with a tape",
    "load_cell_bias": "read the load cell without load",
    "load_cell_gain": "check the load cell with a known weight",
    "axial_stiffness": "choose poses with very different tensions, or measure the stretch of a piece of the cable",
    "center_of_mass": "balance the platform, or choose poses with more tilt",
    "platform_anchors": "measure the platform's anchors",
    "length_zero": "home at a pose that is measured",
    "target": "measure the target on the platform, or choose poses with more tilt",
    "measuring_frame": "measure more poses, some of them rotated",
    "frame_anchors": "measure frame anchors with a total station",
}


def measurement_rank(name: str) -> int:
    """Rank of a kind of parameter; easier measurements come first."""
    return list(STEPS).index(name)


def easiest_measurement(names: Iterable[str]) -> str:
    """Easiest measurement that separates parameters of some kinds."""
    return STEPS[min(names, key=measurement_rank)]
