"""Unidentifiable directions, counted by differences of forward solutions, with their names."""

from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.findings import Direction
from sagline.calibration.identifiability import _numerical_rank, append_rows, gauge_of
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.calibration.parameters import KINDS, Parameters, PriorUnits
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.machines import Standing, robots, standing, with_drums
from tests.calibration.reference import Machine, pose_rows
from tests.tiers import extended

POSES = 16
ANCHORS = ("frame_anchors", "platform_anchors", "length_zero")
CABLE = ("linear_density", "axial_stiffness")
BODY = ("mass", "center_of_mass")
ALL = (*ANCHORS, "drum_radius", *CABLE, *BODY)  # 63 of the CoGiRo
SHARED = ("drum_radius", *CABLE, "pulley_radius")

SHIFT = tuple(f"the world shifted along {axis}" for axis in "xyz")
YAW = ("the world turned about the vertical",)
TURNS = tuple(f"the platform's frame turned about its {axis}" for axis in "xyz")
SHIFTS = tuple(f"the platform's frame shifted along its {axis}" for axis in "xyz")
SCALE = ("the scale: a larger robot with lighter cables",)
FORCE = ("larger forces, and load cells with a smaller gain",)
BOTH = tuple(f"both anchors of cable {cable} shifted along {axis}" for cable in range(4) for axis in "xyz")


class Case(NamedTuple):
    """Unknowns, sensors and the expected unidentifiable directions."""

    robot: str
    unknowns: tuple[str, ...]
    names: tuple[str, ...]  # number of the directions in any order, and the beginnings of their names
    fixed: tuple[str, ...] = ()  # beginnings of the labels of known parameters
    cells: bool = True
    positions: int = 0  # readings at this number of the poses
    rotations: bool = False


CASES = {
    "63 of the CoGiRo": Case("drums", ALL, (*SHIFT, *YAW, *TURNS, *SHIFTS, *SCALE)),
    "center of mass known": Case("drums", ALL[:-1], (*SHIFT, *YAW, *TURNS, *SCALE)),
    "drum known": Case("drums", tuple(k for k in ALL if k != "drum_radius"), (*SHIFT, *YAW, *TURNS, *SHIFTS)),
    "rope weighed": Case("drums", tuple(k for k in ALL if k != "linear_density"), (*SHIFT, *YAW, *TURNS, *SHIFTS)),
    "frame anchors known": Case("drums", ALL[1:], (*TURNS, *SHIFTS)),
    "platform anchors known": Case("drums", ("frame_anchors", *ALL[2:]), (*SHIFT, *YAW)),
    "one anchor fixed": Case("drums", ALL, (*YAW, *TURNS, *SHIFTS, *SCALE), fixed=("frame_anchors[0]",)),
    "two anchors fixed": Case("drums", ALL, (*TURNS, *SHIFTS), fixed=("frame_anchors[0]", "frame_anchors[1]")),
    "platform anchor fixed": Case("drums", ALL, (*SHIFT, *YAW, *TURNS, *SCALE), fixed=("platform_anchors[2]",)),
    "gains": Case("drums", (*ALL, "load_cell_gain"), (*SHIFT, *YAW, *TURNS, *SHIFTS, *SCALE, *FORCE)),
    "gains, and weighed": Case(
        "drums", (*ALL[:-2], "load_cell_gain", "center_of_mass"), (*SHIFT, *YAW, *TURNS, *SHIFTS, *SCALE)
    ),
    "gains and drums that wind under load": Case(
        "wound", (*ALL, "load_cell_gain"), (*SHIFT, *YAW, *TURNS, *SHIFTS, *SCALE, *FORCE)
    ),
    "gains, load, drum known": Case(
        "wound",
        (*ANCHORS, *CABLE, *BODY, "load_cell_gain"),
        (*SHIFT, *YAW, *TURNS, *SHIFTS, f"{SCALE[0]} and {FORCE[0]}"),
    ),
    "3 points": Case("drums", ALL, TURNS, positions=3),
    "2 points": Case("drums", ALL, (*TURNS, SHIFTS[0], *SCALE), positions=2),
    "1 point": Case("drums", ALL, (*YAW, *TURNS, *SHIFTS, *SCALE), positions=1),
    "all points": Case("drums", ALL, TURNS, positions=POSES),
    "all points of a target somewhere": Case("drums", (*ALL, "target"), (*TURNS, *SHIFTS), positions=POSES),
    "all points, system somewhere": Case("drums", (*ALL, "measuring_frame"), (*SHIFT, *YAW, *TURNS), positions=POSES),
    "positions and rotations": Case("drums", ALL, (), positions=POSES, rotations=True),
    "positions and rotations, no load cells": Case("drums", ALL, FORCE, cells=False, positions=POSES, rotations=True),
    "lengths": Case("cogiro", (*ANCHORS, *CABLE, *BODY), (*SHIFT, *YAW, *TURNS, *SHIFTS)),
    "pulleys": Case("pulleys", (*ANCHORS, *CABLE, "pulley_radius", *BODY), (*SHIFT, *YAW, *TURNS, *SHIFTS)),
    "point mass": Case("point", (*ANCHORS, *CABLE, "mass"), (*SHIFT, *YAW, *BOTH)),
    "plane": Case(
        "planar",
        (*ANCHORS, *CABLE, "mass"),
        (
            *("frame_anchors[0].y", "frame_anchors[1].y", "frame_anchors[2].y", "frame_anchors[3].y"),
            *("platform_anchors[0].y", "platform_anchors[1].y", "platform_anchors[2].y", "platform_anchors[3].y"),
            *(SHIFT[0], SHIFT[2], TURNS[1]),
        ),
    ),
}
ANCHOR_FIXED = CASES["one anchor fixed"]
# the other cases take a second of differences each
TIER: dict[str, Any] = {"plane": (), "63 of the CoGiRo": extended, "2 points": extended}


