"""Creep compared with a numerical integration of its differential equation."""

import pickle
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sagline as sl
from tests.refusal import refused
from tests.tiers import wide

CREEP = sl.Creep(axial_stiffness=[1e6, 4e5], time=[3.0, 120.0])


def late_strain(creep: sl.Creep, time: np.ndarray, tension: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Sum of the strains of the elements by integration of delay * strain' = tension/stiffness - strain."""

    def rate(t: float, strain: np.ndarray) -> np.ndarray:
        return np.asarray((np.interp(t, time, tension) / creep.axial_stiffness - strain) / creep.time)

    found = [start]
    for begin, end in pairwise(time):  # a step ends at each corner of the tension
        found.append(solve_ivp(rate, (begin, end), found[-1], rtol=1e-11, atol=1e-16).y[:, -1])
    return np.asarray(np.sum(found, axis=1))


@pytest.mark.parametrize("settled", wide([True, False]))
def test_the_step_is_exact_for_linear_tensions(settled: bool) -> None:
    rng = np.random.default_rng(3)
    time, tension = np.cumsum(rng.uniform(0.01, 20.0, 30)), rng.uniform(50.0, 900.0, (30, 2))
    strain = CREEP.strain(time, tension, settled=settled)
    for i in range(2):
        start = tension[0, i] / CREEP.axial_stiffness if settled else np.zeros(2)
        np.testing.assert_allclose(strain[:, i], late_strain(CREEP, time, tension[:, i], start), rtol=1e-8)


def test_a_constant_tension_gives_an_exponential() -> None:
    one = sl.Creep(2e6, 40.0)
    time = np.linspace(0.0, 400.0, 7)
    np.testing.assert_allclose(
        one.strain(time, np.full(7, 500.0)), 500.0 / 2e6 * -np.expm1(-time / 40.0), rtol=1e-14, atol=1e-20
    )
    np.testing.assert_array_equal(one.strain(time, np.full(7, 500.0), settled=True), np.full(7, 500.0 / 2e6))


def test_samples_without_tension_are_bridged() -> None:
    time, tension = np.arange(5.0), np.array([100.0, 200.0, np.nan, 400.0, 500.0])
    strain = CREEP.strain(time, tension)
    whole = CREEP.strain(time, [100.0, 200.0, 300.0, 400.0, 500.0])
    np.testing.assert_allclose(strain[[0, 1, 3, 4]], whole[[0, 1, 3, 4]], rtol=1e-13)
    assert np.isnan(strain[2])


def test_it_is_pickled() -> None:
    again = pickle.loads(pickle.dumps(CREEP))
    np.testing.assert_array_equal(again.strain([0.0, 1.0], [1.0, 2.0]), CREEP.strain([0.0, 1.0], [1.0, 2.0]))


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: sl.Creep([1e6] * 3, 1.0), ("axial_stiffness and time", "of shape (3,)", "shape (), (1,) or (2,)")),
        (lambda: sl.Creep(0.0, 1.0), ("axial_stiffness", "0 N", "> 0 N, finite")),
        (lambda: sl.Creep(1e6, -1.0), ("time", "-1 s", "> 0 s, finite")),
        (lambda: CREEP.strain([0.0, 0.0], [1.0, 1.0]), ("time[1]", "0 s", "more than 0 s")),
        (lambda: CREEP.strain([0.0, 1.0], [1.0]), ("time and tension", "of shapes (2,) and (1,)")),
        (lambda: CREEP.strain([0.0], [1.0], settled=1), ("settled", "1", "True or False")),  # type: ignore[arg-type]
    ],
)
def test_wrong_values_are_refused(make: Callable[[], object], parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=sl.InvalidValueError):
        make()
