"""Pieces of broken cables with mass: compared with an independent integration of the nodes, and with conserved sums."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sagline as sl
from sagline.core.arrays import Array
from tests.dynamics.machines import prototype
from tests.refusal import refused

NODES, GRAVITY = 8, 9.81
DENSITY, STIFFNESS, MASS = 0.5, 2e4, 4.0
FREE, HELD = False, True


@cache
def at_rest() -> sl.Equilibrium:
    """A point mass in a vertical plane on two heavy, soft cables."""
    robot = sl.Robot(
        "pendulum",
        frame_anchors=[[-5, 0, 5], [4, 0, 5]],
        platform_anchors=np.zeros((2, 3)),
        cables=sl.Cable(linear_density=DENSITY, axial_stiffness=STIFFNESS),
        mass=MASS,
        motion_pattern="2T",
        plane_normal=[0, 1, 0],
    )
    return sl.forward(robot, [5.5, 4.8], start=sl.Pose([0.0, 0.0, 3.0], np.eye(3))).state


def broken(*places: float, loss_time: float = 0.0) -> sl.Simulation:
    """The robot after breaks of cable 1 at `places`."""
    return sl.simulate(
        at_rest(),
        duration=0.15,
        step=1e-5,
        cable_mass="lumped",
        nodes=NODES,
        events=[sl.Break(1, 0.0, position=place) for place in places],
        damping=sl.Damping(loss_time=loss_time),
    )


class Nodes(NamedTuple):
    """Point masses, the platform first, joined by elements that transmit only tension."""

    place: Array  # (n, 3)
    mass: Array  # (n,)
    held: Array  # flags (n,)
    pairs: Array  # nodes of the elements, (k, 2)
    length: Array  # unstrained lengths, (k,)


def nodes_of(run: sl.Simulation, *cuts: int) -> Nodes:
    """Platform and nodes of both cables at the start of `run`; the second cable is cut at its nodes `cuts`."""
    assert run.nodes is not None
    rows, pairs, length = [[run.pose.position[0], FREE]], [], []
    for cable, split in ((0, ()), (1, cuts)):
        for k in range(NODES + 1):
            last = len(rows) - 1
            here = 0 if k == NODES and k not in split else len(rows)
            if here:
                rows.append([run.nodes[0, cable, k], k == 0 and k not in split])
            if k > 0:
                pairs.append((last, here))
                length.append(float(at_rest().free_length[cable]) / NODES)
            if 0 < k < NODES and k in split:
                rows.append([run.nodes[0, cable, k], FREE])
    mass = np.append(MASS, np.zeros(len(rows) - 1))
    np.add.at(mass, np.array(pairs).ravel(), 0.5 * DENSITY * np.repeat(length, 2))
    place, held = (np.array(column) for column in zip(*rows, strict=True))
    return Nodes(place, mass, held, np.array(pairs), np.array(length))


def integrated(nodes: Nodes, times: Array, loss_time: float = 0.0) -> Array:
    """Positions of the nodes at `times`, (N, n, 3), by DOP853."""
    start, end = nodes.pairs.T

    def rates(_: float, y: Array) -> Array:
        x, v = y.reshape(2, -1, 3)
        along = x[end] - x[start]
        distance = np.linalg.norm(along, axis=1)
        along /= distance[:, None]
        strain = distance / nodes.length - 1.0
        opening = ((v[end] - v[start]) * along).sum(axis=1) / nodes.length
        size = np.where(strain > 0.0, np.maximum(STIFFNESS * (strain + loss_time * opening), 0.0), 0.0)
        total = np.zeros_like(x)
        np.add.at(total, start, size[:, None] * along)
        np.add.at(total, end, -size[:, None] * along)
        gain = total / nodes.mass[:, None] - [0.0, 0.0, GRAVITY]
        gain[nodes.held] = 0.0
        return np.concatenate((v.ravel(), gain.ravel()))

    begin = np.concatenate((nodes.place.ravel(), np.zeros(nodes.place.size)))
    found = solve_ivp(rates, (times[0], times[-1]), begin, "DOP853", times, rtol=1e-9, atol=1e-11)
    places: Array = found.y[: nodes.place.size].T.reshape(len(times), -1, 3)
    return places


# places of the breaks; nodes there, counted from the frame; points of the result that are nodes; their nodes
ENDS = range(-NODES - 1, 0)
CASES = {
    "platform end": ((1.0,), (8,), range(9), ENDS),
    "frame end": ((0.0,), (0,), range(9), (*range(-NODES, 0), 0)),
    "middle": ((0.5,), (4,), (0, 3, 5, 8), (-9, -5, -4, 0)),
    "both ends": ((0.0, 1.0), (0, 8), range(9), ENDS),
}


@pytest.mark.parametrize("case", CASES)
def test_platform_and_pieces_move_as_in_an_independent_integration(case: str) -> None:
    places, cuts, points, own = CASES[case]
    run = broken(*places)
    assert run.nodes is not None
    found = integrated(nodes_of(run, *cuts), run.time)
    fallen = np.abs(found - found[0]).max()
    assert fallen > 0.1
    assert np.abs(run.pose.position - found[:, 0]).max() < 1e-6 * fallen
    assert np.abs(run.nodes[1:, 1, points] - found[1:, own]).max() < 1e-5 * fallen
    assert np.isnan(run.nodes[1:, 1]).any() == (case == "middle")
    assert np.abs(run.energy.error).max() < 1e-6 * run.energy.kinetic.max()
    assert run.energy.removed == pytest.approx(0.0, abs=1e-9)  # the strain energy is released in the pieces
    assert np.isnan(run.length[1:, 1]).all()


def test_damped_pieces_move_as_in_an_independent_integration() -> None:
    """Both pieces of a cable, with losses in the stretch that reduce the recoil wave."""
    run = broken(0.5, loss_time=2e-3)
    found = integrated(nodes_of(run, 4), run.time, 2e-3)
    assert run.nodes is not None
    assert np.abs(run.nodes[1:, 1, [0, 3, 5, 8]] - found[1:, [-9, -5, -4, 0]]).max() < 1e-4
    assert np.abs(broken(0.5).nodes - run.nodes)[1:, 1, [3, 5]].max() > 3e-3  # type: ignore[operator]
    assert run.energy.lost[-1] > 0.01 * run.energy.kinetic.max()
    assert np.abs(run.energy.error).max() < 1e-3 * run.energy.lost[-1]


def test_the_center_of_a_free_piece_falls_with_g() -> None:
    run = broken(0.0, 1.0, loss_time=1e-4)
    assert run.nodes is not None
    share = np.append(np.append(0.5, np.ones(NODES - 1)), 0.5) / NODES
    center = np.einsum("npk,p->nk", run.nodes[:, 1], share)
    expected = center[0] - 0.5 * GRAVITY * run.time[:, None] ** 2 * [0.0, 0.0, 1.0]
    assert center == pytest.approx(expected, abs=1e-9)
    assert (run.tensions[1:, 1] == 0.0).all()


def test_a_piece_at_the_frame_comes_to_rest_hanging() -> None:
    damping = sl.Damping(loss_time=0.05, air_damping=2.0)
    given = {"cable_mass": "lumped", "nodes": NODES, "damping": damping, "duration": 20.0}
    run = sl.simulate(at_rest(), events=sl.Break(1, 0.5, position=0.25), **given)  # type: ignore[arg-type]
    assert run.nodes is not None
    element = float(at_rest().free_length[1]) / NODES
    assert run.tensions[-1, 1] == pytest.approx(2.0 * element * DENSITY * GRAVITY, rel=1e-3)
    gap = int(np.flatnonzero(np.isnan(run.nodes[-1, 1, :, 0]))[0])
    free_end = run.nodes[-1, 1, gap - 1]
    force = DENSITY * GRAVITY * element * np.array([1.5, 0.5])
    assert free_end == pytest.approx([4.0, 0.0, 5.0 - (element * (1.0 + force / STIFFNESS)).sum()], abs=1e-3)
    # the other cable carries the platform with its piece, and itself
    assert run.nodes[-1, 1, gap + 1, 2] < run.pose.position[-1, 2] - 5.0 * element
    weight = (MASS + DENSITY * (6.0 * element + at_rest().free_length[0])) * GRAVITY
    assert run.tensions[-1, 0] == pytest.approx(weight, rel=1e-3)


@pytest.mark.parametrize("place", [0.0, 0.4, 1.0])
def test_a_break_in_motion_changes_neither_energy_nor_its_balance(place: float) -> None:
    """A platform that translates and rotates, on cables whose nodes change while they are paid out."""
    path = sl.quintic_path([(0, 0, 1.5), (1.5, 1.0, 2.5)], durations=1.6, rate=200.0)
    plan = sl.inverse(sl.load_robot("cogiro"), path)
    events = [sl.Break(3, 0.8, position=place), sl.Break(3, 0.85, position=0.6)]
    run = sl.simulate(plan, cable_mass="lumped", nodes=10, duration=1.0, events=events, damping=sl.Damping(1e-5))
    moving = run.energy.kinetic.max()
    assert moving > 100.0
    assert np.abs(run.energy.removed).max() < 1e-9 * moving + 0.05 * (place == 0.0)  # speed of the entering cable
    assert np.abs(run.energy.error).max() < 1e-3 * moving
    assert run.nodes is not None
    gaps = np.isnan(run.nodes[-1, 3, :, 0]).sum()
    assert gaps == (2 if place == 0.4 else 1)


@pytest.mark.parametrize("winches", ["ideal", "robot"])
def test_a_break_at_the_frame_removes_the_strain_of_the_cable_behind_it(winches: str) -> None:
    robot = prototype(pulley_radius=0.03, dead_cable=1.0)
    state = sl.inverse(robot, sl.Pose.from_euler([0.1, 0.05, 1.0], 0.0, 0.0, 0.0)).state
    given = {"cable_mass": "lumped", "nodes": 6, "duration": 0.05, "winches": winches}
    run = sl.simulate(state, events=sl.Break(2, 0.01, position=0.0), **given)  # type: ignore[arg-type]
    tension, axial = run.tensions[0, 2], robot.cables.axial_stiffness[2]
    behind = state.unstrained_length[2] - state.free_length[2]
    assert run.energy.removed[-1] == pytest.approx(0.5 * tension**2 / axial * behind, rel=0.02)
    assert np.abs(run.energy.error).max() < 1e-2 * run.energy.kinetic.max()


@pytest.mark.parametrize(
    ("events", "cable_mass", "parts"),
    [
        (sl.Break(1, 0.0, position=1.5), "lumped", ("events[0]: position", "1.5", "0 to 1")),
        ([sl.Break(1, 0.0)] * 2, "none", ("events: cable 1", "broken before 0 s")),
        ([sl.Break(1, 0.0), sl.Stall(1, 0.05)], "lumped", ("events: cable 1", "broken before 0.05 s")),
        ([sl.Break(1, 0.0, position=0.5)] * 6, "lumped", ("cable 1: break", "broken into 3 pieces")),
    ],
)
def test_breaks_that_are_refused(events: object, cable_mass: sl.CableModel, parts: tuple[str, ...]) -> None:
    with refused(*parts):
        sl.simulate(at_rest(), duration=0.1, cable_mass=cable_mass, nodes=NODES, events=events)  # type: ignore[arg-type]