@cache
def poses_of_case(name: str) -> Standing:
    known = robots()
    cogiro = sl.load_robot("cogiro")
    known["drums"] = with_drums(cogiro)
    known["wound"] = with_drums(cogiro, winding_tension=160.0)
    robot = known[name]
    if robot.motion_pattern == "3R3T":
        return standing(robot, POSES)
    rng = np.random.default_rng(1)
    at = np.array([0.0, 0.0, 1.2 * (name == "point")])
    shift = at + rng.uniform(-0.5, 0.5, (40, 3)) * [1.0, float(name == "point"), 1.0]
    turn = sl.Pose.from_euler(shift, 0.0, rng.uniform(-0.15, 0.15, 40) * (name == "planar"), 0.0)
    plan = sl.inverse(robot, turn, tension=sl.MinimumNorm())
    firm = np.where(plan.feasible, sl.forward(robot, plan.unstrained_length, turn).stiffness_min, 0.0)
    keep = np.argsort(-firm)[:POSES]
    machine = Machine(robot, sl.Sensors(), np.zeros(robot.cable_count))
    return Standing(machine, turn[keep], plan.unstrained_length[keep])


@cache
def column(robot: str, kind: str, cable: int, axis: int) -> Array:
    machine, pose, lengths = poses_of_case(robot)
    placed = Machine(machine.robot, sl.Sensors(5e-4, 5.0, 1e-3, 1e-3), machine.offset)
    return reference.slopes(placed, pose, lengths, KINDS[kind].first + axis, cable)


def without(parameters: Parameters, fixed: tuple[str, ...]) -> Parameters:
    """Parameters except those whose labels begin with the given texts."""
    keep = np.array([not label.startswith(fixed) if fixed else True for label in parameters.labels])
    new = np.where(keep, np.cumsum(keep) - 1, -1)
    where = np.where(parameters.where >= 0, new[parameters.where], -1)
    names, labels, units = (
        tuple(np.array(each)[keep]) for each in (parameters.names, parameters.labels, parameters.units)
    )
    arrays = ("cables", "prior", "prior_deviation", "stated", "logarithmic")
    parts = {name: getattr(parameters, name)[keep] for name in arrays}
    return replace(parameters, names=names, labels=labels, units=units, where=where, **parts)


def sensors_of(case: Case) -> sl.Sensors:
    return sl.Sensors(
        5e-4,
        5.0 if case.cells else None,
        1e-3 if case.positions else None,
        1e-3 if case.rotations else None,
    )


def asked(case: Case) -> Parameters:
    machine = poses_of_case(case.robot).machine
    shared = () if case.robot == "pulleys" else SHARED
    return without(reference.parameters(machine, case.unknowns, tuple(set(shared) & set(case.unknowns))), case.fixed)


def by_differences(case: Case) -> Array:
    """Slopes of the readings with respect to the internal parameters, in deviations of both, (rows, P)."""
    machine = poses_of_case(case.robot).machine
    m, parameters = machine.robot.cable_count, asked(case)
    total = np.zeros((POSES, m + 6, len(parameters.names)))
    for kind in case.unknowns:
        for axis in range(len(KINDS[kind].axes)):
            for cable in range(m if KINDS[kind].each else 1):
                index = int(parameters.where[KINDS[kind].first + axis, cable])
                if index >= 0:
                    total[:, :, index] += column(case.robot, kind, cable, axis)
    parts = [total[:, :m] / 5.0] if case.cells else []
    parts += [total[: case.positions, m : m + 3] / 1e-3] if case.positions else []
    parts += [total[:, m + 3 :] / 1e-3] if case.rotations else []
    rows = np.vstack([part.reshape(-1, total.shape[2]) for part in parts])
    rows = rows * PriorUnits(parameters).scale
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    found: Array = (
        rows[size[:, 0] > 0.0] / size[size[:, 0] > 0.0]
    )  # errors at stiff poses are proportional to the slopes
    return found


