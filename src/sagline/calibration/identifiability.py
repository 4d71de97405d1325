"""Unobservable directions: combinations of parameters that change no reading, each with its name.

Some are symmetries: a shift of the origin of the world frame changes parameters, but no reading, because the origin is
a convention. See docs/model.md, section 14.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from scipy.linalg import null_space

from sagline.calibration.findings import Direction
from sagline.calibration.further import swivel_axes
from sagline.calibration.least_squares import left_jacobian
from sagline.calibration.log import Sensors
from sagline.calibration.parameters import Parameters, PriorUnits
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels.calibration import kinds
from sagline.robot.batch import has_slanted_axes
from sagline.robot.drum import Drums
from sagline.robot.robot import Robot

OPEN: Final = 1e-12  # rounding error of a singular value that is exactly zero, relative to the largest singular value
_SPREAD: Final = 1e-9  # a direction is always observable if its singular value exceeds this share of the largest
_SAME: Final = 1e-6  # largest sine of the angle between two directions that count as equal
_TINY: Final = 1e-300
_NAMED: Final = 3  # largest number of parameters that the text of a direction names, if it is not a symmetry


def append_rows(triangle: Array, matrix: Array) -> Array:
    """Triangular factor (at most P, P) of the rows of `triangle` and `matrix` (..., P); rows with NaN are omitted."""
    # Householder reflections keep all digits of small singular values; normal equations would lose half of the digits.
    rows = matrix.reshape(-1, matrix.shape[-1])
    rows = rows[~np.isnan(rows).any(axis=1) & rows.any(axis=1)]
    return np.asarray(np.linalg.qr(np.vstack((triangle, rows)), mode="r"))


def _open_directions(triangle: Array, frame: PriorUnits) -> Array:
    """Unit vectors that change no reading, in standard deviations of the priors, as columns (P, d)."""
    vectors = np.zeros((len(frame.scale), 0))
    if not frame.free.size:
        return vectors
    scaled = triangle[:, frame.free] * frame.scale[frame.free]
    _, values, rows = np.linalg.svd(scaled, full_matrices=True)
    values = np.concatenate((values, np.zeros(len(rows) - len(values))))
    vectors = np.zeros((len(frame.scale), len(rows) - _numerical_rank(values)))
    vectors[frame.free] = rows[_numerical_rank(values) :].T
    return vectors


def _numerical_rank(values: Array) -> int:
    """Number of singular values before the widest gap near `OPEN`; later values are only rounding errors."""
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
    """Unobservable directions of the unknowns, with names; only the priors determine values along these directions."""
    frame = PriorUnits(parameters)
    size = np.linalg.norm(triangle, axis=0) * frame.scale
    alone = [int(index) for index in frame.free if size[index] <= OPEN * size.max()]
    unit = np.eye(len(size))
    found = [_direction(*_largest(unit[index], parameters), frame) for index in alone]
    frame.free = np.setdiff1d(frame.free, alone)
    left = _open_directions(triangle, frame)
    where = parameters.where[_TURN, 0]
    turn = np.where(where >= 0, values[where], 0.0)  # rotation vector of the measuring system [rad]; zero if known
    each, table, lengths, matters = _symmetries(robot, sensors, turn, counted=parameters.counted)
    matters &= ~np.isin(parameters.where, alone)
    admissible = _admissible_symmetries(frame, parameters.where, table, lengths, matters)
    vectors, named = _symmetric_part(left, *admissible, each)
    found += [_direction(name, vector, step, frame) for vector, (name, step) in zip(vectors.T, named, strict=True)]
    fit_suspects = np.linalg.qr(vectors)[0]
    rest = left - fit_suspects @ (fit_suspects.T @ left)
    basis, size, _ = np.linalg.svd(rest, full_matrices=False)
    basis = basis[:, size > 0.5]
    rows = _echelon(basis.T) if basis.size else basis.T
    return (*found, *(_direction(*_largest(vector, parameters), frame) for vector in rows))


def _direction(name: str, vector: Array, step: str, frame: PriorUnits) -> Direction:
    unit = vector / np.linalg.norm(vector)
    unit = unit * np.sign(unit[np.argmax(np.abs(unit))])
    return Direction(name, locked(frame.units * unit), 1.0, step)


def _symmetric_part(
    left: Array, vectors: Array, shares: Array, each: Sequence[_Generator]
) -> tuple[Array, list[tuple[str, str]]]:
    """Admissible symmetries in the span of the unobservable directions `left` (P, d), with names and measurements."""
    shares = shares[: len(each)]
    if not vectors.shape[1] or not left.shape[1]:
        return left[:, :0], []
    basis, upper = np.linalg.qr(vectors)
    _, sines, turned = np.linalg.svd(basis - left @ (left.T @ basis), full_matrices=False)
    inside = np.linalg.solve(upper, turned[sines < _SAME].T)  # symmetries that are also unobservable
    mixed = _echelon((shares @ inside).T).T
    found = vectors @ np.linalg.lstsq(shares, mixed, rcond=None)[0]
    return found, [_named(column, each) for column in mixed.T]


def _admissible_symmetries(
    frame: PriorUnits, where: Indices, table: Array, lengths: Array, matters: Flags
) -> tuple[Array, Array]:
    """Combinations of g symmetries that change only unknowns, as vectors (P, k) and as coefficients (g, k)."""
    # Vectors and coefficients are in standard deviations. Known values stay constant, and values that all cables share
    # change equally. Length zeros and drum radii change so that the drums pay out the required lengths.
    free = np.isin(where, frame.free)
    conditions = [table[matters & ~free], lengths]
    single = np.zeros((len(frame.scale), table.shape[-1]))
    for index in frame.free:
        same = table[where == index]
        conditions.append(same[1:] - same[0])
        single[index] = same[0] / frame.scale[index]
    condition = np.vstack(conditions)
    combined = null_space(condition / np.maximum(np.abs(condition).max(axis=1, keepdims=True), _TINY), rcond=1e-9)
    vectors = single @ combined
    _, size, rows = np.linalg.svd(vectors, full_matrices=False)
    kept = rows[size > _SAME * max(size.max(initial=0.0), _TINY)].T
    shares = np.linalg.norm(single, axis=0)[:, None] * (combined @ kept)
    return vectors @ kept, shares


def _echelon(rows: Array) -> Array:
    """Reduced row echelon form: a basis of the span of `rows` with many zeros."""
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


def _named(shares: Array, known: Sequence[_Generator]) -> tuple[str, str]:
    """Name of a combination of symmetries, and the measurement that fixes the first of the symmetries."""
    size = np.abs(shares)
    taken = [known[index] for index in map(int, np.flatnonzero(size > _SAME * size.max()))]
    first = taken[0]
    also = [one.name for one in taken[1:] if "shifted" not in one.name]
    return " and ".join([first.name, *also]), first.step


def _largest(vector: Array, parameters: Parameters) -> tuple[str, Array, str]:
    """Name, vector and recommended measurement of a direction; the name lists the parameters that change most."""
    size = np.abs(vector)
    order = np.argsort(-size, kind="stable")
    moved = [int(index) for index in order if size[index] > 1e-3 * size.max()]
    name = " with ".join(parameters.labels[index] for index in moved[:_NAMED])
    if len(moved) > _NAMED:
        name += f" and {len(moved) - _NAMED} more"
    return name, vector, easiest_measurement(parameters.names[index] for index in moved)


STEPS: Final = {  # kind of parameter: measurement of the kind; easy measurements come first
    "pulley_radius": "measure the pulley with a caliper",
    "mass": "weigh the platform",
    "linear_density": "weigh some meters of the cable",
    "drum_radius": "measure the drum and its cable with a caliper, or pay out a length along a tape",
    "dead_cable": "measure the distance from drum to pulley with a tape",
    "load_cell_bias": "read the load cell without load",
    "load_cell_gain": "check the load cell with a known weight",
    "axial_stiffness": "choose poses with very different tensions, or measure the stretch of a piece of the cable",
    "center_of_mass": "balance the platform, or choose poses with more tilt",
    "inertia": "swing the platform on two ropes",
    "platform_anchors": "measure the platform's anchors",
    "swivel_zero": "read a swivel angle at a pose that is measured",
    "length_scale": "pay out a length along a tape",
    "clock_offset": "move faster",
    "length_zero": "home at a pose that is measured",
    "target": "measure the target on the platform, or choose poses with more tilt",
    "measuring_frame": "measure more poses, some of them rotated",
    "frame_anchors": "measure frame anchors with a total station",
}


def measurement_rank(name: str) -> int:
    """Rank of a kind of parameter by the effort of its measurement; 0 for the easiest measurement."""
    return list(STEPS).index(name)


def easiest_measurement(names: Iterable[str]) -> str:
    """Easiest measurement that distinguishes the parameters of the kinds `names`."""
    return STEPS[min(names, key=measurement_rank)]


_FRAME, _PLATFORM, _CENTER, _SHIFT, _TURN, _TARGET = (
    slice(first, first + 3)
    for first in (kinds.FRAME, kinds.PLATFORM, kinds.CENTER, kinds.SHIFT, kinds.TURN, kinds.TARGET)
)
_WORLD: Final = "fix a frame anchor, or measure 3 points"
_YAW: Final = "fix a second frame anchor, or measure 3 points"
_TILT: Final = "give a platform anchor a small tolerance, or measure rotations"
_ORIGIN: Final = (
    "give a platform anchor or the center of mass a small tolerance, or measure positions of a known target"
)
_BOTH: Final = "measure the platform's anchors"
_SCALE: Final = "weigh some meters of the cable, measure a distance between anchors, or measure the drum"
_FORCE: Final = "weigh the platform, or check a load cell with a known weight"


class _Generator:
    """Symmetry: a change of all parameters together that changes no reading."""

    def __init__(
        self, cables: int, name: str, step: str, *changes: tuple[Any, Array | float], lengths: float = 0.0
    ) -> None:
        """Symmetry of a robot with a number of `cables`; `changes`: rows with their values."""
        # step: measurement that fixes the quantity
        # lengths: relative change of the lengths off the drums
        self.name, self.step, self.lengths = name, step, lengths
        # changes of the parameters, as rows of `kernels.calibration.kinds` (KIND_ROWS, m); of logarithms where
        # estimated
        self.change = np.zeros((kinds.KIND_ROWS, cables))
        for rows, values in changes:
            self.change[rows] = values


def _generators(robot: Robot, sensors: Sensors, turn: Array) -> Iterator[_Generator]:
    """Symmetries that have a name; turn: rotation vector (3,) of the measuring system [rad]."""
    m, winches, center, place = robot.cable_count, robot.winches, robot.center_of_mass, sensors.frame.position
    generator = partial(_Generator, m)
    # the linear density decreases, so that forces do not change
    scaled: list[tuple[Any, Array | float]] = [(_FRAME, robot.frame_anchors.T), (_PLATFORM, robot.platform_anchors.T)]
    scaled += [(kinds.DENSITY, -1.0)]
    if winches is not None:
        scaled += [(kinds.RADIUS, winches.pulley_radius), (kinds.DEAD, winches.dead_cable)]
    scaled += [(_CENTER, center[:, None]), (_SHIFT, place[:, None]), (_TARGET, sensors.target[:, None])]
    yield generator("the scale: a larger robot with lighter cables", _SCALE, *scaled, lengths=1.0)
    gain = 1.0 if winches is None else winches.load_cell_gain
    forces = ([kinds.DENSITY, kinds.STIFFNESS, kinds.MASS], 1.0)
    yield generator("larger forces, and load cells with a smaller gain", _FORCE, forces, (kinds.GAIN, -gain))
    up = np.array([0.0, 0.0, 1.0])
    turned = np.linalg.solve(left_jacobian(turn), up)[:, None]
    moved: list[tuple[Any, Array | float]] = [(_FRAME, np.cross(up, robot.frame_anchors).T), (_TURN, turned)]
    moved += [(_SHIFT, np.cross(up, place)[:, None]), (kinds.SWIVEL, -swivel_axes(robot)[:, 2])]
    if not has_slanted_axes(robot):  # the directions of these axes are known
        yield generator("the world turned about the vertical", _YAW, *moved)
    for axis, unit in zip("xyz", np.eye(3), strict=True):  # rotations and shifts about the center of mass
        anchors, target = np.cross(unit, robot.platform_anchors - center).T, np.cross(unit, sensors.target - center)
        changes = ((_PLATFORM, anchors), (_TARGET, target[:, None]))
        yield generator(f"the platform's frame turned about its {axis}", _TILT, *changes)
    if robot.freedom[:, 3:].any():
        for k, axis in enumerate("xyz"):
            rows = [kinds.PLATFORM + k, kinds.CENTER + k, kinds.TARGET + k]
            yield generator(f"the platform's frame shifted along its {axis}", _ORIGIN, (rows, 1.0))
    else:
        for cable in range(m):
            for k, axis in enumerate("xyz"):
                ends = ([kinds.FRAME + k, kinds.PLATFORM + k], cable)
                yield generator(f"both anchors of cable {cable} shifted along {axis}", _BOTH, (ends, 1.0))
    for k, axis in enumerate("xyz"):
        yield generator(f"the world shifted along {axis}", _WORLD, ([kinds.FRAME + k, kinds.SHIFT + k], 1.0))


def _symmetries(
    robot: Robot, sensors: Sensors, turn: Array, *, counted: bool
) -> tuple[tuple[_Generator, ...], Array, Array, Flags]:
    """Symmetries of a robot and its sensors, including changes of length zeros, drum radii and length scales."""
    # The argument `turn` is the rotation vector (3,) of the measuring system [rad]. Returns the symmetries with a name,
    # and three arrays. Array 1, (KIND_ROWS, m, g), is the change of each row of `kinds` by each of g symmetries. Array
    # 2, (2 m, g), is the length that the drums pay out minus the required length, zero for admissible combinations.
    # Array 3, (KIND_ROWS, m), is True for parameters that are constant if known.
    m, each = robot.cable_count, tuple(_generators(robot, sensors, turn))
    drums = np.zeros((kinds.KIND_ROWS, m, 3 * m))
    for k, row in enumerate((kinds.ZERO, kinds.DRUM, kinds.SCALE)):
        drums[row, np.arange(m), k * m + np.arange(m)] = 1.0
    table = np.concatenate((np.stack([one.change for one in each], axis=-1), drums), axis=-1)
    asked = np.concatenate(([one.lengths for one in each], np.zeros(3 * m)))
    shift, share = (np.einsum("rm,rmg->mg", term, table) for term in _length_terms(robot, counted))
    matters = np.ones((kinds.KIND_ROWS, m), dtype=np.bool_)
    matters[kinds.PER_CABLE : kinds.SCALE, 1:] = False
    # The pose of the measuring system and the target may change: a few measured points do not determine them.
    matters[kinds.SHIFT : kinds.SCALE] = False
    matters[kinds.INERTIA :] = False
    if sensors.swivel_deviation is None:
        matters[kinds.SWIVEL] = False
    if sensors.tension_deviation is None:
        matters[[kinds.GAIN, kinds.BIAS]] = False
    if not robot.freedom[:, 3:].any():  # a platform that cannot rotate: the center of mass has no effect
        matters[_CENTER] = False
    return each, table, np.concatenate((shift, share - asked)), matters


def _length_terms(robot: Robot, counted: bool) -> tuple[Array, Array]:
    """Derivatives a + b L of the lengths L off the drums by the rows of `kinds`: a [m] and b, each (KIND_ROWS, m)."""
    shift, share = np.zeros((2, kinds.KIND_ROWS, robot.cable_count))
    if not counted:
        shift[kinds.ZERO] = share[kinds.SCALE] = 1.0
        return shift, share
    drums = Drums(robot)
    stretch, zero = 1.0 + drums.rest_strain, drums.winches.length_zero
    radius, diameter, pitch = drums.winches.drum_radius, robot.cables.diameter, drums.winches.groove_pitch
    if zero is None or radius is None or diameter is None or pitch is None:  # counts give no lengths without these data
        raise InvalidValueError("robot", "without counts", "with drums and their zeros", "Give them in the robot file.")
    circle = (2.0 * np.pi * (radius + 0.5 * diameter)) ** 2
    by_radius = circle / (circle + pitch**2) * radius / (radius + 0.5 * diameter)  # by the logarithm
    shift[kinds.ZERO] = 1.0 / stretch
    shift[kinds.DRUM], share[kinds.DRUM] = -by_radius * zero / stretch, by_radius
    share[kinds.STIFFNESS] = drums.rest_strain / stretch
    return shift, share
