"""The demonstrations of the errata compute what docs/errata.md says."""

import numpy as np
import pytest

from sagline.article import errata_cables, errata_print, errata_statics
from sagline.article.errata import DEMONSTRATIONS, errata


def test_there_are_eleven_in_order() -> None:
    assert [erratum.number for erratum in errata()] == list(range(1, 12))
    assert len({demonstrate.__name__ for demonstrate in DEMONSTRATIONS}) == 11


def test_erratum_1_the_intercept_is_positive_at_the_platform_end() -> None:
    found = errata_statics.sign_of_intercept()
    assert found["b_π at the platform end over wD/2"] == pytest.approx(1.0, abs=1e-3)
    assert found["b_π at the frame end over wD/2"] == pytest.approx(-1.0, abs=1e-3)
    assert found["largest position error, article-suspended, right sign"] == pytest.approx(1.71, abs=0.01)
    assert found["largest position error, article-suspended, printed sign"] == pytest.approx(9.34, abs=0.05)
    assert found["largest position error, article-mixed, printed sign"] == pytest.approx(21.4, abs=0.1)


def test_erratum_2_gravity_cancels_or_doubles() -> None:
    found = errata_statics.gravity_twice()
    weight = 50.0 * 9.81
    assert found["cables lift, gravity counted once"] == pytest.approx(weight)
    assert found["cables lift, read literally, g pointing down"] == pytest.approx(0.0, abs=1e-9)
    assert found["cables lift, read literally, g pointing up"] == pytest.approx(2.0 * weight)


def test_erratum_3_euler_rates_are_no_angular_velocity() -> None:
    found = errata_statics.euler_rates()
    assert found["largest component of ω less Euler rates"] > 0.1
    assert found["error of the moment"] > 0.3 * found["moment"]
    assert found["the same errors at constant orientation"] == 0.0
    turn = np.array([0.4, -0.6, 0.5])
    assert found["force of M W ẋ at 1 m/s, where there is none"] == pytest.approx(50.0 * np.hypot(turn[1], turn[2]))


def test_erratum_3_angular_velocity_against_differences() -> None:
    from scipy.spatial.transform import Rotation

    angles, rates, curvatures = (np.array(v) for v in ((0.4, 0.3, -0.2), (0.5, -0.6, 0.4), (0.3, 0.2, -0.5)))

    def spin(t: float) -> np.ndarray:
        def turned(s: float) -> Rotation:
            return Rotation.from_euler("ZYX", angles + rates * s + 0.5 * curvatures * s**2)

        h = 1e-5
        return np.asarray((turned(t + h) * turned(t - h).inv()).as_rotvec()) / (2.0 * h)

    omega, omega_rate = errata_statics._angular(angles, rates, curvatures)
    np.testing.assert_allclose(omega, spin(0.0), atol=1e-8)
    np.testing.assert_allclose(omega_rate, (spin(1e-3) - spin(-1e-3)) / 2e-3, atol=1e-5)


def test_erratum_4_the_square_of_h_is_singular() -> None:
    found = errata_statics.rank_of_h()
    assert (found["rows of HᵀH"], found["rank of HᵀH"]) == (8.0, 6.0)
    assert found["its smallest singular value over its largest"] < 1e-15
    assert found["residual of Hᵀ(HHᵀ)⁻¹"] < 1e-10


def test_erratum_5_the_stretch_is_off_by_half_the_weight() -> None:
    found = errata_cables.stretch_by_end_tension()
    assert found["error of (36), simulation's cable at 15 m"] == pytest.approx(found["wL² sin φ/(2EA)"], rel=0.01)
    assert found["the same over sin φ"] == pytest.approx(1.63, abs=0.02)
    assert abs(found["left of d after the mean tension is taken out, against the unstretchable cable"]) < 0.01


def test_erratum_6_the_sag_constant_is_g_squared_over_24() -> None:
    found = errata_cables.sag_constant()
    assert found["k_p by the article's regressions, taut cables"] == pytest.approx(9.81**2 / 24.0, rel=5e-4)
    assert found["what the published value adds to the sag term"] == pytest.approx(9.36, abs=0.01)


def test_erratum_7_the_bound_is_positive() -> None:
    found = errata_cables.sign_in_bound()
    assert found["b_π/a_π"] < 0.0 < found["|b_π/a_π|"]
    assert found["T_x at which T_z = 0, exact cable"] == pytest.approx(found["|b_π/a_π|"], rel=0.15)


def test_erratum_8_vertical_and_level_cables_break_the_formulas() -> None:
    found = errata_cables.vertical_and_level()
    assert found["condition of H 1 µm from under an anchor"] > 500.0 * found["condition of H 1 mm from under an anchor"]
    assert found["condition of J 1 µm from under an anchor"] < 100.0
    assert found["bound (54) a microradian from level"] > 1e6
    assert found["length of the exact vertical cable of 10 m at 100 N"] == pytest.approx(10.0, abs=0.03)


def test_erratum_9_the_errors_are_distances() -> None:
    found = errata_print.error_formula()
    assert found["largest difference of Table 2's errors from the distances"] < 1e-4
    assert found["largest difference of Table 2's errors from |Σ (B_i − P)|"] == pytest.approx(7.0 * 44.7884, abs=0.01)


def test_erratum_10_the_parameters_are_in_table_1() -> None:
    found = errata_print.table_number()
    assert found["poses in Table 2"] == 10.0
    assert found["both robots agree in Table 1's parameters (1: yes)"] == 1.0


def test_erratum_11_the_least_tension_and_the_transpose() -> None:
    found = errata_print.printed_formulas()
    least = found["least |T| on a line π, by search"]
    assert least == pytest.approx(found["|b_π|/√(1 + a_π²)"], rel=1e-6)
    assert found["|b_π|/√(a_π² + b_π²), as printed"] < 0.5 * least
    assert found["anchor misplaced by the transpose, turned by (0.3, 0.2, 0.1) rad"] > 100.0
