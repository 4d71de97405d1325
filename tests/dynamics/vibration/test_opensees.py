"""Statics and frequencies of whole robots compared with OpenSees, as stored by `opensees.py`."""

from __future__ import annotations

import json

import numpy as np
import pytest

import sagline as sl
from tests.dynamics.vibration.opensees import COUNT, FILE, STATES

STORED = json.loads(FILE.read_text(encoding="utf-8"))["states"]


def test_every_state_is_stored() -> None:
    assert [(one["robot"], tuple(one["position_m"])) for one in STORED] == list(STATES)


@pytest.mark.parametrize("k", range(len(STATES)))
def test_frequencies_agree_with_opensees(k: int) -> None:
    name, position = STATES[k]
    state = sl.inverse(sl.load_robot(name), sl.Pose(position, np.eye(3))).state
    assert state.cables.unstrained_length == pytest.approx(STORED[k]["unstrained_length_m"], rel=1e-9)
    assert STORED[k]["moved_m"] < 2e-8  # equilibrium of OpenSees with these lengths; its platform deforms by 1e-9 m
    frequency = np.array(STORED[k]["frequency_hz"])
    found = sl.vibration(state, up_to=1.02 * float(frequency.max()))
    assert found.frequency[:COUNT] == pytest.approx(frequency, rel=5e-7)
