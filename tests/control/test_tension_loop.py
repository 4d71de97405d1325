"""The tension loop with artificial errors and at equilibria of the prototype."""

import numpy as np
import pytest

import sagline as sl
from sagline.control.null_space import NullSpace, TensionLoop, TensionSettings, null_space
from sagline.core.arrays import Array
from tests.control.stops import stops
from tests.refusal import refused

STATE = stops().state[0]
ROW = null_space(STATE)
PLANNED = STATE.cables.frame_end_tension
QUIET = TensionSettings(filter_time=1e-9)  # acts on the reading itself


def visible_error(newtons: float, row: NullSpace = ROW) -> Array:
    """An error with a given largest part that lengths can correct."""
    error = row.visible @ np.array([1.0, -2.0, 0.5, 1.5, -1.0, 0.3, 2.0, -0.7])
    return np.asarray(newtons / np.abs(error).max() * error)


def hidden_error(newtons: float) -> Array:
    """An error of the wrench only, as by an unknown load."""
    error = np.ones(8)
    error -= ROW.visible @ error
    return np.asarray(newtons / np.abs(error).max() * error)


def test_it_acts_from_three_newtons_until_half_a_newton() -> None:
    loop = TensionLoop(8, QUIET)
    courses = [(2.99, False), (3.01, True), (0.6, True), (0.51, True), (0.49, False), (0.6, False), (2.99, False)]
    for newtons, acts in courses:
        before = loop.correction
        after = loop.step(PLANNED + visible_error(newtons), PLANNED, ROW)
        assert loop.acting is acts
        assert bool((after != before).any()) is acts
        assert loop.error == pytest.approx(newtons, rel=1e-6)


def test_a_wrench_error_is_shown_and_never_fed_back() -> None:
    loop = TensionLoop(8)
    for _ in range(500):
        added = loop.step(PLANNED + hidden_error(20.0), PLANNED, ROW)
    assert not loop.acting
    assert not added.any()
    assert loop.error < 1e-9


def test_one_step_agrees_with_the_formula() -> None:
    settings, period = TensionSettings(filter_time=0.5, gain=0.02, act_above=1.0), 0.01
    loop, error = TensionLoop(8, settings, period), visible_error(100.0)
    added = loop.step(PLANNED + error, PLANNED, ROW)
    filtered = period / (0.5 + period) * error
    np.testing.assert_allclose(added, -0.02 * ROW.correction @ filtered, rtol=1e-12, atol=1e-18)
    assert loop.error == pytest.approx(100.0 * 0.01 / 0.51)
    again = loop.step(PLANNED + error, PLANNED, ROW)
    filtered += period / (0.5 + period) * (error - filtered)
    np.testing.assert_allclose(again - added, -0.02 * ROW.correction @ filtered, rtol=1e-12, atol=1e-18)


def test_wrong_zeros_are_corrected_without_motion() -> None:
    """Length errors in the null space: tensions return to the plan, within the band, without motion of the platform."""
    zeros = 5e-3 * ROW.projection @ np.random.default_rng(5).normal(size=8)
    loop, added, moved = TensionLoop(8), np.zeros(8), 0.0
    for i in range(1000):
        found = sl.forward(STATE.robot, STATE.unstrained_length + zeros + added, start=STATE.pose)
        moved = max(moved, float(np.abs(found.pose.position - STATE.pose.position).max()))
        error = found.state.cables.frame_end_tension - PLANNED
        left = np.abs(ROW.visible @ error).max()
        if i == 0:
            assert left > 3.0
        added = loop.step(PLANNED + error, PLANNED, ROW)
    assert left < 0.6
    assert not loop.acting
    assert np.abs(added + zeros).max() < np.abs(zeros).max() / 4.0
    assert moved < 2e-5


def test_corrections_are_transferred_to_the_next_pose_once() -> None:
    other = null_space(stops().state[8])
    loop = TensionLoop(8, QUIET)
    for _ in range(100):
        added = loop.step(PLANNED + visible_error(5.0), PLANNED, ROW)
    assert np.abs(added - other.projection @ added).max() > 0.05 * np.abs(added).max()
    fitted = loop.step(PLANNED, PLANNED, other)
    np.testing.assert_allclose(fitted, other.projection @ added, atol=1e-16)
    same = loop.step(PLANNED, PLANNED, other)
    np.testing.assert_array_equal(same, fitted)


def test_corrections_are_limited_without_motion() -> None:
    loop = TensionLoop(8)
    for _ in range(5000):
        added = loop.step(PLANNED + visible_error(50.0), PLANNED, ROW)
    assert np.abs(added).max() == pytest.approx(5e-3, rel=1e-12)
    assert np.abs(added).max() <= 5e-3 * (1.0 + 1e-12)
    np.testing.assert_allclose(ROW.projection @ added, added, atol=1e-16)
    for _ in range(5000):  # it returns from there
        added = loop.step(PLANNED - visible_error(50.0), PLANNED, ROW)
    np.testing.assert_allclose(ROW.projection @ added, added, atol=1e-16)
    assert np.abs(added).max() == pytest.approx(5e-3, rel=1e-12)


def test_a_frozen_loop_only_transfers_its_corrections() -> None:
    other = null_space(stops().state[8])
    loop = TensionLoop(8, QUIET)
    added = loop.step(PLANNED + visible_error(5.0), PLANNED, ROW)
    held = loop.step(PLANNED + visible_error(50.0), PLANNED, ROW, frozen=True)
    np.testing.assert_array_equal(held, added)
    assert loop.error == pytest.approx(5.0)
    fitted = loop.step(PLANNED + visible_error(50.0), PLANNED, other, frozen=True)
    np.testing.assert_allclose(fitted, other.projection @ added, atol=1e-18)


@pytest.mark.parametrize("reading", [np.nan, np.inf, -np.inf])
def test_a_nan_reading_does_not_enter_the_filter(reading: float) -> None:
    """Afterwards the loop acts as without that cycle."""
    loop, undisturbed, spoiled = TensionLoop(8), TensionLoop(8), PLANNED + visible_error(50.0)
    spoiled[2] = reading
    for each in (loop, undisturbed):
        for _ in range(20):
            added = each.step(PLANNED + visible_error(50.0), PLANNED, ROW)
    assert loop.acting
    np.testing.assert_array_equal(loop.step(spoiled, PLANNED, ROW), added)
    assert loop.error == undisturbed.error > 3.0
    after, expected = (each.step(PLANNED + visible_error(50.0), PLANNED, ROW) for each in (loop, undisturbed))
    np.testing.assert_array_equal(after, expected)
    assert (after != added).any()


def test_returned_arrays_are_copies() -> None:
    loop = TensionLoop(8, QUIET)
    added = loop.step(PLANNED + visible_error(5.0), PLANNED, ROW)
    kept = added.copy()
    loop.step(PLANNED + visible_error(5.0), PLANNED, ROW)
    np.testing.assert_array_equal(added, kept)


@pytest.mark.parametrize(
    ("name", "value", "text", "allowed"),
    [
        ("filter_time", 0.0, "0 s", "> 0 s, finite"),
        ("gain", -0.01, "-0.01", None),
        ("gain", 0.2, "0.2", "0 to 0.1"),
        ("act_above", 0.0, "0 N", None),
        ("rest_below", 3.0, "3 N", "less than act_above, 3 N"),
        ("largest", np.inf, "inf m", None),
    ],
)
def test_settings_out_of_range_are_refused(name: str, value: float, text: str, allowed: str | None) -> None:
    with refused(name, text, allowed, kind=sl.InvalidValueError):
        TensionSettings(**{name: value})
