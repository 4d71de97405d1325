"""Calculations of the errata give the numbers of docs/errata.md."""

import numpy as np
import pytest

from sagline.article import errata
from sagline.article.errata import errata_chapter


@pytest.fixture(scope="module")
def numbers() -> dict[int, list[float]]:
    """Numbers of each erratum in the order of the page."""
    findings = errata_chapter().findings
    assert [erratum.key for erratum in findings] == [f"erratum-{k}" for k in range(1, 12)]
    return {k: list(erratum.numbers.values()) for k, erratum in enumerate(findings, 1)}


def test_erratum_1_the_intercept_is_positive_at_the_platform_end(numbers: dict[int, list[float]]) -> None:
    platform, frame, suspended, suspended_printed, _, mixed_printed = numbers[1]
    assert platform == pytest.approx(1.0, abs=1e-3)
    assert frame == pytest.approx(-1.0, abs=1e-3)
    assert suspended == pytest.approx(1.71, abs=0.01)
    assert suspended_printed == pytest.approx(9.34, abs=0.05)
    assert mixed_printed == pytest.approx(21.4, abs=0.1)


def test_erratum_2_gravity_cancels_or_doubles(numbers: dict[int, list[float]]) -> None:
    _, once, literal_down, literal_up = numbers[2]
    weight = 50.0 * 9.81
    assert once == pytest.approx(weight)
    assert literal_down == pytest.approx(0.0, abs=1e-9)
    assert literal_up == pytest.approx(2.0 * weight)


def test_erratum_3_euler_rates_are_no_angular_velocity(numbers: dict[int, list[float]]) -> None:
    rate_error, _, moment_error, moment, force, constant = numbers[3]
    assert rate_error > 0.1
    assert moment_error > 0.3 * moment
    assert constant == 0.0
    turn = np.array([0.4, -0.6, 0.5])
    assert force == pytest.approx(50.0 * np.hypot(turn[1], turn[2]))


def test_erratum_3_angular_velocity_against_differences() -> None:
    from scipy.spatial.transform import Rotation

    angles, rates, curvatures = (np.array(v) for v in ((0.4, 0.3, -0.2), (0.5, -0.6, 0.4), (0.3, 0.2, -0.5)))

    def spin(t: float) -> np.ndarray:
        def turned(s: float) -> Rotation:
            return Rotation.from_euler("ZYX", angles + rates * s + 0.5 * curvatures * s**2)

        h = 1e-5
        return np.asarray((turned(t + h) * turned(t - h).inv()).as_rotvec()) / (2.0 * h)

    omega, omega_rate = errata._angular(angles, rates, curvatures)
    np.testing.assert_allclose(omega, spin(0.0), atol=1e-8)
    np.testing.assert_allclose(omega_rate, (spin(1e-3) - spin(-1e-3)) / 2e-3, atol=1e-5)


def test_erratum_4_the_square_of_h_is_singular(numbers: dict[int, list[float]]) -> None:
    rows, rank, singular, _, residual = numbers[4]
    assert (rows, rank) == (8.0, 6.0)
    assert singular < 1e-15
    assert residual < 1e-10


def test_erratum_5_the_stretch_is_off_by_half_the_weight(numbers: dict[int, list[float]]) -> None:
    error, over_sine, formula, left = numbers[5]
    assert error == pytest.approx(formula, rel=0.01)
    assert over_sine == pytest.approx(1.63, abs=0.02)
    assert abs(left) < 0.01


def test_erratum_6_the_sag_constant_is_g_squared_over_24(numbers: dict[int, list[float]]) -> None:
    _, by_regression, added = numbers[6]
    assert by_regression == pytest.approx(9.81**2 / 24.0, rel=5e-4)
    assert added == pytest.approx(9.36, abs=0.01)


def test_erratum_7_the_bound_is_positive(numbers: dict[int, list[float]]) -> None:
    printed, right, exact = numbers[7]
    assert printed < 0.0 < right
    assert exact == pytest.approx(right, rel=0.15)


def test_erratum_8_vertical_and_level_cables_break_the_formulas(numbers: dict[int, list[float]]) -> None:
    _, h_at_1_mm, _, h_at_1_um, j_at_1_um, bound, vertical, _ = numbers[8]
    assert h_at_1_um > 500.0 * h_at_1_mm
    assert j_at_1_um < 100.0
    assert bound > 1e6
    assert vertical == pytest.approx(10.0, abs=0.03)


def test_erratum_9_the_errors_are_distances(numbers: dict[int, list[float]]) -> None:
    of_distances, of_sums = numbers[9]
    assert of_distances < 1e-4
    assert of_sums == pytest.approx(7.0 * 44.7884, abs=0.01)


def test_erratum_10_the_parameters_are_in_table_1(numbers: dict[int, list[float]]) -> None:
    poses, _, agree = numbers[10]
    assert poses == 10.0
    assert agree == 1.0


def test_erratum_11_the_least_tension_and_the_transpose(numbers: dict[int, list[float]]) -> None:
    least, formula, printed, misplaced = numbers[11]
    assert least == pytest.approx(formula, rel=1e-6)
    assert printed < 0.5 * least
    assert misplaced > 100.0
