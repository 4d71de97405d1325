"""The solver of a single cable gives the results of the cable models."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sagline as sl
from sagline.cables.solver import CableStep
from tests.refusal import refused

MODELS = [sl.Catenary(), sl.Parabolic(), sl.Empirical(), sl.Elastic(), sl.Straight()]
FIELDS = ("unstrained_length", "chord_tension", "horizontal_tension", "vertical_force", "status")


def assert_equal(step: CableStep, state: sl.CableState) -> None:
    """All values are equal bit by bit, or both are NaN."""
    np.testing.assert_array_equal(step, [getattr(state, field) for field in FIELDS])


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
@pytest.mark.parametrize("gravity", [9.81, 0.0])
def test_steps_are_the_states_of_the_model(model: sl.CableModel, gravity: float) -> None:
    rng = np.random.default_rng(5)
    cables = [sl.Cable(*pair) for pair in zip(rng.uniform(0.01, 1.0, 20), 10.0 ** rng.uniform(4, 7, 20), strict=True)]
    for cable in cables:
        solver = sl.CableSolver(cable, model, gravity=gravity)
        for span, rise, tension in zip(
            rng.uniform(0.1, 20.0, 10), rng.uniform(-9.0, 9.0, 10), 10.0 ** rng.uniform(-2, 3, 10), strict=True
        ):
            ends = float(span), float(rise)
            step = solver.from_tension(*ends, float(tension))
            assert_equal(step, model.from_tension(cable, *ends, tension, gravity))
            length = float(np.hypot(*ends)) * rng.uniform(0.95, 1.2)
            assert_equal(solver.from_length(*ends, length), model.from_length(cable, *ends, length, gravity))


@pytest.mark.parametrize("ends", [(0.0, -4.0), (0, 4), (12, -4), (np.float32(1.5), np.int8(2))])
def test_ends_that_are_not_ordinary_floats_are_those_of_the_model(ends: tuple[float, float]) -> None:
    cable, model = sl.Cable(0.067, 44e3), sl.Catenary()
    solver = sl.CableSolver(cable)
    assert_equal(solver.from_tension(*ends, 100), model.from_tension(cable, *ends, 100))
    assert_equal(solver.from_length(*ends, 13), model.from_length(cable, *ends, 13))


@given(st.sampled_from([0.0, -1.0, np.inf, np.nan, [1.0, 2.0], None, "a"]), st.integers(0, 2))
def test_bad_numbers_raise_the_error_of_the_model(value: object, place: int) -> None:
    cable, model = sl.Cable(0.067, 44e3), sl.Catenary()
    solver = sl.CableSolver(cable)
    arguments: list[object] = [12.0, -4.0, 100.0]
    arguments[place] = value
    if value == 0.0 or (value == -1.0 and place == 1):
        arguments[:2] = [0.0, 0.0]
    if isinstance(value, list):
        with refused("span, rise, tension or length"):
            solver.from_tension(*arguments)  # type: ignore[arg-type]
        return
    for own, batch in ((solver.from_tension, model.from_tension), (solver.from_length, model.from_length)):
        with pytest.raises(sl.InvalidValueError) as known:
            batch(cable, *arguments)  # type: ignore[arg-type]
        with pytest.raises(type(known.value)) as found:
            own(*arguments)  # type: ignore[arg-type]
        assert str(found.value) == str(known.value)


def test_several_cables_are_refused() -> None:
    with refused("cable"):
        sl.CableSolver(sl.Cable([0.067, 0.1], 44e3))
