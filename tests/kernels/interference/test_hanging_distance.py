import numpy as np
import pytest

import sagline as sl
from sagline.arrays import Array, locked
from sagline.interference.rows import cable_rows
from sagline.kernels.interference import shapes
from sagline.kernels.interference.hanging_distance import least_distances, memory_for_pieces
from tests.kernels.interference.hanging import all_pairs, random_cable, random_pair, sampled_distance


def measured(
    moving: Array,
    pairs: Array | None = None,
    precision: float = 1e-4,
    together: bool = False,
    still: Array | None = None,
) -> tuple[Array, Array, Array]:
    """Distances, lower bounds and nearest points of rows (N, K, COLUMNS)."""
    numbers = all_pairs(moving.shape[1]) if pairs is None else np.asarray(pairs, dtype=np.int64)
    beside = np.zeros((0, shapes.COLUMNS)) if still is None else still
    shape = (len(moving), len(numbers))
    out = np.full(shape, np.nan), np.full(shape, np.nan), np.full((*shape, 2, 3), np.nan)
    rows, others = locked(np.ascontiguousarray(moving)), locked(beside)
    least_distances(rows, others, locked(numbers), precision, together, *memory_for_pieces(), *out)
    return out


@pytest.mark.parametrize("cases", [150, pytest.param(6000, marks=pytest.mark.soak)])
def test_no_lower_bound_is_above_what_dense_samples_find(cases: int) -> None:
    rng = np.random.default_rng(14)
    for case in range(cases):
        one, other = random_pair(rng)
        precision = float(rng.choice([1e-2, 1e-3, 1e-4, 1e-6]))
        found, low, nearest = (part[0, 0] for part in measured(np.array([[one.row, other.row]]), precision=precision))
        sampled = sampled_distance(one, other, 301)
        size = 1e-12 * (1.0 + np.abs(nearest).max())
        assert low <= sampled + size, case
        assert low <= found <= low + precision, case
        assert found <= sampled + precision, case
        assert np.linalg.norm(nearest[0] - nearest[1]) == pytest.approx(found, abs=size), case
        for cable, place in zip((one, other), nearest, strict=True):  # the points are on the cables
            share = np.linspace(0.0, 1.0, 4001)
            step = cable.length * (1.0 + 20.0 * cable.weight * cable.length / cable.stiffness) / 4000.0
            assert np.linalg.norm(cable.points(share) - place, axis=1).min() <= 20.0 * step, case


def nearest_cable_pairs() -> list[tuple[Array, Array]]:
    """The sixty nearest pairs of cables of four robots at random feasible poses, as rows; shared anchors left out."""
    rng = np.random.default_rng(60)
    found: list[tuple[float, Array, Array]] = []
    for name in ("article-suspended", "cogiro", "ipanema-1", "expo2015-lucia-pulleys"):
        robot = sl.load_robot(name)
        assert robot.test_box is not None
        places = rng.uniform(robot.test_box.low, robot.test_box.high, (25, 3))
        state = sl.inverse(robot, sl.Pose.from_euler(places, 0.0, 0.0, 0.0)).state
        rows = cable_rows(state, np.zeros(robot.cable_count))
        rows = rows[~np.isnan(rows).any(axis=(1, 2))]
        distance, _, _ = measured(rows)
        for n, p in np.argwhere(distance > 1e-6):
            i, j = all_pairs(robot.cable_count)[p]
            found.append((float(distance[n, p]), rows[n, i], rows[n, j]))
    return [(one, other) for _, one, other in sorted(found, key=lambda entry: entry[0])[:60]]


@pytest.mark.soak
def test_the_sixty_nearest_cable_pairs_agree_with_brute_force_to_1e_12() -> None:
    assert agreement(nearest_cable_pairs()) <= 1e-12


def test_six_of_the_nearest_cable_pairs_agree_with_brute_force_to_1e_12() -> None:
    assert agreement(nearest_cable_pairs()[::10]) <= 1e-12


def agreement(pairs: list[tuple[Array, Array]]) -> float:
    """Largest difference from 1,501 x 1,501 points and simplex search."""
    from tests.kernels.interference.hanging import Hung

    worst = 0.0
    for rows in pairs:
        cables = [
            Hung(
                row[shapes.PLACE : shapes.PLACE + 3],
                float(np.arctan2(row[shapes.LEVEL + 1], row[shapes.LEVEL])),
                *(float(value) for value in row[shapes.HORIZONTAL : shapes.STIFFNESS + 1]),
            )
            for row in rows
        ]
        found, low, _ = measured(np.array([rows]))
        brute = sampled_distance(cables[0], cables[1])
        assert low[0, 0] <= brute + 1e-12
        worst = max(worst, abs(brute - float(found[0, 0])))
    return worst


def test_the_least_of_all_pairs_is_the_same_whether_the_others_are_measured_or_not() -> None:
    rng = np.random.default_rng(3)
    rows = np.array([[random_cable(rng, kind).row for kind in ("taut", "sagging", "deep", "upright", "level")]] * 1)
    rows = np.concatenate([rows + 0.0] * 20)
    rows[..., shapes.PLACE : shapes.PLACE + 3] += rng.normal(size=(20, 5, 3)) * 3.0
    each, _, _ = measured(rows)
    least, low, _ = measured(rows, together=True)
    assert least.min(axis=1) == pytest.approx(each.min(axis=1), abs=1e-4)
    assert (low.min(axis=1) <= each.min(axis=1)).all()


def test_radii_are_taken_off_and_missing_tensions_are_nan() -> None:
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
