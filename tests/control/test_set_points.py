"""Deviations of lengths from a plan decay no faster than the jog speed of a winch, and the tension loop waits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, make_interp_spline

import sagline as sl
from sagline.control.checks import plan_motion
from sagline.control.link import RAMP
from sagline.control.set_points import LEAD_SPEED, Along, _Fade
from sagline.control.states import RefusedError
from tests.control.rigs import at, prototype, rig, spy_of

PERIOD = 0.01


@pytest.mark.parametrize("size", [0.0, 1e-6, 1e-3, 5e-3, 0.03])
def test_a_lead_decays_smoothly_within_its_speed(size: float) -> None:
    lead = size * np.array([1.0, -0.5, 0.0])
    fade, lengths, rates = _Fade(lead, PERIOD), [lead], [np.zeros(3)]
    while (left := fade.step()) is not None:
        lengths.append(left[0])
        rates.append(left[1])
    lengths.append(np.zeros(3))
    rates.append(np.zeros(3))
    assert fade.done
    steps = np.diff(lengths, axis=0)
    assert np.abs(rates).max() <= LEAD_SPEED * (1.0 + 1e-12)
    assert np.abs(steps).max() <= LEAD_SPEED * PERIOD * (1.0 + 1e-9)
    assert np.abs(steps - 0.5 * PERIOD * np.add(rates[1:], rates[:-1])).max() <= 1e-3 * size
    assert np.abs(np.sum(steps, axis=0) + lead).max() < 1e-15
    assert len(lengths) == (2 if size == 0.0 else 21 if size <= 1e-3 else round(1.5 * size / LEAD_SPEED / PERIOD) + 1)


def test_between_two_rows_lengths_are_cubic_and_tensions_linear() -> None:
    path = sl.quintic_path([(0, 0, 1.5), (0.3, 0.2, 1.4)], speed=0.3)
    motion = plan_motion(prototype(), path, PERIOD, sl.Catenary(), sl.Closest())
    rows = np.arange(len(motion))
    length = CubicHermiteSpline(PERIOD * rows, motion.length, motion.rate)
    tension = make_interp_spline(PERIOD * rows, motion.tension, k=1)
    drum = make_interp_spline(PERIOD * rows, motion.drum_tension, k=1)
    along = Along(motion, PERIOD, np.zeros(8))
    for _ in range(100):
        along.step()
    along.pause()
    fractions = []
    for cycle in range(1, 20):
        point, clock = along.step(), along.clock
        fractions.append(clock / PERIOD % 1.0)
        np.testing.assert_allclose(point.length, length(clock), atol=1e-12)
        np.testing.assert_allclose(point.rate, (1.0 - cycle * PERIOD / RAMP) * length(clock, 1), atol=1e-9)
        np.testing.assert_allclose(point.tension, tension(clock), rtol=1e-9)
        np.testing.assert_allclose(point.drum_tension, drum(clock), rtol=1e-9)
    assert sum(0.1 < fraction < 0.4 or 0.6 < fraction < 0.9 for fraction in fractions) > 5


def test_a_platform_jog_after_a_winch_jog_is_slow_and_the_loop_waits() -> None:
    """Formerly the lead decayed within 0.4 s, 31 mm/s at a winch, and the loop treated it as an error."""
    control, _ = rig()
    control.jog(3, 8e-3)
    control.jog_platform([2e-3, 0.0, 0.0])
    followed = [command for command in spy_of(control).commands if command and command.mode == 2]
    lengths, rates = (np.array([getattr(command, name) for command in followed]) for name in ("length", "rate"))
    assert np.abs(rates).max() < LEAD_SPEED + 0.008  # 1.5 x 2 mm in 0.4 s in addition
    assert np.abs(np.diff(lengths, axis=0)).max() < (LEAD_SPEED + 0.008) * PERIOD


def test_the_tension_loop_learns_nothing_from_a_lead() -> None:
    """Formerly it treated the effect of the lead as an error, and changed lengths by a millimeter."""
    control, _ = rig()
    control.jog(3, 18e-3)
    x, y, z = control.estimate.position
    done = control.go_to(at(x + 0.05, y, z))
    assert done.status.name == "DONE"
    assert not done.correction.any()


def test_a_lead_above_five_millimeters_is_refused_except_its_reduction() -> None:
    control, _ = rig()
    control.jog(3, 0.03)
    for begin in (lambda: control.start_jog_platform([1e-3, 0, 0]), lambda: control.go_to(at(0.1, 0.0, 1.5))):
        with pytest.raises(RefusedError, match=r"winch \d [^+-]*[+-][\d.]+ mm") as caught:
            begin()
        assert caught.value.reason.endswith("allowed: 5 mm")
    control.jog(3, -0.03)
    assert control.go_to(at(0.02, 0.0, 1.5)).status.name == "DONE"
