"""Friction and sagging guides after the last pulley, compared with references written here."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize_scalar, root

import sagline as sl
from sagline.core.arrays import Array
from sagline.robot.drum import drum_tension
from sagline.robot.routing import kernel_length
from tests.tiers import extended

DENSITY, STIFFNESS, GRAVITY = 0.4, 5e4, 9.81
WEIGHT = DENSITY * GRAVITY
ANCHORS = np.array([[3.0, 0.0, 3.0], [-2.0, 2.0, 3.5], [-2.0, -2.0, 3.0]])
# eyelets from the drum on: slanted spans, a vertical one, a drum above
GUIDES = np.array(
    [
        [[4.0, 1.0, 0.0], [6.0, 0.5, 2.0]],
        [[-4.0, 4.0, 0.5], [-2.0, 2.0, 0.5]],
        [[-4.0, -5.0, 6.0], [-4.0, -2.0, 2.0]],
    ]
)


def tripod(**fields: Any) -> sl.Robot:
    return sl.Robot(
        "tripod",
        ANCHORS,
        np.zeros((3, 3)),
        sl.Cable(DENSITY, STIFFNESS),
        60.0,
        motion_pattern="3T",
        winches=sl.Winch(**fields),
    )


POSE = sl.Pose([0.2, 0.1, 1.0], np.eye(3))


def held(model: sl.CableModel | None = None, winding: Any = None, **fields: Any) -> sl.Equilibrium:
    plan = sl.inverse(tripod(**fields), POSE, model or sl.Catenary(), winding=winding)
    assert plan.feasible
    return plan.state


def contact_of(state: sl.Equilibrium) -> Any:
    assert state.contact is not None
    return state.contact


def catenary_ends(forces: Array, length: float) -> tuple[float, float]:
    """Span and rise of an elastic catenary from horizontal tension and vertical force at its upper end; Irvine 1981."""
    level, top = forces
    low = top - WEIGHT * length
    span = level / WEIGHT * (np.arcsinh(top / level) - np.arcsinh(low / level)) + level * length / STIFFNESS
    rise = (np.hypot(level, top) - np.hypot(level, low)) / WEIGHT + (top**2 - low**2) / (2.0 * STIFFNESS * WEIGHT)
    return span, rise


def vertical_length(rise: float, tension: float) -> tuple[float, float]:
    """Length of a vertical cable below its upper end, and its lower tension: rise = L + (T L - w L^2/2)/EA."""
    strained = 1.0 + tension / STIFFNESS
    length = 2.0 * rise / (strained + np.sqrt(strained**2 - 2.0 * WEIGHT * rise / STIFFNESS))
    return length, tension - WEIGHT * length


def catenary_length(step: Array, tension: float) -> tuple[float, float]:
    """Length of a catenary over a step with a given tension at its upper end, and the tension at the other end."""
    if np.hypot(step[0], step[1]) == 0.0:
        return vertical_length(float(step[2]), tension)
    level, top, length = catenary_forces(step, tension)
    return length, float(np.hypot(level, top - WEIGHT * length))


def catenary_forces(step: Array, tension: float) -> tuple[float, float, float]:
    """Horizontal tension, vertical force at the upper end, and length of that catenary."""
    span, rise = float(np.hypot(step[0], step[1])), float(step[2])
    chord = np.hypot(span, rise)

    def missed(unknown: Array) -> list[float]:
        level, top, length = unknown * [tension, tension, chord]
        found = catenary_ends(np.array([level, top]), length)
        return [found[0] - span, found[1] - rise, (np.hypot(level, top) - tension) / tension]

    start = [span / chord, (rise / chord) + 0.5 * WEIGHT * chord / tension, 1.0]
    solution = root(missed, start, tol=1e-15)
    assert np.abs(solution.fun).max() < 1e-12
    level, top, length = (float(x) for x in solution.x * [tension, tension, chord])
    return level, top, length


def steps_of(cable: int) -> Array:
    points = np.concatenate((GUIDES[cable], ANCHORS[cable : cable + 1]))
    found: Array = np.diff(points, axis=0)[::-1]
    return found


def test_spans_between_guides_are_catenaries_with_equal_tensions_at_guides() -> None:
    state = held(guides=GUIDES)
    drums = drum_tension(state)
    for i, tension in enumerate(state.cables.frame_end_tension):
        whole, end = 0.0, float(tension)
        for step in steps_of(i):
            length, end = catenary_length(step, end)
            whole += length
        assert contact_of(state).dead_length[i] == pytest.approx(whole, abs=2e-11)
        assert drums[i] == pytest.approx(end, rel=1e-10)
    np.testing.assert_array_equal(contact_of(state).wrapped_length, 0.0)


def energy(step: Array, length: float) -> float:
    """Energy of a catenary of given length over a step, zero at its upper end: weight and stretch, by quadrature."""
    span, rise = float(np.hypot(step[0], step[1])), float(step[2])

    def missed(forces: Array) -> Array:
        return np.array(catenary_ends(forces, length)) - [span, rise]

    level, top = root(missed, [100.0, 50.0 + 0.5 * WEIGHT * length], tol=1e-15).x

    def density(s: float) -> float:
        vertical = top - WEIGHT * (length - s)  # s from the lower end
        height = catenary_ends(np.array([level, top]), length - s)[1] if s < length else 0.0
        return float(0.5 * (level**2 + vertical**2) / STIFFNESS - WEIGHT * height)

    return float(quad(density, 0.0, length, epsabs=1e-12, epsrel=1e-12)[0])


def test_the_distribution_over_an_eyelet_has_the_least_energy() -> None:
    """The distribution of the dead length over the eyelet has the smallest energy of all distributions."""
    state = held(guides=GUIDES)
    first, second = steps_of(0)
    whole = float(contact_of(state).dead_length[0])
    near = catenary_length(first, float(state.cables.frame_end_tension[0]))[0]

    def cost(length: float) -> float:
        lowered = WEIGHT * (whole - length) * float(first[2])
        return energy(first, length) + energy(second, whole - length) - lowered

    best = minimize_scalar(cost, bounds=(near - 2e-3, near + 2e-3), method="bounded", options={"xatol": 1e-9}).x
    assert best == pytest.approx(near, abs=2e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_on_the_pulley_is_that_of_the_differential_equation(sign: float) -> None:
    """dT = mu T dpsi along the wrap, and R dpsi/(1 + T/EA) of unstrained cable: weightless, by integration."""
    radius, mu, share, dead = 0.3, 0.2, 0.05, 4.0
    fields = {"pulley_radius": radius, "pulley_friction": mu, "rolling_friction": share, "dead_cable": dead}
    state = held(sl.Elastic(), np.full(3, sign), **fields)
    contact = contact_of(state)
    for i, tension in enumerate(state.cables.frame_end_tension):

        def along(_: float, y: Array) -> list[float]:
            return [sign * mu * y[0], radius / (1.0 + y[0] / STIFFNESS)]

        end = solve_ivp(along, (0.0, contact.wrap_angle[i]), [tension, 0.0], rtol=1e-13, atol=1e-13, method="DOP853")
        behind, wrapped = end.y[:, -1]
        behind *= 1.0 + sign * share
        assert contact.wrapped_length[i] == pytest.approx(wrapped, abs=1e-12)
        assert contact.dead_length[i] == pytest.approx(dead / (1.0 + behind / STIFFNESS), abs=1e-11)
        assert drum_tension(state)[i] == pytest.approx(behind, rel=1e-10)


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_friction_of_a_bend_depends_on_its_angle(radius: float) -> None:
    """Weightless cables with straight spans and known bends; at an eyelet from the span to the free cable."""
    mu = 0.15
    state = held(sl.Elastic(), np.ones(3), pulley_radius=radius, pulley_friction=mu, guides=GUIDES)
    for i, tension in enumerate(state.cables.frame_end_tension):
        onward, exit_ = steps_of(i)[::-1], state.exit_point[i]
        units = [step / np.linalg.norm(step) for step in onward]
        away = POSE.position - exit_
        away /= np.linalg.norm(away)
        up = np.array([0.0, 0.0, 1.0])
        at_anchor = [np.arccos(units[1] @ up), np.arccos(up @ away)] if radius else [np.arccos(units[1] @ away)]
        near = tension * np.exp(mu * sum(at_anchor))
        far = near * np.exp(mu * np.arccos(units[0] @ units[1]))
        lengths = np.linalg.norm(onward, axis=1)
        expected = lengths[1] / (1.0 + near / STIFFNESS) + lengths[0] / (1.0 + far / STIFFNESS)
        assert contact_of(state).dead_length[i] == pytest.approx(expected, abs=1e-11)
        assert drum_tension(state)[i] == pytest.approx(far, rel=1e-9)


def between(one: Array, other: Array) -> float:
    return float(np.arccos(one @ other / np.linalg.norm(one) / np.linalg.norm(other)))


def test_bends_are_those_of_sagging_cables() -> None:
    """Heavy cables: tensions from bends and bends from tensions in turn, with spans by a root finder."""
    mu = 0.15
    state = held(None, np.ones(3), pulley_friction=mu, guides=GUIDES)
    for i in (0, 2):
        near, far = steps_of(i)
        cables = state.cables
        vertical = cables.vertical_force[i] - WEIGHT * cables.unstrained_length[i]
        level = (POSE.position - ANCHORS[i])[:2]
        leaving = np.append(cables.horizontal_tension[i] * level / np.linalg.norm(level), vertical)
        first = second = 0.0
        for _ in range(40):
            entering = np.linalg.norm(leaving) * np.exp(mu * first)
            level_1, top_1, length_1 = catenary_forces(near, float(entering))
            low_1 = top_1 - WEIGHT * length_1
            level_2, top_2, length_2 = catenary_forces(far, float(np.hypot(level_1, low_1) * np.exp(mu * second)))
            along_1, along_2 = (step[:2] / np.linalg.norm(step[:2]) for step in (near, far))
            first = between(np.append(level_1 * along_1, top_1), leaving)
            second = between(np.append(level_2 * along_2, top_2), np.append(level_1 * along_1, low_1))
        assert contact_of(state).dead_length[i] == pytest.approx(length_1 + length_2, abs=5e-11)
        drum = np.hypot(level_2, top_2 - WEIGHT * length_2)
        assert drum_tension(state)[i] == pytest.approx(drum, rel=1e-9)


def test_winding_in_increases_the_tension_at_the_drum() -> None:
    fields = {"pulley_radius": 0.1, "pulley_friction": 0.1, "guides": GUIDES}
    none, in_, out, mixed = (held(None, w, **fields) for w in (None, np.ones(3), -np.ones(3), np.array([1.0, -1, 0])))
    drums = [drum_tension(state) for state in (out, none, in_)]
    assert (np.diff(drums, axis=0) > 1.0).all()
    lengths = [state.unstrained_length for state in (in_, none, out)]
    assert (np.diff(lengths, axis=0) > 0.0).all()  # a higher tension means less unstrained cable in the same place
    picked = [in_.unstrained_length[0], out.unstrained_length[1], none.unstrained_length[2]]
    np.testing.assert_allclose(mixed.unstrained_length, picked, rtol=0.0, atol=1e-14)
    for state in (in_, out, mixed):
        np.testing.assert_array_equal(state.chord_tension, none.chord_tension)
        np.testing.assert_array_equal(state.free_length, none.free_length)


@pytest.mark.parametrize("model", [sl.Straight(), sl.Elastic(), sl.Parabolic(), sl.Empirical()])
def test_weightless_guides_are_straight(model: sl.CableModel) -> None:
    guided = held(model, guides=GUIDES)
    winches = guided.one_robot.winches
    assert winches is not None
    straight = sl.inverse(guided.one_robot.replace(winches=winches.replace(guides=None)), POSE, model)
    np.testing.assert_allclose(guided.unstrained_length, straight.unstrained_length, rtol=0.0, atol=1e-13)


@extended
def test_the_energy_neglects_friction_and_sag_of_guides() -> None:
    """Stiffness and sensitivities are those of straight guides at the same pose and tensions."""
    state = held(None, np.ones(3), pulley_radius=0.1, pulley_friction=0.2, guides=GUIDES)
    winches = state.one_robot.winches
    assert winches is not None
    plain = sl.inverse(state.one_robot.replace(winches=winches.replace(guides=None)), POSE).state
    np.testing.assert_allclose(kernel_length(state), plain.unstrained_length, rtol=0.0, atol=1e-13)
    assert np.abs(state.unstrained_length - plain.unstrained_length).min() > 1e-4
    ours, theirs = sl.stiffness(state), sl.stiffness(plain)
    np.testing.assert_allclose(ours.matrix, theirs.matrix, rtol=1e-9)
    np.testing.assert_allclose(ours.length_sensitivity, theirs.length_sensitivity, rtol=1e-9, atol=1e-12)


def test_a_cable_that_is_too_slack_between_guides_has_no_solution() -> None:
    """Below 0.754 w D, the least end tension of a level catenary, the cable would run off the drum by itself."""
    level = ANCHORS + 60.0 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    light = {"mass": 12.0, "cables": sl.Cable(DENSITY, STIFFNESS)}
    robot = tripod(guides=level[:, None]).replace(**light)
    plan = sl.inverse(robot, POSE)
    assert plan.status == sl.PoseStatus.TOO_SLACK
    assert np.isnan(plan.unstrained_length).all()
    assert np.isnan(plan.chord_tension).all()
    run = tripod(dead_cable=60.0).replace(**light)
    held_straight = sl.inverse(run, POSE)
    assert held_straight.state.cables.frame_end_tension.min() < 0.754 * WEIGHT * 60.0
    heavy = sl.inverse(tripod(guides=level[:, None]).replace(mass=120.0), POSE)
    assert heavy.state.cables.frame_end_tension.min() > 0.754 * WEIGHT * 60.0
    assert heavy.feasible


@extended
def test_forward_does_not_converge_if_a_cable_is_too_slack_between_guides() -> None:
    level = ANCHORS + 60.0 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    light = {"mass": 12.0, "cables": sl.Cable(DENSITY, STIFFNESS)}
    held_straight = sl.inverse(tripod(dead_cable=60.0).replace(**light), POSE)
    robot = tripod(guides=level[:, None]).replace(**light)
    found = sl.forward(robot, held_straight.unstrained_length, start=POSE)
    assert found.status == sl.ForwardStatus.NOT_CONVERGED