def triangle_of(case: Case) -> Array:
    machine, pose, lengths = poses_of_case(case.robot)
    parameters, sensors = asked(case), sensors_of(case)
    triangle = np.zeros((0, len(parameters.names)))
    for part, given in ((slice(0, case.positions), sensors), (slice(case.positions, None), None)):
        read = given or (sensors if case.positions in (0, POSES) else sensors.replace(position_deviation=None))
        if len(lengths[part]):
            rows = predicted_rows(
                MachineTerms(machine.robot, sl.Catenary(), parameters, read), pose_rows(pose[part]), lengths[part]
            )
            triangle = append_rows(triangle, rows.matrix)
    return triangle


SLOW = [pytest.param(name, marks=TIER.get(name, pytest.mark.soak)) for name in CASES]


def directions(case: Case) -> tuple[Direction, ...]:
    machine, parameters = poses_of_case(case.robot).machine, asked(case)
    return gauge_of(triangle_of(case), parameters, parameters.prior, machine.robot, sensors_of(case))


@pytest.mark.parametrize("name", [pytest.param(name, marks=extended if name == "pulleys" else ()) for name in CASES])
def test_unidentifiable_directions(name: str) -> None:
    left = [one.name for one in directions(CASES[name])]
    assert len(left) == len(CASES[name].names)
    for wanted in sorted(CASES[name].names, key=len, reverse=True):
        left.remove(next(each for each in left if each.startswith(wanted)))


@pytest.mark.parametrize("name", SLOW)
def test_differences_give_the_same_unidentifiable_directions(name: str) -> None:
    case = CASES[name]
    found, rows = directions(case), by_differences(case)
    values = np.linalg.svd(rows)[1]
    values = np.concatenate((values, np.zeros(rows.shape[1] - len(values))))
    assert len(found) == np.sum(values < 1e-7 * values[0])
    vectors = np.array([one.vector for one in found]).reshape(len(found), rows.shape[1])
    vectors = vectors / PriorUnits(asked(case)).units
    assert np.abs(rows @ vectors.T).max(initial=0.0) < 1e-6 * values[0]
    assert np.linalg.matrix_rank(vectors, tol=1e-3) == len(found)


def test_63_parameters_of_the_cogiro() -> None:
    case = CASES["63 of the CoGiRo"]
    assert len(asked(case).names) == 63
    values = np.linalg.svd(triangle_of(case) * PriorUnits(asked(case)).scale)[1]
    assert np.sum(values < 1e-12 * values[0]) == 11
    assert values[51] > 1e-6 * values[0]


def test_an_anchor_stated_to_be_known_is_fixed() -> None:
    case = CASES["63 of the CoGiRo"]
    machine, parameters = poses_of_case("drums").machine, asked(case)
    first = np.array([label.startswith("frame_anchors[0]") for label in parameters.labels])
    stated = replace(parameters, stated=first, prior_deviation=np.where(first, 1e-6, parameters.prior_deviation))
    found = gauge_of(triangle_of(case), stated, stated.prior, machine.robot, sensors_of(case))
    assert sorted(one.name for one in found) == sorted(ANCHOR_FIXED.names)
    assert all(not one.vector[first].any() for one in found)


def test_row_blocks_give_the_same_triangular_factor() -> None:
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(40, 7, 5))
    whole = append_rows(np.zeros((0, 5)), rows)
    parts = np.zeros((0, 5))
    for start in range(0, 40, 9):
        parts = append_rows(parts, rows[start : start + 9])
    np.testing.assert_allclose(parts.T @ parts, whole.T @ whole, rtol=1e-12)
    rows[3, 2] = np.nan
    assert np.isfinite(append_rows(np.zeros((0, 5)), rows)).all()


@pytest.mark.parametrize(
    ("values", "count"),
    [
        ([1.0, 1e-3, 1e-8], 3),
        ([1.0, 1e-3, 1e-14], 2),
        ([1.0, 1e-6, 2e-12, 1e-15, 1e-16], 2),
        ([1.0, 1e-6, 5e-10, 1e-15, 1e-16], 3),
        ([1.0, 1e-13, 0.0], 1),
        ([0.0, 0.0], 0),
    ],
)
def test_the_gap_between_identifiable_and_unidentifiable_directions(values: list[float], count: int) -> None:
    assert _numerical_rank(np.array(values)) == count
