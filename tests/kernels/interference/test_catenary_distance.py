import numpy as np
import pytest

from sagline.core.arrays import locked
from sagline.kernels.interference import shapes
from sagline.kernels.interference.catenary_distance import BULGE, PIECE_COLUMNS, cut_piece
from tests.interference.scenes import from_segment
from tests.kernels.interference.hanging import (
    KINDS,
    agreement,
    measured,
    nearest_cable_pairs,
    random_cable,
    random_pair,
    sampled_distance,
)
from tests.tiers import wide


@pytest.mark.parametrize("cases", wide([10, 80, pytest.param(6000, marks=pytest.mark.soak)]))
def test_lower_bounds_are_below_distances_of_dense_samples(cases: int) -> None:
    rng = np.random.default_rng(14)
    for case in range(cases):
        one, other, side_by_side = random_pair(rng)
        precision = float(rng.choice([1e-2, 1e-3, 1e-4, 1e-6]))
        found, low, nearest = (part[0, 0] for part in measured(np.array([[one.row, other.row]]), precision=precision))
        sampled = sampled_distance(one, other, 301)
        size = 1e-12 * (1.0 + np.abs(nearest).max())
        assert low <= sampled + size, case
        assert low <= found, case
        assert found <= low + precision or side_by_side, case  # requires more pieces than the memory holds
        assert found <= sampled + precision, case
        assert np.linalg.norm(nearest[0] - nearest[1]) == pytest.approx(found, abs=size), case
        for cable, place in zip((one, other), nearest, strict=True):  # the points are on the cables
            share = np.linspace(0.0, 1.0, 4001)
            step = cable.length * (1.0 + 20.0 * cable.weight * cable.length / cable.stiffness) / 4000.0
            assert np.linalg.norm(cable.points(share) - place, axis=1).min() <= 20.0 * step, case


@pytest.mark.soak
def test_the_sixty_nearest_cable_pairs_agree_with_brute_force_to_1e_12() -> None:
    assert agreement(nearest_cable_pairs()) <= 1e-12


def test_six_of_the_nearest_cable_pairs_agree_with_brute_force_to_1e_12() -> None:
    assert agreement(nearest_cable_pairs()[::10]) <= 1e-12


def test_the_least_distance_is_the_same_without_the_other_pairs() -> None:
    rng = np.random.default_rng(3)
    rows = np.array([[random_cable(rng, kind).row for kind in ("taut", "sagging", "deep", "upright", "level")]] * 1)
    rows = np.concatenate([rows + 0.0] * 20)
    rows[..., shapes.PLACE : shapes.PLACE + 3] += rng.normal(size=(20, 5, 3)) * 3.0
    each, _, _ = measured(rows)
    least, low, _ = measured(rows, together=True)
    assert least.min(axis=1) == pytest.approx(each.min(axis=1), abs=1e-4)
    assert (low.min(axis=1) <= each.min(axis=1)).all()


def test_radii_are_subtracted_and_missing_tensions_give_nan() -> None:
    rng = np.random.default_rng(4)
    rows = np.array([[random_cable(rng, "sagging").row, random_cable(rng, "taut").row]] * 2)
    rows[1, 0] = np.nan
    plain = measured(rows)[0]
    thick = rows.copy()
    thick[..., shapes.RADIUS] = (0.01, 0.02)
    distance, low, _ = measured(thick)
    assert distance[0, 0] == pytest.approx(plain[0, 0] - 0.03, abs=1e-12)
    assert low[0, 0] >= distance[0, 0] - 1e-4
    assert np.isnan(distance[1]).all()
    assert np.isnan(low[1]).all()


@pytest.mark.parametrize("kind", KINDS)
def test_pieces_are_within_a_tight_bound_of_their_chord(kind: str) -> None:
    rng = np.random.default_rng(8)
    for _ in range(60):
        cable = random_cable(rng, kind)
        begin, end = np.sort(rng.random(2)) if rng.random() < 0.8 else (0.0, 1.0)
        piece = np.empty((1, PIECE_COLUMNS))
        cut_piece(locked(cable.row), locked(np.array([[begin, end]])), piece)
        points = cable.points(np.linspace(begin, end, 801))
        size = 1e-11 * (1.0 + np.abs(points).max())
        assert piece[0, :3] == pytest.approx(points[0], abs=size)
        assert piece[0, 3:6] == pytest.approx(points[-1], abs=size)
        beyond = float(from_segment(points, piece[0, :3], piece[0, 3:6]).max())
        assert beyond <= piece[0, BULGE] + size
        if kind == "taut":  # with nearly constant curvature the bound is nearly reached
            give = cable.weight / cable.stiffness * ((end - begin) * cable.length) ** 2 / 8.0
            assert piece[0, BULGE] <= 1.2 * beyond + give + size


def test_pieces_of_a_parabola_reach_the_bound() -> None:
    row = np.zeros(shapes.COLUMNS)
    row[shapes.KIND], row[shapes.LAST], row[shapes.LEVEL] = shapes.PARABOLA, 1.0, 1.0
    row[shapes.SPAN], row[shapes.RISE], row[shapes.DROP] = 10.0, 0.0, 2.0
    piece = np.empty((1, PIECE_COLUMNS))
    cut_piece(locked(row), locked(np.array([[0.25, 0.75]])), piece)
    assert piece[0, BULGE] == pytest.approx(2.0 * 0.25**2)  # 4 drops (1/4 - 1/16), from 4 drops 3/16
    assert piece[0, 2] == pytest.approx(-2.0 * 0.1875)
