"""Bending cycles along a plan, compared with the states of single elements and with counts by hand."""

import tracemalloc

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused

WINCH = sl.Winch(pulley_radius=0.05, dead_cable=0.4, drum_radius=0.06)
ROBOT = sl.load_robot("cogiro").replace(winches=WINCH)


def there_and_back(times: int, rate: float = 50.0) -> sl.Path:
    points = [(0.0, 0.0, 1.0), (0.0, 0.0, 2.8)] * times + [(0.0, 0.0, 1.0)]
    return sl.quintic_path(points, durations=3.0, rate=rate)


def test_cycles_are_half_the_changes_of_state_of_each_element() -> None:
    plan = sl.inverse(ROBOT, there_and_back(2))
    found = sl.bending_cycles(plan, elements=300)
    contact = plan.state.contact
    assert contact is not None
    place = found.position[:, None]
    taut = plan.state.cables.frame_end_tension
    largest, pulley, drum = (np.zeros(found.pulley.shape) for _ in range(3))
    on_pulley = on_drum = np.zeros(found.pulley.shape, dtype=bool)
    for k in range(len(plan.unstrained_length)):
        now = (place > plan.free_length[k]) & (place < plan.free_length[k] + contact.wrapped_length[k])
        wound = place > plan.unstrained_length[k]
        if k:
            pulley += now != on_pulley
            drum += wound != on_drum
            events = (now != on_pulley) | (wound != on_drum)
            largest = np.where(events, np.maximum(largest, np.maximum(taut[k], taut[k - 1])), largest)
        on_pulley, on_drum = now, wound
    np.testing.assert_array_equal(found.pulley, pulley / 2.0)
    np.testing.assert_array_equal(found.drum, drum / 2.0)
    np.testing.assert_array_equal(found.tension, largest)
    assert (found.drum.max(axis=0) == 2.0).all()


@pytest.mark.parametrize("times", [1, 3])
def test_an_element_that_passes_a_pulley_twice_in_each_motion_back_and_forth(times: int) -> None:
    plan = sl.inverse(ROBOT, there_and_back(times, rate=1.5))  # elements pass the whole pulley between two samples
    found = sl.bending_cycles(plan)
    assert (found.pulley.max(axis=0) == 2.0 * times).all()
    assert (found.drum.max(axis=0) == times).all()
    # the end of the motion is its beginning, so that the sums of half cycles are even
    assert (found.pulley % 1.0 == 0.0).all()
    # elements near both ends of a cable do not bend
    assert (found.pulley[0] == 0.0).all()
    assert (found.tension[found.pulley + found.drum == 0.0] == 0.0).all()


def test_the_memory_does_not_grow_with_the_product_of_samples_and_elements() -> None:
    plan = sl.inverse(ROBOT, there_and_back(2))
    tracemalloc.start()
    try:
        found = sl.bending_cycles(plan, elements=30_000)
        used = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert used < 20 * found.pulley.nbytes  # samples times elements are 20 MB as flags, 200 MB as tensions
    assert (found.drum.max(axis=0) == 2.0).all()


def test_a_cable_without_a_pulley_bends_on_the_drum_only() -> None:
    bare = ROBOT.replace(winches=WINCH.replace(pulley_radius=[0.0] * 4 + [0.05] * 4))
    found = sl.bending_cycles(sl.inverse(bare, there_and_back(1)))
    assert (found.pulley.max(axis=0) == [0.0] * 4 + [2.0] * 4).all()
    assert (found.drum.max(axis=0) == 1.0).all()
    assert (found.largest >= found.pulley.max(axis=0)).all()


def test_plans_that_cannot_be_counted() -> None:
    with refused("plan", "a plan of poses without times"):
        sl.bending_cycles(sl.inverse(ROBOT, (0, 0, 2)))
    with refused("winches", "not given"):
        sl.bending_cycles(sl.inverse(sl.load_robot("cogiro"), there_and_back(1)))
    path = sl.quintic_path([(0, 0, 1), (0, 0, 40)], durations=1.0, rate=20)
    with refused(value="without a solution"):
        sl.bending_cycles(sl.inverse(ROBOT, path))
