"""Cables over pulleys that swivel about axes of any direction: energy, force and stiffness of the kernels."""

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import quad
from scipy.optimize import fsolve

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import forces, geometry, stiffness, swivel
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.swivel import DATA, SLOPES
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CABLE_SOLVED, CATENARY
from tests.kernels.compiled import compiled, from_python

cable_geometry = from_python(geometry.cable_geometry)
cable_forces = from_python(forces.forces_from_lengths)
cable_stiffnesses = from_python(stiffness.stiffnesses_in_plane)
slopes_of_swivel = from_python(swivel.slopes_of_swivel)
energy_of_cables = stiffness.energy_of_cables

MODEL = Model(CATENARY, 0.0, 0.0, 9.81, True)
SIX = (g.W_XX, g.W_XY, g.W_XZ, g.W_XY, g.W_YY, g.W_YZ, g.W_XZ, g.W_YZ, g.W_ZZ)
BODY, ORIGIN = np.array([1.0, 9.81, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def chords(cables: Array, ends: Array) -> Array:
    """Rows of cables from anchors at the origin to platform ends (count, 3), with the tangents to the pulleys."""
    cables[:, tables.PLATFORM_X : tables.PLATFORM_X + 3] = ends
    rows = np.full((g.CABLE_ROWS, len(cables)), np.nan)
    cable_geometry(cables, BODY, ORIGIN, np.empty((3, 3)), rows)
    return rows


def solved(cables: Array, ends: Array, lengths: Array) -> Array:
    """Rows of cables at platform ends (count, 3) relative to the anchors, with stiffnesses."""
    rows = chords(cables, ends)
    rows[g.LENGTH] = lengths
    cable_forces(MODEL, cables, rows, True)
    cable_stiffnesses(MODEL, cables, rows, True)
    return rows


def forces_of(rows: Array) -> Array:
    level = rows[g.HORIZONTAL]
    return np.stack((level * rows[g.AZIMUTH_X], level * rows[g.AZIMUTH_Y], rows[g.VERTICAL]), axis=-1)


def _each_energy(model: Model, cables: Array, rows: Array, found: Array) -> None:
    for i in range(cables.shape[0]):
        found[i] = energy_of_cables(model, cables[i : i + 1], rows[:, i : i + 1], True)[0]


each_energy = compiled(_each_energy)


def energies(cables: Array, rows: Array) -> Array:
    """Energy of each cable, with its height measured from the anchor."""
    found = np.empty(len(cables))
    each_energy(MODEL, cables, rows, found)
    return found


def random_cables(count: int, seed: int) -> tuple[Array, Array, Array]:
    """Tables, platform ends relative to the anchors, and lengths off the drum."""
    rng = np.random.default_rng(seed)
    cables = np.zeros((count, tables.SWIVEL_COLUMNS))
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    cables[:, tables.AXIS_X :] = axes
    cables[:, tables.ENTRY] = np.nan
    cables[:, tables.PULLEY_RADIUS] = rng.uniform(0.01, 0.1, count)
    cables[:, tables.DEAD_CABLE] = rng.choice([0.0, 1.0, 5.0], count)
    cables[:, tables.DEAD_RISE] = cables[:, tables.DEAD_CABLE] * rng.uniform(-1.0, 1.0, count)
    weight = 10 ** rng.uniform(-1.0, 0.5, count)
    cables[:, tables.DENSITY] = weight / MODEL.gravity
    side = np.cross(axes, rng.normal(size=(count, 3)))
    side /= np.linalg.norm(side, axis=1)[:, None]
    distance, angle = rng.uniform(1.0, 10.0, count), rng.uniform(0.15, 2.6, count)
    ends = distance[:, None] * (np.sin(angle)[:, None] * side + np.cos(angle)[:, None] * axes)
    sag = 10 ** rng.uniform(-2.5, -0.5, count)  # wD/(2 tau)
    tension = 0.5 * weight * distance / sag
    cables[:, tables.STIFFNESS] = tension / 10 ** rng.uniform(-4, -2.3, count)
    rows = chords(cables, ends)
    along = np.stack((rows[g.AZIMUTH_X] * rows[g.COSINE], rows[g.AZIMUTH_Y] * rows[g.COSINE], rows[g.SINE]), axis=1)
    turn = np.arccos((along * axes).sum(axis=1))
    free = rows[g.CHORD] * (1.0 + (sag * rows[g.COSINE]) ** 2 / 6.0)
    whole = free + cables[:, tables.PULLEY_RADIUS] * turn + cables[:, tables.DEAD_CABLE]
    return cables, ends, whole / (1.0 + tension / cables[:, tables.STIFFNESS])


def test_force_is_the_gradient_of_the_energy_and_stiffness_of_the_force() -> None:
    cables, ends, lengths = random_cables(2000, seed=4)
    rows = solved(cables, ends, lengths)
    assert (rows[g.STATUS] == CABLE_SOLVED).all()
    force, size = forces_of(rows), np.abs(energies(cables, rows))
    tension = np.linalg.norm(force, axis=1)
    # a step changes the tension by a small part; differences of sixth order
    step = 2e-3 * tension * lengths / cables[:, tables.STIFFNESS]
    gradient, matrix = np.zeros((2000, 3)), np.zeros((2000, 3, 3))
    for k, axis in enumerate(np.eye(3)):
        for times, weight in {1: 45.0 / 60.0, 2: -9.0 / 60.0, 3: 1.0 / 60.0}.items():
            for sign in (1.0, -1.0):
                moved = solved(cables, ends + (sign * times * step)[:, None] * axis, lengths)
                gradient[:, k] += sign * weight / step * energies(cables, moved)
                matrix[:, :, k] += (sign * weight / step)[:, None] * forces_of(moved)
    miss = np.linalg.norm(gradient - force, axis=1) / tension
    own = rows[list(SIX)].T.reshape(-1, 3, 3)
    wrong = np.linalg.norm(matrix - own, axis=(1, 2)) / np.linalg.norm(own, axis=(1, 2))
    # the model neglects the square of the side angle at the exit, which is at most about wR/T
    heavy = cables[:, tables.DENSITY] * MODEL.gravity * cables[:, tables.PULLEY_RADIUS] / tension
    noise = (size + tension * lengths) * 1e-16 / step / tension
    assert (miss < 4.0 * (noise + heavy**2)).all()  # 2.0
    assert (wrong < 6.0 * (noise + heavy**2)).all()  # 2.4
    assert np.median(miss) < 2e-9
    light = heavy < 1e-4
    assert light.sum() > 200
    assert max(miss[light].max(), wrong[light].max()) < 6e-9  # rounding: 3.3e-9


def exact_end(
    axis: Array, radius: float, weight: float, stiffness: float, force: Array, free: float
) -> tuple[Array, float]:
    """Platform end and whole length of a cable with the force `force` at its exit point, by quadrature and roots."""
    up = np.array([0.0, 0.0, 1.0])
    first = np.cross(axis, up if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    tension = float(np.linalg.norm(force))

    def frame(turn: float) -> tuple[Array, Array]:
        outward = np.cos(turn) * first + np.sin(turn) * np.cross(axis, first)
        return outward, np.cross(axis, outward)

    def along(turn: float, wrap: float, of: Callable[[float, float], float]) -> float:
        """Integral over the unstrained cable on the pulley of a function of angle and height."""
        outward, _ = frame(turn)

        def height(angle: float) -> float:
            return radius * float((1.0 - math.cos(angle)) * outward[2] + math.sin(angle) * axis[2])

        whole = tension + 0.5 * tension**2 / stiffness - weight * height(wrap)

        def part(angle: float) -> float:
            stretch = math.sqrt(1.0 + 2.0 * (whole + weight * height(angle)) / stiffness)
            return radius * of(angle, height(angle)) / stretch

        return float(quad(part, 0.0, wrap, epsabs=1e-15, epsrel=1e-13)[0])

    def unbalanced(unknowns: Array) -> tuple[float, float]:
        turn, wrap = (float(number) for number in unknowns)
        outward, sideways = frame(turn)
        moment = weight * along(turn, wrap, lambda angle, _: radius * (1.0 - math.cos(angle))) * sideways[2]
        normal = math.sin(wrap) * axis - math.cos(wrap) * outward
        return float(force @ normal) / tension, (radius * (1.0 - math.cos(wrap)) * float(force @ sideways) - moment) / (
            tension * radius
        )

    flat = force - (force @ axis) * axis
    start = math.atan2(flat @ np.cross(axis, first), flat @ first), math.atan2(np.linalg.norm(flat), force @ axis)
    turn, wrap = fsolve(unbalanced, start, xtol=1e-12)
    outward, _ = frame(turn)
    exit_point = radius * ((1.0 - math.cos(wrap)) * outward + math.sin(wrap) * axis)
    level, below = math.hypot(force[0], force[1]), force[2]
    above = below + weight * free
    span = level * free / stiffness + level / weight * (math.asinh(above / level) - math.asinh(below / level))
    rise = 0.5 * (above + below) * free / stiffness + (math.hypot(level, above) - math.hypot(level, below)) / weight
    end = exit_point + np.array([span * force[0] / level, span * force[1] / level, rise])
    return end, free + along(turn, wrap, lambda *_: 1.0)


def test_forces_are_those_of_a_cable_integrated_along_its_pulley() -> None:
    rng = np.random.default_rng(6)
    count, radius, weight, stiffness = 40, 0.06, 1.5, 4e4
    cables = np.zeros((count, tables.SWIVEL_COLUMNS))
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    axes[0] = [1.0, 0.0, 0.0]
    cables[:, tables.AXIS_X :], cables[:, tables.ENTRY] = axes, np.nan
    cables[:, tables.PULLEY_RADIUS], cables[:, tables.STIFFNESS] = radius, stiffness
    cables[:, tables.DENSITY] = weight / MODEL.gravity
    force, ends, lengths = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    for i in range(count):
        side = np.cross(axes[i], rng.normal(size=3))
        angle = rng.uniform(0.2, 2.6)
        at_exit = rng.uniform(40.0, 400.0) * (math.sin(angle) * side / np.linalg.norm(side) + math.cos(angle) * axes[i])
        free = rng.uniform(2.0, 6.0)
        ends[i], lengths[i] = exact_end(axes[i], radius, weight, stiffness, at_exit, free)
        force[i] = at_exit + np.array([0.0, 0.0, weight * free])
    rows = solved(cables, ends, lengths)
    miss = np.linalg.norm(forces_of(rows) - force, axis=1) / np.linalg.norm(force, axis=1)
    assert (rows[g.STATUS] == CABLE_SOLVED).all()
    assert miss.max() < 1e-9  # 1.7e-10


def total_slopes(cables: Array, rows: Array) -> Array:
    """Derivatives of force, tension at the exit point and swivel angle at a fixed platform end, (DATA, count, 5)."""
    each = np.zeros((len(cables), SLOPES, 5))
    for i, slopes in enumerate(each):
        slopes_of_swivel(MODEL, cables, rows, i, slopes)
    each[:, :DATA, 3:] += each[:, :DATA, :3] @ each[:, DATA:, 3:]
    return np.moveaxis(each[:, :DATA], 1, 0)


def test_slopes_by_the_data_of_a_cable_are_those_of_differences() -> None:
    count = 600
    cables, ends, lengths = random_cables(count, seed=8)
    rows = solved(cables, ends, lengths)
    center = rows[[g.CENTER_X, g.CENTER_Y, g.CENTER_Z]].T
    sideways, tension = np.cross(cables[:, tables.AXIS_X :], center), np.linalg.norm(forces_of(rows), axis=1)
    weight = cables[:, tables.DENSITY] * MODEL.gravity
    soft = 2e-3 * rows[g.LEAVING] * lengths / cables[:, tables.STIFFNESS]  # changes the tension by a small part [m]
    steps = {
        None: soft,
        tables.DENSITY: 1e-3 * cables[:, tables.DENSITY] * np.minimum(1.0, 0.1 * tension / (weight * lengths)),
        tables.STIFFNESS: 1e-3 * cables[:, tables.STIFFNESS],
        tables.PULLEY_RADIUS: np.minimum(soft, 0.02 * cables[:, tables.PULLEY_RADIUS]),
        tables.DEAD_CABLE: soft,
    }
    heavy = weight * cables[:, tables.PULLEY_RADIUS] / tension
    for (column, step), found in zip(steps.items(), total_slopes(cables, rows), strict=True):
        wanted = np.zeros((count, 5))
        for times, share in {1: 45.0 / 60.0, 2: -9.0 / 60.0, 3: 1.0 / 60.0}.items():
            for sign in (1.0, -1.0):
                changed, longer = cables.copy(), lengths.copy()
                by = sign * times * step
                if column is None:
                    longer += by
                else:
                    changed[:, column] += by
                moved = solved(changed, ends, longer)
                turned = moved[[g.CENTER_X, g.CENTER_Y, g.CENTER_Z]].T
                angle = np.arctan2((sideways * turned).sum(axis=1), (center * turned).sum(axis=1))
                now = np.column_stack((forces_of(moved), moved[g.LEAVING], angle))
                wanted += (sign * share / step)[:, None] * now
        for part, size in ((slice(0, 4), tension), (slice(4, 5), np.ones(count))):
            off = np.linalg.norm(found[:, part] - wanted[:, part], axis=1)
            whole, noise = np.linalg.norm(wanted[:, part], axis=1), 1e-12 * size / step
            assert (off < noise + (1e-8 + 40.0 * heavy**2) * whole).all(), column  # neglected terms, as above
            assert np.median(off / whole) < 2e-8, column
