"""Homing with load cells and groups that are not trustworthy."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control.controller import Controller
from sagline.control.homing import WINDOW, Homing
from sagline.control.link import Sample
from sagline.control.null_space import cell_errors
from sagline.control.states import RefusedError, State
from tests.control.rigs import HOME, prototype, rig, spy_of, state_of
from tests.refusal import refused


def changed(control: Controller, change: Any) -> None:
    """Change the samples by a function from now on."""
    spy: Any = spy_of(control)
    good = spy.exchange

    def exchange(command: Any) -> Any:
        answer = good(command)
        return change(answer) if isinstance(answer, Sample) else answer

    spy.exchange = exchange


def moves(control: Controller) -> bool:
    return control.moving


def with_nan(sample: Sample) -> Sample:
    tension = sample.tension.copy()
    tension[5] = np.nan
    return sample._replace(tension=tension)


def with_age(sample: Sample) -> Sample:
    return sample._replace(age=sample.age + np.array([0.0, 0.05, 0.0, 0.0]))


@pytest.mark.parametrize(
    ("change", "ruled", "why"),
    [
        (with_nan, True, "load cell"),
        (with_nan, False, "load cell of cable 5"),
        (with_age, False, r"group 1 .* 0\.05\d* s"),
    ],
)
def test_a_jog_ends_if_tensions_are_nan_or_old(change: Any, ruled: bool, why: str) -> None:
    control, _ = rig(home=False)
    control.connect()
    control.begin_homing(HOME)
    control.start_jog(0, -0.05)
    for _ in range(20):
        control.cycle()
    assert moves(control)
    changed(control, change)
    if not ruled:  # independent of the fault rules
        control._context.faults, control._context.degrading = (), []
    for _ in range(2):
        control.cycle()
    assert not moves(control)
    assert state_of(control) is State.HOMING
    notes = [event.text for event in control.events if event.name == "jog"]
    assert re.search(why, notes[-1])
    followed = [command for command in spy_of(control).commands if command is not None][-1]
    assert followed.rate.max() == 0.0 or followed.mode.name == "HOLD"


def test_a_cell_without_a_reading_and_missing_samples_are_named() -> None:
    control, _ = rig(home=False)
    control.connect()
    changed(control, with_nan)
    with refused("homing", kind=RefusedError) as caught:
        control.home(HOME)
    assert "cable 5" in caught.value.reason
    first = control.sample
    changed(control, lambda sample: first)
    with refused("homing", kind=RefusedError) as caught:
        control.home(HOME)
    assert str(WINDOW) in caught.value.reason.split()
    assert "nan" not in str(caught.value)


def test_repeated_samples_are_counted_once() -> None:
    homing = Homing(prototype(), HOME, sl.Catenary(), sl.Closest())
    control, _ = rig()
    sample = control.sample
    assert sample is not None
    good = sample._replace(tension=homing.tension, length=homing.state.unstrained_length)
    for k in range(WINDOW - 1):
        assert not homing.look(good._replace(counter=good.counter + k))
    counter = good.counter + WINDOW - 1
    counter[2] -= 1  # of one group only
    for _ in range(3):
        assert not homing.look(good._replace(counter=counter))
    assert homing.look(good._replace(counter=good.counter + WINDOW))


def test_homing_accepts_deviations_of_five_sigma_either_way() -> None:
    control, _ = rig()
    assert control.sample is not None
    for share, agrees in ((-1.02, False), (-0.98, True), (0.98, True), (1.02, False)):
        homing, off = Homing(prototype(), HOME, sl.Catenary(), sl.Closest()), np.zeros(8)
        off[3] = share * 5.0 * np.hypot(1.0, 2.0)  # N, noise and bias of a cell
        given = control.sample._replace(tension=homing.tension + off, length=homing.state.unstrained_length)
        found = [homing.look(given._replace(counter=given.counter + k)) for k in range(WINDOW)]
        assert found == [*(WINDOW - 1) * [False], agrees], share


def test_precision_of_cells_is_that_of_the_robot() -> None:
    robot = prototype()
    assert robot.winches is not None
    deviation, bias = cell_errors(robot)
    assert (deviation.tolist(), bias.tolist()) == ([1.0] * 8, [2.0] * 8)  # default values
    noisy = robot.replace(winches=robot.winches.replace(load_cell_deviation=3.0, load_cell_bias=-4.0))
    deviation, bias = cell_errors(noisy)
    assert (deviation.tolist(), bias.tolist()) == ([3.0] * 8, [4.0] * 8)
    assert Homing(noisy, HOME, sl.Catenary(), sl.Closest()).sigma == pytest.approx(5.0, rel=1e-12)
    link: Any = sl.twin.Machine(noisy, start=HOME, seed=1).link()
    seen = Controller(noisy, link, seed=2)._context.faults[0].seen
    assert seen.noise == 3.0
    assert seen.sigma == pytest.approx(5.0, rel=1e-12)
