"""Pose of the platform at rest by the encoders, and kernels loaded in advance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control import real_time
from sagline.control.controller import Controller
from sagline.control.execution import ExecutionStatus
from sagline.control.states import RefusedError, State
from sagline.twin.injected import Injected
from tests.control.rigs import HOME, at, prototype, rig, state_of, with_zero_errors


def is_degraded(control: Controller) -> bool:
    return control.degraded


def test_corrections_of_the_tension_loop_do_not_move_the_estimate() -> None:
    """An encoder with an error of a millimeter, corrected by the loop: the estimate is the truth."""
    control, _ = rig()
    off = np.zeros(8)
    off[0] = 1e-3
    control._context.correction = off
    assert control.sample is not None
    true = sl.inverse(prototype(), at(0.01, -0.02, 1.49))
    control._context.locate(control.sample._replace(length=true.unstrained_length - control.zero + off), None)
    assert np.abs(control.estimate.position - [0.01, -0.02, 1.49]).max() < 1e-8


def test_a_repaired_load_cell_is_trusted_again() -> None:
    """Formerly acknowledging was refused in IDLE, although the message proposed it only there."""
    control, machine = rig()
    machine.inject(Injected("cell sticks", 3, 0.0, machine.time + 0.2, 2.5))
    control.go_to(at(0.1, 0.0, 1.5))
    assert state_of(control) is State.IDLE
    for _ in range(200):
        control.cycle()
    assert is_degraded(control)
    control.acknowledge()
    assert state_of(control) is State.IDLE
    assert not is_degraded(control)
    assert control.go_to(HOME).status is ExecutionStatus.DONE
    assert not is_degraded(control)
    with pytest.raises(RefusedError, match=r"acknowledging .*IDLE"):
        control.acknowledge()


def test_the_rule_for_the_correction_is_that_of_the_loop() -> None:
    """Formerly, with settings of 1 mm, it was reported at 5 mm: never."""
    tight = 3e-3 * sl.stiffness(sl.inverse(prototype(), HOME).state).null_lengths[:, 0]
    control, _ = rig(with_zero_errors(prototype(), tight), loop=sl.control.TensionSettings(largest=1e-3))
    for _ in range(2000):
        control.cycle()
        if state_of(control) is State.FAULT:
            break
    told = [event.text for event in control.events if event.name == "correction at its limit"]
    assert len(told) == 1
    assert "allowed: 1 mm" in told[0]


def test_a_refused_part_does_not_prevent_loading_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = list[str]()

    def trying(name: str) -> Any:
        good = getattr(real_time, name)

        def part(*arguments: Any) -> Any:
            tried.append(name)
            return good(*arguments)

        return part

    names = ["standing_at", "plan_motion", "winch_jog", "PlatformJog"]
    for name in names:
        monkeypatch.setattr(real_time, name, trying(name))
    nowhere = prototype().replace(tension_min=2000.0, tension_max=2100.0)  # no pose has such tensions
    real_time.load_kernels(nowhere, 0.01, sl.Catenary(), sl.Closest())
    assert tried == names
