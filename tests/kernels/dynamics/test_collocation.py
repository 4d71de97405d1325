"""Exact dynamic stiffness of one cable and its count, compared with known results of strings, chains and cables."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import j0, y0

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels.dynamics import collocation
from sagline.kernels.dynamics.string import BEHIND_X, BEHIND_Y, BEHIND_Z
from tests.kernels.dynamics.strings import GRAVITY, added, chain, counted, held, string
from tests.tiers import extended, wide

# taut, sagging, very slack, almost folded: T_x, T_z [N], L [m]; 0.1 kg/m
CABLES = {
    "taut": string(300.0, 60.0, 10.0, 0.1, 2e5),
    "sagging": string(12.0, -2.0, 10.0, 0.1, 2e5),
    "deep": string(2.0, 7.0, 10.0, 0.1, 2e4),
    "almost folded": string(0.2, 4.0, 10.0, 0.1, 2e4),
}


@pytest.mark.parametrize("number", [1, 2, 9, 40])
@pytest.mark.parametrize("plane", [0, 1])
def test_taut_string(number: int, plane: int) -> None:
    table = string(30.0, 40.0, 7.0, 0.1, 1e6)
    table[0, 3] = 0.0
    exact = number / (2.0 * 7.0) * np.sqrt(50.0 / (0.1 * (1.0 + 50.0 / 1e6)))
    assert held(table, number, plane) == pytest.approx(exact, rel=1e-12)


def test_taut_string_s_stiffness() -> None:
    """At its end, lateral: N k/tan(k L) minus the chord stiffness at rest; axial: the same for a bar."""
    table = string(50.0, 0.0, 7.0, 0.1, 1e6)
    table[0, 3] = 0.0
    omega = 2.0 * np.pi * np.array([0.5, 3.0, 11.0, 60.0])
    for resistance, column in ((50.0 / (1.0 + 50.0 / 1e6), 2), (50.0 / (1.0 + 50.0 / 1e6), 3), (1e6, 0)):
        k = omega * np.sqrt(0.1 / resistance)
        exact = resistance * (k / np.tan(7.0 * k) - 1.0 / 7.0)
        assert added(table, omega / (2.0 * np.pi))[:, 0, column] == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("number", [1, 2, 5])
@pytest.mark.parametrize("upper", [True, False], ids=["from above", "from below"])
def test_heavy_vertical_chain_bessel(number: int, upper: bool) -> None:
    """Zeros of J0(a) Y0(b) - Y0(a) J0(b), a, b = 2 omega sqrt(N/(w g)) of the two ends."""
    low, high, density = 3.0, 3.0 + 0.4 * GRAVITY * 8.0, 0.4
    table = string(0.0, -low if upper else high, 8.0, density, 1e15)

    def cross(omega: float) -> float:
        a, b = (2.0 * omega * np.sqrt(end / (density * GRAVITY * GRAVITY)) for end in (low, high))
        return float(j0(a) * y0(b) - y0(a) * j0(b))

    found = 2.0 * np.pi * held(table, number, 1)
    exact = brentq(cross, 0.99 * found, 1.01 * found, xtol=1e-14)
    assert found == pytest.approx(exact, rel=1e-10)
    grid = np.linspace(1e-3, 1.001 * found, 4000)
    values = np.array([cross(omega) for omega in grid])
    assert (values[1:] * values[:-1] < 0.0).sum() == number


def extrapolated(values: Array) -> Array:
    """From three step lengths, each half of the one before, errors in even powers (Richardson)."""
    once = (4.0 * values[1:] - values[:-1]) / 3.0
    return np.asarray((16.0 * once[1] - once[0]) / 15.0)


def irvine_errors() -> list[float]:
    """Errors of Irvine's formula for the first symmetric frequency at lambda^2 = 1, sag over span halved."""
    errors = []
    for ratio in (0.02, 0.01, 0.005, 0.0025):
        span, density = 10.0, 1.0
        weight = density * GRAVITY
        horizontal = weight * span / (8.0 * ratio)
        slope = weight * span / horizontal
        stretched = span * (1.0 + slope**2 / 8.0)
        stiffness = horizontal * stretched / (slope**2 * span)  # so that lambda^2 = 1
        state = sl.Catenary().from_tension(sl.Cable(density, stiffness), span, 0.0, horizontal, GRAVITY)
        table = string(horizontal, float(state.vertical_force), float(state.unstrained_length), density, stiffness)
        root = brentq(lambda x: np.tan(x / 2.0) - x / 2.0 + 4.0 * (x / 2.0) ** 3, 3.15, 4.7)
        irvine = root / (2.0 * np.pi * span * np.sqrt(density / horizontal))
        errors.append(abs(irvine / held(table, 1, 0) - 1.0))
    return errors


