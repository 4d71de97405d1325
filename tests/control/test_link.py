"""Data that a link sends, and the order of counters."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.control.link import COUNTERS, Command, Mode, Sample, Sent, newer, sent_to
from tests.control.rigs import rig, spy_of

MINE, OTHER = 7, 8


def command(mode: Mode, claims: bool) -> Command:
    return Command(5, MINE, mode, 0.1, np.full(8, 2.0), np.zeros(8), np.full(8, 100.0), np.zeros(8, dtype=bool), claims)


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize("claims", [True, False])
@pytest.mark.parametrize("owner", [0, MINE, OTHER])
def test_commands_go_to_owned_groups_and_claims_to_requested_ones(mode: Mode, claims: bool, owner: int) -> None:
    asks = claims and mode is not Mode.LEAVE
    expected = Sent.COMMAND if owner == MINE else Sent.CLAIM if asks else Sent.NOTHING
    assert sent_to(owner, command(mode, claims)) is expected


def test_a_counter_is_newer_by_less_than_half_of_its_range() -> None:
    half = COUNTERS // 2
    for known in (1, 2, half, COUNTERS - 1, COUNTERS):
        ahead = [(known - 1 + step) % COUNTERS + 1 for step in (0, 1, 99, half - 1, half, COUNTERS - 1)]
        assert [newer(counter, known) for counter in ahead] == [False, True, True, True, False, False]


def test_a_link_claims_only_requested_groups() -> None:
    link = sl.twin.Machine(sl.load_robot("article-prototype"), seed=1).link()
    owners = []
    for claims in (False, False, True, True):
        answer = link.exchange(command(Mode.HOLD, claims))
        assert isinstance(answer, Sample)
        owners.append(set(answer.owner.tolist()))
    assert owners[:2] == [{0}, {0}]
    assert owners[-1] == {MINE}


def test_a_negative_reading_is_no_tension_of_a_motor() -> None:
    control, machine = rig(home=False)
    machine.inject("cell 3 reads -4 N")
    for _ in range(30):
        control.cycle()
    control.connect()
    sample, command = control.sample, spy_of(control).commands[-1]
    assert sample is not None
    assert command is not None
    assert sample.filtered[3] < -3.0
    assert (command.tension > 100.0).tolist() == [True, True, True, False, True, True, True, True]
    assert command.tension[3] == 0.0
