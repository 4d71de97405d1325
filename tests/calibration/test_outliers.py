"""Outliers in synthetic logs with deliberate errors at single poses."""

from functools import cache

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.findings import Outlier
from tests.calibration.synthetic import Truth, log_of, true_robot, usual_sensors
from tests.tiers import wide

POSES = 60


@cache
def truth(robot: str = "cogiro", *, positions: bool = False) -> Truth:
    more = {"position_deviation": 5e-4, "rotation_deviation": 1e-3} if positions else {}
    known = sl.load_robot(robot)
    return Truth(known, np.zeros(known.cable_count), usual_sensors(**more))


def outliers(log: sl.WinchLog, true: Truth) -> tuple[Outlier, ...]:
    """Outliers of a robot that is known except for its mass."""
    return sl.calibrate(true.robot, log, ("mass",), folds=0).outliers


def slips(seed: int, count: int = 3) -> dict[tuple[int, int], float]:
    rng = np.random.default_rng(seed)
    rows = rng.choice(POSES, count, replace=False)
    cables, signs = rng.integers(8, size=count), rng.choice([-1.0, 1.0], count)
    return {(int(row), int(cable)): 0.02 * sign for row, cable, sign in zip(rows, cables, signs, strict=True)}


def seeds(quick: int, count: int) -> list[object]:
    """The first few seeds, and the others if time permits."""
    return [pytest.param(seed, marks=() if seed < quick else pytest.mark.soak) for seed in range(count)]


@pytest.mark.parametrize("seed", seeds(1, 20))
def test_slips_of_20_mm_where_positions_are_measured(seed: int) -> None:
    made = slips(seed)
    true = truth(positions=True)
    log = log_of(true, POSES, seed, positions=POSES, rotations=POSES, slips=made).log
    found = outliers(log, true)
    assert {(one.row, one.cable): one.quantity for one in found} == dict.fromkeys(made, "length")
    for one in found:
        assert one.cable is not None
        assert abs(one.size - made[one.row, one.cable]) < 4.0 * abs(one.size / one.deviations)
        assert abs(one.size - made[one.row, one.cable]) < 4e-3


@pytest.mark.parametrize("seed", seeds(2, 20))
def test_slips_of_20_mm_that_load_cells_alone_see(seed: int) -> None:
    made = slips(seed)
    found = outliers(log_of(truth(), POSES, seed, slips=made).log, truth())
    assert [one.row for one in found] == sorted(row for row, _ in made)
    assert {one.quantity for one in found} == {"length"}
    named = [one for one in found if one.cable is not None]
    assert all((one.row, one.cable) in made for one in named)


@pytest.mark.soak
def test_the_named_cables_are_the_slipped_ones() -> None:
    right, named = 0, 0
    for seed in range(20, 60):
        made = slips(seed)
        found = outliers(log_of(truth(), POSES, seed, slips=made).log, truth())
        one_each = [one for one in found if one.cable is not None]
        named += len(one_each)
        right += sum((one.row, one.cable) in made for one in one_each)
    assert named >= 20
    assert right >= 0.95 * named


def test_a_load_cell_that_read_100_n_too_much() -> None:
    log = log_of(truth(), POSES, 4).log
    assert log.load_cells is not None
    cells = log.load_cells.copy()
    cells[17, 3] += 100.0
    found = outliers(log.replace(load_cells=cells), truth())
    assert [(one.row, one.cable, one.quantity) for one in found] == [(17, 3, "load cell")]
    assert abs(found[0].size - 100.0) < 25.0


def test_a_position_that_was_misread() -> None:
    true = truth(positions=True)
    log = log_of(true, POSES, 5, positions=POSES, rotations=POSES).log
    assert log.position is not None
    position = log.position.copy()
    position[8] += [0.012, 0.0, -0.009]
    found = outliers(log.replace(position=position), true)
    assert [(one.row, one.cable, one.quantity) for one in found] == [(8, None, "position")]
    assert abs(found[0].size - 0.015) < 0.003


def test_two_cables_of_one_pose() -> None:
    true = truth(positions=True)
    log = log_of(true, POSES, 6, positions=POSES, rotations=POSES, slips={(30, 1): 0.02, (30, 6): -0.03}).log
    found = outliers(log, true)
    assert [(one.row, one.cable, one.quantity) for one in found] == [(30, 6, "length"), (30, 1, "length")]
    np.testing.assert_allclose([one.size for one in found], [-0.03, 0.02], atol=4e-3)


def test_a_log_without_errors() -> None:
    assert outliers(log_of(truth(), POSES, 70).log, truth()) == ()


@pytest.mark.soak
def test_one_log_in_a_hundred_shows_an_outlier_by_chance() -> None:
    found = [outliers(log_of(truth(), POSES, 70 + seed).log, truth()) for seed in range(100)]
    assert sum(bool(each) for each in found) <= 5  # 1 is expected; 6 or more occur in 1 of 1700 runs


@pytest.mark.parametrize("size", wide([-0.1, 0.05, 0.2]))
@pytest.mark.parametrize("seed", seeds(2, 20))
def test_large_slips_are_reported_with_their_size(size: float, seed: int) -> None:
    """Length errors that move the platform far away: still a slip or a wrong count."""
    rng = np.random.default_rng(seed)
    row, cable = int(rng.integers(POSES)), int(rng.integers(8))
    found = sl.calibrate(
        truth().robot, log_of(truth(), POSES, seed, slips={(row, cable): size}).log, ("mass",), folds=0
    )
    assert not found.left_out
    assert [(one.row, one.cable, one.quantity) for one in found.outliers] == [(row, cable, "length")]
    assert abs(found.outliers[0].size - size) < 5e-3


def test_the_cable_with_the_best_nonlinear_explanation_is_named() -> None:
    """By the slopes alone it would be cable 4, which leaves 35 of the sum of squares; cable 2 leaves 11 of 7."""
    robot = sl.load_robot("cogiro")
    made = log_of(true_robot(robot), 40, slips={(7, 2): -0.1})
    one, *others = sl.calibrate(robot, made.log, folds=0).outliers
    assert not others
    assert (one.row, one.cable, one.quantity) == (7, 2, "length")
    assert abs(one.size + 0.1) < 2e-3