def test_irvine_s_first_symmetric_frequency() -> None:
    """Level and shallow: the relative error falls with the square of sag over span."""
    errors = irvine_errors()
    assert errors == pytest.approx([1.1e-2, 2.8e-3, 7.0e-4, 1.7e-4], rel=0.05)
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx(4.0, rel=0.03)


@pytest.mark.parametrize("name", wide(CABLES))
def test_finite_elements(name: str) -> None:
    """Chains of springs: order 2, with the same extrapolated stiffness and frequencies."""
    table = CABLES[name]
    chains = [chain(table, n) for n in (80, 160, 320)]
    limit = 3e-5 if name == "almost folded" else 1e-6
    for plane in (0, 1):
        rough = np.array([np.sqrt(one.squares(plane)[:3]) / (2.0 * np.pi) for one in chains])
        exact = np.array([held(table, number, plane) for number in (1, 2, 3)])
        assert np.log2(np.abs(rough[0] - exact) / np.abs(rough[1] - exact)) == pytest.approx(2.0, abs=0.15)
        assert extrapolated(rough) == pytest.approx(exact, rel=limit)
    omega = 2.0 * np.pi * 0.7 * held(table, 1, 1)
    ends = np.array([one.end(omega) - one.end(0.0) for one in chains])
    found = added(table, omega / (2.0 * np.pi))[0, 0]
    assert extrapolated(ends) == pytest.approx(found, abs=limit * np.abs(found).max())


@extended
def test_count_against_brute_force() -> None:
    """Random cables from taut to almost folded, random frequencies: the count is that of a fine chain, up to twenty."""
    random = np.random.default_rng(12)
    for _ in range(12):
        weight = 0.1 * GRAVITY * 10.0
        table = string(weight * 10.0 ** random.uniform(-1.5, 1.5), weight * random.uniform(-1, 2), 10.0, 0.1, 1e4)
        fine = chain(table, 400)
        for plane in (0, 1):
            every = np.sqrt(fine.squares(plane)[:21]) / (2.0 * np.pi)
            between = 0.5 * (every[1:] + every[:-1])
            clear = np.flatnonzero(np.diff(every) > 0.02 * every[1:])  # error of 400 springs
            assert counted(table, between[clear])[:, 0, plane].tolist() == (clear + 1).tolist()


def test_a_singular_pivot_is_stepped_over() -> None:
    """At a frequency of the fixed cable, and at those of its elements, the count is one of its neighbors."""
    table = string(30.0, 40.0, 7.0, 0.1, 1e6)
    table[0, 3] = 0.0
    for number in range(1, 30):
        exact = held(table, number, 1)
        assert counted(table, exact)[0, 0, 1] in (number - 1, number)
        assert np.isfinite(added(table, exact * (1.0 + 1e-9))).all()


def test_a_frequency_with_too_many_elements_is_reported() -> None:
    assert (counted(CABLES["taut"], 1e12) == collocation.TOO_MANY).all()


def test_a_flexible_frame_end() -> None:
    """A taut string with a spring at its frame end, lateral and axial: tan(k L) = -k EA/spring, and the like."""
    table = string(50.0, 0.0, 7.0, 0.1, 1e6)
    table[0, 3] = 0.0
    table[0, [BEHIND_X, BEHIND_Z, BEHIND_Y]] = np.sqrt(2e-5), 0.0, 1e-2
    for resistance, give, plane, first in ((50.0 / (1.0 + 50.0 / 1e6), 1e-2, 1, 1), (1e6, 2e-5, 0, None)):

        def held_by(omega: float, resistance: float = resistance, give: float = give) -> float:
            k = omega * np.sqrt(0.1 / resistance)
            return float(np.sin(k * 7.0) + give * resistance * k * np.cos(k * 7.0))

        if first is None:  # among many lateral ones: the step of the count of axial ones
            root = brentq(held_by, 10.0, 1.1 * np.pi / 7.0 * np.sqrt(1e6 / 0.1))
            across = string(50.0, 0.0, 7.0, 0.1, 1e6)
            across[0, 3] = 0.0
            for factor, more in ((1.0 - 1e-9, 0), (1.0 + 1e-9, 1)):
                both, alone = (counted(one, factor * root / (2.0 * np.pi))[0, 0] for one in (table, across))
                assert both[0] - alone[1] == more
        else:
            root = brentq(held_by, 1.0, np.pi / 7.0 * np.sqrt(resistance / 0.1))
            assert held(table, 1, plane) == pytest.approx(root / (2.0 * np.pi), rel=1e-10)
