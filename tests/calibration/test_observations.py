"""Slopes of readings with respect to the unknowns, block by block, compared with differences of forward solutions."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.calibration.parameters import KINDS
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.machines import Standing, robots, sensors, standing
from tests.calibration.reference import Machine, pose_rows
from tests.tiers import extended

ROBOTS = robots()
WITHOUT_WINCHES = ("cogiro", "article-suspended", "planar", "point")
WITH: dict[str, tuple[str, ...]] = {
    "pulley_radius": ("pulleys", "slanted", "aboard", "layers"),
    "dead_cable": ("pulleys", "slanted", "aboard", "layers"),
    "drum_radius": ("drums", "layers"),
    "length_scale": WITHOUT_WINCHES,
    "clock_offset": (),  # only moving rows observe it: test_clock_offset.py
    "swivel_zero": (),  # test_swivel.py
    "inertia": (),  # test_frequency.py
    "load_cell_gain": ("pulleys", "slanted", "aboard", "drums"),
    "load_cell_bias": ("pulleys", "slanted", "aboard", "drums"),
}
POSE_ONLY = ("measuring_frame", "target")
CELL_ONLY = ("load_cell_gain", "load_cell_bias")
LENGTH = 5e-4  # m
FIRST = ("frame_anchors", "length_scale")
OVER_PULLEYS = ("pulleys", "slanted", "aboard", "layers")


def cases(other_kinds: tuple[str, ...]) -> list[Any]:
    """Robots and kinds; the first tier has all kinds of one robot, and one kind of each robot without pulleys."""
    found = [(robot, kind) for kind in KINDS if kind not in other_kinds for robot in WITH.get(kind, tuple(ROBOTS))]
    return [
        pytest.param(
            robot,
            kind,
            id=f"{kind}-{robot}",
            marks=() if robot == "drums" or (kind in FIRST and robot not in OVER_PULLEYS) else extended,
        )
        for robot, kind in found
    ]


@cache
def machine_at_poses(name: str) -> Standing:
    return standing(ROBOTS[name])


@cache
def observed_slopes(name: str, kind: str) -> Array:
    """Output of `observed` for a kind without whitening; lengths have deviations of a nanometer."""
    machine, pose, lengths = machine_at_poses(name)
    asked = reference.parameters(machine, (kind,))
    seen = predicted_rows(
        MachineTerms(machine.robot, sl.Catenary(), asked, machine.sensors, machine.offset), pose_rows(pose), lengths
    )
    assert not seen.misfit.any()
    found: Array = seen.matrix * deviations(machine)[:, None]
    return found


@cache
def differences(name: str, kind: str) -> Array:
    """The same by differences, (N, m + 6, P)."""
    machine, pose, lengths = machine_at_poses(name)
    each = KINDS[kind]
    cables = range(machine.robot.cable_count) if each.each else range(1)
    columns = [
        reference.slopes(machine, pose, lengths, each.first + axis, cable)
        for cable in cables
        for axis in range(len(each.axes))
    ]
    return np.stack(columns, axis=-1)


def deviations(machine: Machine) -> Array:
    given = machine.sensors
    assert given.tension_deviation is not None
    assert given.position_deviation is not None
    assert given.rotation_deviation is not None
    cells = np.full(machine.robot.cable_count, given.tension_deviation)
    return np.concatenate((cells, given.position_deviation, given.rotation_deviation))


def agree(found: Array, wanted: Array) -> None:
    assert found.shape == wanted.shape
    largest = np.abs(wanted).max() or 1e-3  # rounding where the true slope is zero
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-7 * largest)


@pytest.mark.parametrize(("robot", "kind"), cases(POSE_ONLY))
def test_slopes_of_load_cells(robot: str, kind: str) -> None:
    m = ROBOTS[robot].cable_count
    agree(observed_slopes(robot, kind)[:, :m], differences(robot, kind)[:, :m])


@pytest.mark.parametrize(("robot", "kind"), cases(CELL_ONLY))
def test_slopes_of_positions(robot: str, kind: str) -> None:
    rows = slice(ROBOTS[robot].cable_count, -3)
    agree(observed_slopes(robot, kind)[:, rows], differences(robot, kind)[:, rows])


@pytest.mark.parametrize(("robot", "kind"), cases(CELL_ONLY))
def test_slopes_of_rotations(robot: str, kind: str) -> None:
    agree(observed_slopes(robot, kind)[:, -3:], differences(robot, kind)[:, -3:])


@pytest.mark.parametrize(
    "robot", [pytest.param(robot, marks=extended if robot in OVER_PULLEYS else ()) for robot in ROBOTS]
)
def test_whitening_by_errors_of_lengths(robot: str) -> None:
    machine, pose, lengths = machine_at_poses(robot)
    loose = machine.sensors.replace(length_deviation=LENGTH)
    asked = reference.parameters(machine, ("frame_anchors", "mass"))
    seen = predicted_rows(MachineTerms(machine.robot, sl.Catenary(), asked, loose), pose_rows(pose), lengths)
    by_lengths = reference.by_lengths(machine, pose, lengths, sl.Catenary())
    scatter = np.diag(deviations(machine) ** 2) + LENGTH**2 * by_lengths @ np.swapaxes(by_lengths, -1, -2)
    slopes = np.concatenate((differences(robot, "frame_anchors"), differences(robot, "mass")), axis=-1)
    agree(
        np.swapaxes(seen.matrix, -1, -2) @ seen.matrix, np.swapaxes(slopes, -1, -2) @ np.linalg.solve(scatter, slopes)
    )


@pytest.mark.parametrize("robot", ["cogiro", "drums"])
@pytest.mark.parametrize("absent", ["tension_deviation", "position_deviation", "rotation_deviation"])
def test_a_missing_sensor_has_no_slopes(robot: str, absent: str) -> None:
    machine, pose, lengths = machine_at_poses(robot)
    rows = {"tension_deviation": slice(0, 8), "position_deviation": slice(8, 11), "rotation_deviation": slice(11, 14)}
    without = machine.sensors.replace(**{absent: None}, length_deviation=LENGTH)
    asked = reference.parameters(machine, ("frame_anchors", "measuring_frame", "target"))
    seen = predicted_rows(MachineTerms(machine.robot, sl.Catenary(), asked, without), pose_rows(pose), lengths)
    by_lengths = reference.by_lengths(machine, pose, lengths, sl.Catenary())
    there = np.delete(np.arange(14), rows[absent])
    kinds = ("frame_anchors", "measuring_frame", "target")
    slopes = np.concatenate([differences(robot, kind) for kind in kinds], axis=-1)[:, there]
    scatter = np.diag(deviations(machine)[there] ** 2)
    scatter = scatter + LENGTH**2 * by_lengths[:, there] @ np.swapaxes(by_lengths[:, there], -1, -2)
    assert not seen.matrix[:, rows[absent]].any()
    agree(
        np.swapaxes(seen.matrix, -1, -2) @ seen.matrix, np.swapaxes(slopes, -1, -2) @ np.linalg.solve(scatter, slopes)
    )


@extended
@pytest.mark.parametrize("kind", [kind for kind in KINDS if KINDS[kind].each and KINDS[kind].owner != "system"])
def test_slopes_of_a_common_parameter_are_sums_over_cables(kind: str) -> None:
    machine, pose, lengths = machine_at_poses("layers")
    asked = reference.parameters(machine, (kind,), shared=(kind,))
    terms = MachineTerms(machine.robot, sl.Catenary(), asked, machine.sensors)
    seen = predicted_rows(terms, pose_rows(pose), lengths)
    each = observed_slopes("layers", kind)
    wanted = each.reshape(*each.shape[:2], 8, -1).sum(axis=2)
    agree(seen.matrix * deviations(machine)[:, None], wanted)


@extended
def test_the_reference_agrees_with_half_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    wide = {(name, kind): differences(name, kind) for name in ("layers", "planar") for kind in ("mass", "length_zero")}
    monkeypatch.setattr(reference, "STEPS", {row: 0.5 * step for row, step in reference.STEPS.items()})
    for (name, kind), found in wide.items():
        agree(differences.__wrapped__(name, kind), found)


def test_a_measured_point_by_definition() -> None:
    machine, pose, _ = machine_at_poses("cogiro")
    read, _ = reference.readings(machine, machine_at_poses("cogiro").lengths, pose, sl.Catenary())
    frame, target = sensors().frame, sensors().target
    by_hand = [
        frame.matrix.T @ (p + r @ target - frame.position) for p, r in zip(pose.position, pose.matrix, strict=True)
    ]
    np.testing.assert_allclose(read[:, 8:], by_hand, atol=1e-9)
