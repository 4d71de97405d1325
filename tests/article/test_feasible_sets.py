"""Figure 5: drawn residual curves, compared with solutions of the equations of the article for the cable end."""

import numpy as np
import pytest
from matplotlib.lines import Line2D
from scipy.optimize import fsolve

from sagline.core.arrays import Array
from tests.article.conftest import Written
from tests.article.hanging import GRAVITY, end_of

DENSITY, STIFFNESS = 0.067, 44e3  # simulation of Table 1: kg/m, N
SPAN, RISE = 10.0 * np.cos(0.754), 10.0 * np.sin(0.754)


def vertical_forces(tensions: Array) -> Array:
    """T_z for which (1) and (2) with some length give the position of the cable end."""
    found, guess = [], (tensions[-1] * np.tan(0.754) + 3.0, 10.0)
    for tension in tensions[::-1]:  # from taut to slack, each from the previous solution

        def away(unknown: Array, tension: float = tension) -> list[float]:
            x, z = end_of(tension, unknown[0], unknown[1], DENSITY * GRAVITY, STIFFNESS)
            return [x - SPAN, z - RISE]

        solution, _, flag, message = fsolve(away, guess, xtol=1e-13, full_output=True)
        assert np.abs(away(solution)).max() < 1e-9, (tension, flag, message)
        found.append(solution[0])
        guess = (solution[0] - np.tan(0.754) * (tensions[1] - tensions[0]), solution[1])
    return np.array(found[::-1])


@pytest.fixture(scope="module")
def lines(either: Written) -> dict[str, Line2D]:
    (figure,) = [figure for caption, figure in either.figures if caption.startswith("The difference: ")]
    return {str(line.get_label()): line for line in figure.axes[0].get_lines()}


def test_residual_curves_are_the_exact_force_minus_each_line(lines: dict[str, Line2D]) -> None:
    fitted, stated = lines["fitted line"], lines[r"$\tan\varphi\, T_x + wD/2$"]
    tensions = np.linspace(10.0, 500.0, 200)
    np.testing.assert_allclose(np.asarray(fitted.get_xdata()), tensions, rtol=1e-12)
    np.testing.assert_allclose(np.asarray(stated.get_xdata()), tensions, rtol=1e-12)
    exact = vertical_forces(tensions)
    by_numpy = exact - np.polynomial.Polynomial.fit(tensions, exact, 1)(tensions)
    by_article = exact - (np.tan(0.754) * tensions + 0.5 * DENSITY * GRAVITY * 10.0)
    np.testing.assert_allclose(np.asarray(fitted.get_ydata()), by_numpy, atol=2e-6)
    np.testing.assert_allclose(np.asarray(stated.get_ydata()), by_article, atol=2e-6)
    assert np.abs(by_numpy).max() > 0.1  # the compared numbers are larger than rounding
