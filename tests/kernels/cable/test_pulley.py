"""The routed part of a cable compared with quadrature, and cables over pulleys in both directions."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.cable import forces, geometry, models, pulley, states
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.pulley import Wrap
from sagline.kernels.cable.terms import Chord, Material, Model, Pulley
from sagline.kernels.codes import CABLE_SOLVED, CATENARY
from tests.kernels.compiled import from_python

tangent = from_python(geometry.tangent)
behind = from_python(pulley.behind)
softness = from_python(pulley.softness)
energy_behind = from_python(pulley.energy_behind)
behind_cable = from_python(pulley.behind_cable)
solve_cable_state = from_python(states.solve_cable_state)
free_span, free_rise = from_python(pulley.free_span), from_python(pulley.free_rise)
from_tension = from_python(models.from_tension)
cable_forces = from_python(forces.forces_from_lengths)
series = from_python(forces.stiffness_in_series)

GRAVITY = 9.81
WEIGHT, EA = 8.0, 3e4  # N/m, N: heavy and soft, so that all terms are visible

PULLEYS = [
    Pulley(0.05, 1.0, 0.0, 0.0),
    Pulley(0.2, -1.0, 0.0, 0.0),
    Pulley(0.0, 1.0, 3.0, 2.5),
    Pulley(0.1, 1.0, 4.0, -4.0),
    Pulley(0.15, -1.0, 2.0, 1.0),
]


def wrap(angle: float) -> Wrap:
    return Wrap(math.sin(angle), math.cos(angle), angle)


def along(over: Pulley, tension: float, angle: float, of: Callable[[float, float], float]) -> tuple[float, float]:
    """Integrals over the stretched length on the pulley and behind it of a function of tension and height above A.

    T + T^2/(2 EA) - w z is one number all along.
    """
    radius, entry, dead, rise = over
    whole = tension + 0.5 * tension**2 / EA - WEIGHT * entry * radius * math.sin(angle)

    def at(height: float) -> float:
        return of(EA * (math.sqrt(1.0 + 2.0 * (whole + WEIGHT * height) / EA) - 1.0), height)

    wrapped = quad(lambda a: radius * at(entry * radius * math.sin(a)), 0.0, angle, epsabs=1e-14, epsrel=1e-13)[0]
    run = quad(lambda s: dead * at(-rise * (1.0 - s)), 0.0, 1.0, epsabs=1e-14, epsrel=1e-13)[0]
    return wrapped, run


@pytest.mark.parametrize("over", PULLEYS)
@pytest.mark.parametrize("angle", [0.3, 1.6, 2.9])
@pytest.mark.parametrize("tension", [60.0, 2500.0])
def test_length_compliance_and_energy_of_the_routing_are_integrals(over: Pulley, angle: float, tension: float) -> None:
    neglected = 2.0 * over.radius * (WEIGHT * over.radius / EA) ** 2
    lengths = along(over, tension, angle, lambda force, _: 1.0 / (1.0 + force / EA))
    np.testing.assert_allclose(behind(over, WEIGHT, EA, tension, wrap(angle)), lengths, rtol=1e-13, atol=neglected)
    soft = sum(along(over, tension, angle, lambda force, _: 1.0 / (EA * (1.0 + force / EA) ** 3)))
    first_order = (
        3.0 * WEIGHT * over.radius / EA * over.radius / EA
    )  # in powers of beta: the share of the pulley is evaluated at P
    assert softness(over, WEIGHT, EA, tension, wrap(angle)) == pytest.approx(soft, rel=1e-12, abs=4.0 * first_order)
    strain_and_height = along(
        over, tension, angle, lambda force, z: (0.5 * force**2 / EA + WEIGHT * z) / (1.0 + force / EA)
    )
    free = 5.0
    lifted = WEIGHT * free * over.entry * over.radius * math.sin(angle)
    found = energy_behind(over, WEIGHT, EA, tension, wrap(angle), free)
    assert found == pytest.approx(sum(strain_and_height) + lifted, rel=1e-12, abs=20.0 * EA * neglected + 1e-12)


def test_the_chord_touches_the_pulley_on_the_side_of_the_cable() -> None:
    rng = np.random.default_rng(1)
    touched = 0
    for _ in range(2000):
        radius, entry = rng.uniform(0.005, 0.5), float(rng.choice([-1.0, 1.0]))
        end = np.array([rng.uniform(0.0, 3.0), rng.uniform(-3.0, 3.0)])
        chord, sine, cosine = tangent(radius, entry, *end)
        center = np.array([radius, 0.0])
        away = math.hypot(*(end - center))
        hangs = entry * end[1] < 0.0
        if away <= radius or (hangs and end[0] <= 2.0 * radius):
            assert math.isnan(chord)
            assert math.isnan(sine)
            assert math.isnan(cosine)
            continue
        touched += 1
        line = chord * np.array([cosine, sine])
        foot = end - line
        assert math.hypot(*(foot - center)) == pytest.approx(radius, rel=1e-12)
        assert line @ (foot - center) == pytest.approx(0.0, abs=1e-13)
        # the cable comes up (down) at the anchor, the origin, and turns toward the platform end by this angle
        angle = math.atan2(cosine, entry * sine)
        np.testing.assert_allclose(
            foot, radius * np.array([1.0 - math.cos(angle), entry * math.sin(angle)]), atol=1e-13
        )
    assert touched > 1000


def test_steep_slack_cables_leave_pulleys_in_the_direction_of_their_force() -> None:
    rng = np.random.default_rng(4)
    model, material, over = Model(CATENARY, 0.0, 0.0, GRAVITY), Material(0.2, 300.0), Pulley(0.15, 1.0, 0.0, 0.0)
    weight = material.density * GRAVITY
    for _ in range(300):
        line = Chord(*(float(x) for x in tangent(0.15, 1.0, rng.uniform(0.15, 0.5), rng.uniform(0.9, 3.0))))
        tension = 0.5 * weight * (line.length + 2.0 * over.radius) / rng.uniform(2.5, 5.0)
        free, sag_force, status = solve_cable_state(model, line, material, over, tension)
        assert status == CABLE_SOLVED
        horizontal, vertical = tension * line.cosine, tension * line.sine + sag_force
        angle = math.atan2(horizontal, vertical - weight * free)
        span, rise = free_span(over, line, math.cos(angle)), free_rise(over, line, math.sin(angle))
        own = math.hypot(span, rise)
        assert span > 0.0
        length, again, _ = from_tension(model, Chord(own, rise / own, span / own), material, horizontal * own / span)
        assert length == pytest.approx(free, rel=1e-9)
        assert horizontal * rise / span + again == pytest.approx(vertical, abs=1e-9)


def lengths_and_recovered_tensions(count: int, seed: int) -> tuple[Array, Array, Array, Array]:
    """Lengths of random cables over pulleys at chord tensions, and the tensions of these lengths.

    Returns their chord tensions, those found, what conditioning lets one expect of them, and the statuses.
    """
    rng = np.random.default_rng(seed)
    model = Model(CATENARY, 0.0, 0.0, GRAVITY)
    cables = np.zeros((count, tables.CABLE_COLUMNS))
    cables[:, tables.DENSITY] = 10 ** rng.uniform(-2, 0.5, count)
    cables[:, tables.PULLEY_RADIUS] = rng.choice([0.0, 0.005, 0.05, 0.2], count)
    cables[:, tables.ENTRY] = rng.choice([-1.0, 1.0], count)
    cables[:, tables.DEAD_CABLE] = rng.choice([0.0, 1.0, 5.0], count)
    cables[:, tables.DEAD_RISE] = cables[:, tables.DEAD_CABLE] * rng.uniform(-1.0, 1.0, count)
    chord, slope = 10 ** rng.uniform(0.3, 1.7, count), rng.uniform(-1.4, 1.4, count)
    half_weight = 0.5 * cables[:, tables.DENSITY] * GRAVITY * chord
    tension = half_weight / 10 ** rng.uniform(-3, 0.0, count)  # X up to 1
    cables[:, tables.STIFFNESS] = tension / 10 ** rng.uniform(-5, -1.3, count)
    rows = np.full((g.CABLE_ROWS, count), np.nan)
    rows[geometry.CHORD], rows[geometry.SINE], rows[geometry.COSINE] = chord, np.sin(slope), np.cos(slope)
    rows[geometry.SPAN], rows[geometry.RISE] = chord * np.cos(slope), chord * np.sin(slope)
    for i in range(count):
        over = Pulley(*(float(x) for x in cables[i, tables.PULLEY_RADIUS :]))
        line = Chord(float(chord[i]), math.sin(slope[i]), math.cos(slope[i]))
        material = Material(float(cables[i, tables.DENSITY]), float(cables[i, tables.STIFFNESS]))
        free, sag_force, status = solve_cable_state(model, line, material, over, float(tension[i]))
        assert status == CABLE_SOLVED
        horizontal, weight = tension[i] * line.cosine, material.density * GRAVITY
        vertical = tension[i] * line.sine + sag_force
        for _ in range(30):  # until free and wrapped length belong to one angle to the last digit
            angle = math.atan2(horizontal, over.entry * (vertical - weight * free))
            span, rise = free_span(over, line, math.cos(angle)), free_rise(over, line, math.sin(angle))
            own = math.hypot(span, rise)
            taut = horizontal * own / span
            free, sag_force, status = from_tension(model, Chord(own, rise / own, span / own), material, taut)
            vertical = taut * rise / own + sag_force
        leaving = math.hypot(horizontal, vertical - weight * free)
        rows[g.LENGTH, i] = free + sum(behind_cable(model, material, over, leaving, wrap(angle)))
    for _ in range(8):  # from the previous pose, like the steps of the platform
        cable_forces(model, cables, rows, True)
    # rounding of the length changes the tension by the chord stiffness of the free span in series
    stiff = 1.0 / (chord / cables[:, tables.STIFFNESS] + chord * (half_weight * np.cos(slope) / tension) ** 2 / tension)
    expected = np.finfo(float).eps * (stiff * rows[g.LENGTH] + tension)
    return tension, rows[g.TENSION], expected, rows[g.STATUS]


def test_tensions_over_pulleys_are_recovered_from_lengths() -> None:
    tension, found, expected, statuses = lengths_and_recovered_tensions(2000, seed=2)
    assert (statuses == CABLE_SOLVED).all()
    assert (np.abs(found - tension) / expected).max() < 16.0  # 7


@pytest.mark.soak
def test_tensions_of_many_cables_over_pulleys_are_recovered_from_lengths() -> None:
    tension, found, expected, statuses = lengths_and_recovered_tensions(38_000, seed=3)
    assert (statuses == CABLE_SOLVED).all()
    assert (np.abs(found - tension) / expected).max() < 16.0  # 8.9; 99 in 100 are below 4.5
