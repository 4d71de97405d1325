"""Compliance of robots with cable mass under oscillating wrenches."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from tests.dynamics.states import at, middle
from tests.tiers import wide

DAMPINGS = {
    "none": sl.Damping(),
    "stretch": sl.Damping(loss_time=3e-4),
    "air": sl.Damping(air_damping=0.01),
    "modal": sl.Damping(modal_damping=0.01),
    "all": sl.Damping(1e-4, 0.005, 0.005),
}


@pytest.mark.parametrize("name", wide(["cogiro", "ipanema-2-pulleys"]))
@pytest.mark.parametrize("damping", DAMPINGS)
def test_modes_agree_with_the_exact_stiffness(name: str, damping: str) -> None:
    found = sl.frequency_response(middle(name), np.linspace(0.0, 15.0, 31), DAMPINGS[damping])
    assert found.checked_frequency.size == found.deviation.size == 8
    # losses in the stretch of bent cables require more modes of a cable than computed
    assert found.deviation.max() < (1e-4 if DAMPINGS[damping].loss_time else 1e-5)
    assert found.deviation[0] < 1e-10


def test_at_rest_it_is_the_static_compliance() -> None:
    state = middle("cogiro")
    found = sl.frequency_response(state, [0.0])
    static = sl.stiffness(state).compliance
    for compliance in (found.compliance[0], found.massless_compliance[0]):
        assert compliance == pytest.approx(static, rel=1e-9, abs=1e-9 * np.abs(static).max())


def test_the_peak_response_is_that_of_the_mode() -> None:
    """A well separated, lightly damped mode responds with phi phi^T/(2 i zeta omega^2)."""
    state = middle("cogiro")
    damping = sl.Damping(air_damping=5e-4, loss_time=2e-5)
    modes = sl.vibration(state, up_to=12.0, damping=damping)
    apart = np.minimum(np.diff(modes.frequency, prepend=0.0), np.diff(modes.frequency, append=12.0))
    k = int(np.argmax(apart * modes.platform_share))
    found = sl.frequency_response(state, [modes.frequency[k]], damping)
    omega = 2.0 * np.pi * modes.frequency[k]
    expected = np.outer(modes.shape[:, k], modes.shape[:, k]) / (2j * modes.loss[k] * omega**2)
    assert found.compliance[0] == pytest.approx(expected, abs=2e-2 * np.abs(expected).max())


def test_massless_cables_respond_with_the_modes_of_the_platform() -> None:
    state, frequency = middle("cogiro"), np.array([1.0, 3.3, 9.0])
    found, modes = sl.frequency_response(state, frequency), sl.modes(state)
    terms = (2.0 * np.pi) ** 2 * (modes.frequency**2 - frequency[:, None] ** 2)
    summed = np.einsum("ak,fk,bk->fab", modes.shape, 1.0 / terms, modes.shape)
    assert found.massless_compliance == pytest.approx(summed, rel=1e-9, abs=1e-9 * np.abs(summed).max())


def test_strings_lower_and_split_the_peak() -> None:
    """The effect of cable mass: with 1 % damping the strings of cogiro halve the peak."""
    found = sl.frequency_response(at("cogiro", (3.0, 2.0, 2.0)), np.linspace(1.0, 8.0, 1401), DAMPINGS["modal"])
    peaks = [np.abs(one[:, 0, 0]).max() for one in (found.compliance, found.massless_compliance)]
    assert 0.40 < peaks[0] / peaks[1] < 0.45


@pytest.mark.parametrize("frequency", [[], 1.0, [[1.0]], [-1.0], [np.nan], [900.0], [1e14]])
def test_invalid_frequencies(frequency: object) -> None:
    with pytest.raises(sl.InvalidValueError, match="frequency"):
        sl.frequency_response(middle("cogiro"), frequency)  # type: ignore[call-overload]


def test_an_infeasible_pose_is_refused() -> None:
    plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((0.0, 0.0, 50.0), np.eye(3)))
    with pytest.raises(sl.InvalidValueError, match="without lengths"):
        sl.frequency_response(plan.state, [1.0])
