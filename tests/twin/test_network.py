"""Delayed, irregular and lost messages on the lockstep clock."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.control import Command, Missing, Mode, Sample
from sagline.twin.injected import TimedQueue
from sagline.twin.link import Network
from tests.control.protocol import PERIOD
from tests.twin.pilot import HOME, Pilot

ROBOT = sl.load_robot("article-prototype")
PLAN = sl.inverse(ROBOT, HOME)


def samples(count: int, **network: Any) -> list[Sample | Missing]:
    pilot, found = Pilot(sl.twin.Machine(ROBOT, seed=3, **network).link(), PLAN), []
    for _ in range(count):
        pilot.counter += 1
        arrays = (pilot.length[0], pilot.rate[0], pilot.tension[0], pilot.enable)
        found.append(pilot.link.exchange(Command(pilot.counter, 77, Mode.HOLD, 0.1, *arrays)))
    return found


@pytest.mark.parametrize("cycles", [0, 1, 2, 3, 5])
def test_a_delay_is_a_number_of_cycles_in_each_direction(cycles: int) -> None:
    found = samples(40, delay=cycles * PERIOD)
    assert [isinstance(sample, Missing) for sample in found] == [True] * cycles + [False] * (40 - cycles)
    last = found[-1]
    assert isinstance(last, Sample)
    assert (last.counter == 41 - cycles).all()  # the first block was there before the first period
    assert (last.echo == 40 - 2 * cycles).all()
    assert np.abs(last.age).max() < 1e-9
    if cycles:
        first = found[0]
        assert isinstance(first, Missing)
        assert (first.groups, len(first.reasons), first.time) == ((0, 1, 2, 3), 4, PERIOD)


def test_part_of_a_period_counts_as_one() -> None:
    last = samples(20, delay=0.3 * PERIOD)[-1]
    assert isinstance(last, Sample)
    assert (last.counter == 20).all()
    np.testing.assert_allclose(last.age, 0.7 * PERIOD, atol=1e-9)


def test_with_jitter_and_losses_blocks_arrive_in_order() -> None:
    found = [sample for sample in samples(600, jitter=0.05, loss=0.2) if isinstance(sample, Sample)]
    counters = np.array([sample.counter for sample in found])
    assert (np.diff(counters, axis=0) >= 0).all()
    ages = np.array([sample.age for sample in found])
    assert (ages >= 0.0).all()
    assert (ages > 2 * PERIOD).any()
    assert (found[-1].discarded > 50).all()  # overtaken
    assert (found[-1].echo > 550).all()
    assert (found[-1].owner == 77).all()
    stood = np.diff(counters, axis=0) == 0
    np.testing.assert_allclose((np.diff(ages, axis=0))[stood], PERIOD, atol=1e-9)


def test_the_network_has_the_stated_properties() -> None:
    network, sent = Network(0.01, 0.02, 0.25, 4), 20_000
    way = TimedQueue()
    for k in range(sent):
        network.send(way, 0.0, k)
    late = [arrival for arrival, _ in way.due(1.0)]
    assert len(late) / sent == pytest.approx(0.75, abs=4.0 * np.sqrt(0.25 * 0.75 / sent))
    assert (min(late), max(late)) == pytest.approx((0.01, 0.03), abs=1e-5)
    assert np.mean(late) == pytest.approx(0.02, abs=4.0 * 0.02 / np.sqrt(12 * sent))


def test_messages_arrive_in_the_order_of_their_times() -> None:
    network, way = Network(0.0, 0.5, 0.0, 1), TimedQueue()
    for k in range(50):
        network.send(way, 0.01 * k, k)
    early, late = way.due(0.4), way.due(10.0)
    times = [time for time, _ in early + late]
    assert times == sorted(times)
    assert len(times) == 50
    assert all(time <= 0.4 + 1e-8 for time, _ in early)
    assert [k for _, k in early + late] != sorted(k for _, k in early + late)
