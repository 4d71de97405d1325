import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sagline as sl
from tests.refusal import refused
from tests.tiers import wide

SHAPERS = {
    "ZV": lambda: sl.ZV(1.8),
    "ZV damped": lambda: sl.ZV(1.8, 0.1),
    "ZVD": lambda: sl.ZVD(1.8),
    "ZVD damped": lambda: sl.ZVD(1.8, 0.1),
    "EI": lambda: sl.EI(1.8, 0.05),
    "two": lambda: sl.ZV([1.8, 2.9]),
    "product": lambda: sl.ZV(1.8) * sl.EI(2.9),
    "own": lambda: sl.Shaper([0.0, 0.1, 0.25], [0.5, 0.2, 0.3]),
}


def left_by_impulses(shaper: sl.Shaper, frequency: float, damping_ratio: float) -> float:
    """Amplitude of an oscillator after the impulses, by integration, relative to that after one impulse."""
    turning = 2.0 * np.pi * frequency

    def rates(_: float, state: np.ndarray) -> list[float]:
        return [state[1], -(turning**2) * state[0] - 2.0 * damping_ratio * turning * state[1]]

    state = np.zeros(2)
    gaps = np.append(np.diff(shaper.time), 0.0)
    for gap, amplitude in zip(gaps, shaper.amplitude, strict=True):
        state[1] += amplitude
        if gap:
            state = solve_ivp(rates, (0.0, gap), state, rtol=1e-11, atol=1e-13).y[:, -1]
    damped = turning * np.sqrt(1.0 - damping_ratio**2)
    return float(np.hypot(state[1] + damping_ratio * turning * state[0], damped * state[0]))


@pytest.mark.parametrize("name", SHAPERS)
@pytest.mark.parametrize("damping_ratio", wide([0.1, 0.0]))
def test_the_residual_is_that_of_an_oscillator(name: str, damping_ratio: float) -> None:
    shaper = SHAPERS[name]()
    for frequency in (0.7, 1.8, 2.3, 2.9):
        expected = left_by_impulses(shaper, frequency, damping_ratio)
        assert shaper.residual(frequency, damping_ratio) == pytest.approx(expected, abs=1e-9)


def test_the_residual_vanishes_at_the_design_frequency() -> None:
    assert sl.ZV(1.8).residual(1.8) < 1e-15
    assert sl.ZV(1.8, 0.2).residual(1.8, 0.2) < 1e-15
    assert sl.ZVD(1.8, 0.2).residual(1.8, 0.2) < 1e-15
    assert (sl.ZV([1.8, 2.9]).residual([1.8, 2.9]) < 1e-15).all()
    assert sl.EI(1.8, 0.05).residual(1.8) == pytest.approx(0.05, abs=1e-15)


def test_the_derivative_of_zvd_vanishes() -> None:
    near = np.array([1e-2, 5e-3])
    first, second = sl.ZV(1.0).residual(1.0 + near), sl.ZVD(1.0).residual(1.0 + near)
    assert first[0] / first[1] == pytest.approx(2.0, rel=1e-3)
    assert second[0] / second[1] == pytest.approx(4.0, rel=1e-3)


def test_ei_stays_below_its_tolerance_with_two_zeros() -> None:
    residual = sl.EI(1.0, 0.05).residual(np.linspace(0.8, 1.2, 4001))
    inside = np.flatnonzero(residual <= 0.05 + 1e-12)
    assert inside[-1] - inside[0] == inside.size - 1  # one band
    assert inside.size * 1e-4 == pytest.approx(2.0 / np.pi * np.arccos(0.85 / 1.05), abs=2e-4)  # of all frequencies
    assert (np.sort(residual)[:2] < 1e-3).all()


def test_products_convolve() -> None:
    one, other = sl.ZV(1.8), sl.EI(2.9)
    product = one * other
    frequency = np.linspace(0.0, 10.0, 301)
    np.testing.assert_allclose(
        product.residual(frequency), one.residual(frequency) * other.residual(frequency), atol=1e-14
    )
    assert product.duration == pytest.approx(one.duration + other.duration)
    np.testing.assert_array_equal(product.frequency, [1.8, 2.9])
    np.testing.assert_allclose((other * one).time, product.time)
    twice = sl.ZV(2.0) * sl.ZV(2.0)
    np.testing.assert_allclose(twice.amplitude, sl.ZVD(2.0).amplitude)  # the two impulses in the middle coincide
    np.testing.assert_allclose(twice.time, sl.ZVD(2.0).time)


@pytest.mark.parametrize("make", [sl.ZV, sl.ZVD, sl.EI])
@pytest.mark.parametrize("frequency", [0.0, -1.0, np.nan, np.inf, [1.0, 0.0], [], [[1.0]], "fast", None])
def test_invalid_frequencies_are_refused(make: type, frequency: object) -> None:
    with pytest.raises(sl.InvalidValueError, match="frequency"):
        make(frequency)


@pytest.mark.parametrize("option", [-0.1, 1.0, np.nan, [0.1, 0.2, 0.3]])
@pytest.mark.parametrize(("make", "name"), [(sl.ZV, "damping_ratio"), (sl.ZVD, "damping_ratio"), (sl.EI, "tolerance")])
def test_options_out_of_range_are_refused(make: type, name: str, option: object) -> None:
    with pytest.raises(sl.InvalidValueError, match=name):
        make([1.0, 2.0], option)


def test_invalid_impulses_are_refused() -> None:
    with refused("amplitude", "2 that sum to 0.9"):
        sl.Shaper([0.0, 1.0], [0.5, 0.4])
    with refused("time[1]", "0.0 s"):
        sl.Shaper([0.0, 0.0], [0.5, 0.5])
    with refused("time[0]", "-0.1 s"):
        sl.Shaper([-0.1, 0.0], [0.5, 0.5])
    with refused("a product of shapers", "of 11907 impulses", "<= 10000"):
        sl.ZVD(np.sqrt(np.arange(1.0, 11.0)))
    with refused("the other factor", "2", "a Shaper"):
        sl.ZV(1.0) * 2  # type: ignore[operator]
