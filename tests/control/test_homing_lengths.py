"""Homing with measured lengths of a machine."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control.controller import Controller
from sagline.control.homing import _length_tolerance, _zeros
from sagline.control.states import RefusedError, State
from sagline.core.arrays import Array
from tests.control.rigs import HOME, at, imperfect, prototype, rest, rig, state_of
from tests.refusal import refused

STATE = sl.inverse(prototype(), HOME).state
TARGET = at(0.2, -0.4, 1.4)


def displaced(by: Any, robot: sl.Robot | None = None, seed: int = 1) -> tuple[Controller, sl.twin.Machine]:
    """A connected controller with correct encoders, and a platform away from HOME."""
    nominal = robot or prototype()
    place = HOME.position + np.asarray(by, dtype=float)[:3]
    start = sl.Pose.from_euler(place, *np.asarray([*by, 0.0, 0.0, 0.0], dtype=float)[3:6])
    machine = sl.twin.Machine(nominal, start=start, seed=seed)
    control = Controller(nominal, machine.link(), seed=2)
    control.connect()
    return control, machine


def without_zeros() -> sl.Robot:
    """The prototype with encoders without zeros."""
    robot = prototype()
    assert robot.winches is not None
    return robot.replace(winches=robot.winches.replace(length_zero=None))


def tolerance(robot: sl.Robot) -> Array:
    return _length_tolerance(robot, STATE, sl.Catenary())


@pytest.mark.parametrize(("by", "cable"), [((0.1, 0.0, 0.0), 4), ((0.0, 0.3, 0.0), 6)])
def test_right_lengths_are_replaced_only_after_a_confirmation(by: Any, cable: int) -> None:
    control, machine = displaced(by)
    with refused("homing", kind=RefusedError) as caught:
        control.home(HOME)
    sample = control.sample
    assert sample is not None
    named = re.match(
        r"cable (\d): (\S+) mm in the machine, (\S+) mm from homing, allowed difference (\S+) mm; .* at "
        r"\((\S+), (\S+), (\S+)\) m, (\S+) mm and 0\.0 degrees away",
        caught.value.reason,
    )
    assert named is not None
    found = [float(number) for number in named.groups()]
    lengths = 1e3 * sample.length[cable], 1e3 * STATE.unstrained_length[cable], 1e3 * tolerance(prototype())[cable]
    assert found[0] == cable
    assert found[1:4] == pytest.approx(lengths, abs=0.051)
    assert found[4:7] == pytest.approx(HOME.position + by, abs=6e-4)
    assert found[7] == pytest.approx(1e3 * max(by), abs=0.1)
    assert len(str(caught.value)) < 300
    assert state_of(control) is State.HOMING
    assert not control.zero.any()
    assert not control.homed
    control.confirm_homing()
    assert state_of(control) is State.IDLE
    assert control.zero == pytest.approx(STATE.unstrained_length - sample.length, abs=1e-6)
    assert re.search(rf"confirmed.* {1e3 * np.abs(control.zero).max():.2f} mm", control.events[-1].text)
    assert np.abs(machine.reading.position - HOME.position - by).max() < 1e-4  # no motion


def test_a_confirmation_is_valid_only_for_the_reported_pose() -> None:
    control, _ = displaced((0.1, 0.0, 0.0))
    with refused("confirming", kind=RefusedError):
        control.confirm_homing()
    with refused("homing", kind=RefusedError):
        control.home(HOME)
    control.jog(0, 0.001)
    with refused("confirming", kind=RefusedError):
        control.confirm_homing()
    with refused("homing", kind=RefusedError):
        control.home(HOME)
    control.home(at(0.1, 0.0, 1.5))  # the reverse: the pose of the lengths
    assert state_of(control) is State.IDLE
    assert np.abs(control.zero).max() < 2e-3


def test_a_jog_in_a_later_homing_begins_at_the_lengths_of_the_drives() -> None:
    control, _ = displaced((0.1, 0.0, 0.0))
    with refused("homing", kind=RefusedError):
        control.home(HOME)
    control.confirm_homing()
    zero = control.zero
    assert np.abs(zero).max() > 0.04
    control.off()
    control.connect()
    control.begin_homing(HOME)
    before = control.sample
    control.jog(0, 0.001)
    assert before is not None
    assert control.sample is not None
    moved = control.sample.length - before.length
    assert moved == pytest.approx([0.001, *[0.0] * 7], abs=2e-4)
    assert (control.sample.fault == 0).all()
    assert np.array_equal(control.zero, zero)


@pytest.mark.parametrize("seed", range(4))
def test_a_right_homing_needs_no_confirmation(seed: int) -> None:
    control, _ = rig(imperfect(seed=seed), seed=seed)
    assert state_of(control) is State.IDLE
    assert np.abs(control.zero).max() < 1e-4


def test_without_length_zeros_the_tensions_of_the_first_homing_decide() -> None:
    control, machine = displaced((0.1, 0.0, 0.0), without_zeros())
    control.home(HOME)
    assert state_of(control) is State.IDLE
    control.off()
    control.connect()
    with refused("homing", kind=RefusedError) as caught:  # from now on the lengths are those of the first homing
        control.home(at(0.1, 0.0, 1.5))
    assert "(0.000, 0.000, 1.500) m, 100.0 mm" in caught.value.reason
    control.home(HOME)
    assert np.abs(machine.reading.position - [0.1, 0.0, 1.5]).max() < 1e-3


def test_corrections_of_the_tension_loop_belong_to_the_lengths() -> None:
    control, machine = rig(imperfect(zero=2e-3))
    there = at(0.05, 0.0, 1.5)
    control.go_to(there)
    rest(control, machine, 1.0)
    before = control._context.correction
    assert np.abs(before).max() > 1e-3
    control.off()
    control.connect()
    control.home(there)
    change = re.search(r"by up to (\S+) mm", control.events[-1].text)
    assert change is not None
    assert float(change[1]) < 0.1
    assert not control._context.correction.any()


def test_a_refusal_because_of_tensions_names_the_pose_of_the_lengths() -> None:
    control, _ = displaced((0.0, 0.0, 0.3))
    with refused("homing", kind=RefusedError) as caught:
        control.home(HOME)
    assert caught.value.reason.startswith("tensions differ")
    assert "(0.000, 0.000, 1.800) m, 300.0 mm" in caught.value.next_step
    assert len(str(caught.value)) < 300


def test_the_tolerance_follows_from_cells_encoders_and_tolerances(tmp_path: Path) -> None:
    robot = prototype()
    winches = robot.winches
    assert winches is not None
    tension, step = STATE.cables.frame_end_tension, 0.01
    zeros = [_zeros(sl.home(robot, HOME, tension + change).winches) for change in (-step, step)]
    cells = np.hypot(1.0, 2.0) * (zeros[1] - zeros[0]) / (2.0 * step)
    assert tolerance(robot) == pytest.approx(5.0 * np.abs(cells), rel=1e-3)
    assert tolerance(robot).min() == pytest.approx(2.76e-3, abs=1e-5)
    direction = HOME.transform(robot.platform_anchors) - robot.frame_anchors
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    for known, also in (
        ({"length_zero": 2e-3}, np.full(8, 2e-3)),
        ({"drum_radius": 3e-4}, 0.01 * (STATE.unstrained_length - 3.0)),
        ({"frame_anchors": [1e-6, 0.01, 1e-6]}, 0.01 * np.abs(direction[:, 1])),
        ({"platform_anchors": 2e-3}, np.full(8, 2e-3)),
        ({"axial_stiffness": 1400.0}, 0.1 * STATE.unstrained_length * tension / 14e3),
        ({"mass": np.inf}, np.zeros(8)),
    ):
        found = tolerance(robot.replace(tolerances=known))
        assert found == pytest.approx(5.0 * np.hypot(cells, also), rel=0.03), known
    assert np.isinf(tolerance(robot.replace(tolerances={"length_zero": np.inf}))).all()
    file = tmp_path / "calibrated.yaml"
    stated = sl.dump_robot(robot.replace(tolerances={"length_zero": 2e-3}))
    file.write_text(
        f"{stated}\ncalibration:\n  log: log.csv\n  date: 2026-03-01\n"
        "  standard_error: {length_zero: 1 mm, pulley_radius: .inf}\n"  # no data for the radius
    )
    better = sl.load_robot(file)
    assert tolerance(better) == pytest.approx(5.0 * np.hypot(cells, 1e-3), rel=1e-3)
    coarse = robot.replace(winches=winches.replace(counts_per_turn=1.0))
    count = 2.0 * np.pi * 0.03 / 20.0
    assert tolerance(coarse) == pytest.approx(5.0 * np.hypot(cells, count / np.sqrt(12.0)), rel=1e-3)


def lands(by: Array, seed: int) -> float | None:
    """Distance of the platform from its target after a motion [m]; None if homing is refused."""
    control, machine = displaced(by, imperfect(noise=1.0, bias=0.0), seed)
    try:
        control.home(HOME)
    except RefusedError:
        return None
    assert control.go_to(TARGET).status.name == "DONE"
    return float(np.linalg.norm(machine.reading.position - TARGET.position))


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.extended)])
def test_accepted_homings_stay_within_the_tolerance(count: int) -> None:
    """Displacements along and about all axes, from well within the tolerance of homing to far beyond it."""
    random = np.random.default_rng(count)
    slope = sl.stiffness(sl.inverse(prototype(), TARGET).state).length_sensitivity[:3]
    most = float(np.linalg.norm(np.abs(slope) @ tolerance(prototype())))
    assert most < 0.0115
    found = []
    for seed, size in enumerate(np.geomspace(1e-4, 0.2, count)):
        by = random.standard_normal(6) * [1.0, 1.0, 1.0, 0.3, 0.3, 0.3]
        found.append(lands(size * by / np.linalg.norm(by), seed))
    accepted = [off for off in found if off is not None]
    assert 0.2 * count < len(accepted) < 0.8 * count
    assert max(accepted) < most
