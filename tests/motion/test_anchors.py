"""Motion of anchors: splines against functions with known derivatives, rigid bases against rotations of points."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused

COGIRO = sl.load_robot("cogiro")
TIME = np.linspace(0.0, 10.0, 401)


def base(rate: float = 40.0, end: float = 10.0, roll: float = 0.1) -> sl.Path:
    """A ship that goes ahead, heaves, rolls and yaws."""
    time = np.linspace(0.0, end, round(end * rate) + 1)
    place = np.stack((0.4 * time, 0.1 * np.sin(time), 0.2 * np.cos(0.8 * time)), axis=-1)
    pose = sl.Pose.from_euler(place, 0.2 * np.sin(0.5 * time), 0.0, roll * np.sin(0.9 * time))
    return sl.path_from_samples(time, pose)


def test_splines_of_a_cubic_motion_are_exact() -> None:
    powers = np.stack((TIME, TIME**2, TIME**3), axis=-1)
    anchors = sl.AnchorMotion(TIME, COGIRO.frame_anchors + powers[:, None] * [1.0, 0.1, 0.01])
    at = np.array([0.013, 4.4444, 10.0])
    np.testing.assert_allclose(anchors.at(at)[:, 3, 2] - COGIRO.frame_anchors[3, 2], 0.01 * at**3, atol=1e-12)
    np.testing.assert_allclose(anchors.velocity(at)[:, 3, 1], 0.2 * at, atol=1e-11)
    np.testing.assert_allclose(anchors.acceleration(at)[:, 3, 2], 0.06 * at, atol=1e-8)
    np.testing.assert_allclose(anchors.at(TIME), anchors.position, rtol=1e-15)
    assert anchors.at(1.0).shape == (8, 3)
    assert not anchors.velocity(1.0).flags.writeable


@pytest.mark.parametrize(("samples", "most"), [(20, 1e-4), (40, 3e-6)])
def test_errors_of_a_sinusoidal_motion_agree_with_the_documentation(samples: int, most: float) -> None:
    time = np.linspace(0.0, 10.0 * np.pi, 5 * samples + 1)
    anchors = sl.AnchorMotion(time, np.sin(time)[:, None, None] * np.ones(3))
    between = np.linspace(time[0], time[-1], 20_001)
    error = np.abs(anchors.at(between)[:, 0, 0] - np.sin(between)).max()
    assert 0.5 * most < error < most


def test_a_rigid_base_carries_its_anchors() -> None:
    ship = base()
    anchors = sl.anchors_on_bases(COGIRO, [(ship, [0, 1, 5])])
    for k in (0, 77, 400):
        turned = COGIRO.frame_anchors @ ship.pose.matrix[k].T + ship.pose.position[k]
        np.testing.assert_allclose(anchors.position[k, [0, 1, 5]], turned[[0, 1, 5]], atol=1e-14)
        np.testing.assert_array_equal(anchors.position[k, [2, 3, 4, 6, 7]], COGIRO.frame_anchors[[2, 3, 4, 6, 7]])
    lever = anchors.position[:, 5] - ship.pose.position
    velocity = ship.twist[:, :3] + np.cross(ship.twist[:, 3:], lever)
    np.testing.assert_allclose(anchors.velocity(ship.time)[3:-3, 5], velocity[3:-3], atol=1e-5)


def test_bases_with_different_times_keep_the_splines_of_their_samples() -> None:
    one, other = base(), base(rate=13.0)
    both = sl.anchors_on_bases(COGIRO, [(one, range(4)), (other, range(4, 8))])
    assert set(both.time) == set(one.time) | set(other.time)
    for ship, cables in ((one, [0, 1, 2, 3]), (other, [4, 5, 6, 7])):
        alone = sl.anchors_on_bases(COGIRO, [(ship, range(8))])
        for name in ("at", "velocity", "acceleration"):
            found, expected = getattr(both, name)(TIME)[:, cables], getattr(alone, name)(TIME)[:, cables]
            np.testing.assert_allclose(found, expected, atol=1e-9)
    shorter = sl.anchors_on_bases(COGIRO, [(one, [0]), (base(end=4.0), [1])])
    assert shorter.time[-1] == 4.0


def test_pickled_anchors_are_equal() -> None:
    anchors = sl.anchors_on_bases(COGIRO, [(base(), range(8))])
    again = pickle.loads(pickle.dumps(anchors))
    np.testing.assert_array_equal(again.position, anchors.position)
    assert not again.position.flags.writeable
    fastest = np.linalg.norm(anchors.velocity(TIME), axis=-1).max()
    said = f"Motion of anchors: 401 samples of 8 anchors, 10 s, up to {fastest:.3g} m/s"
    assert repr(anchors).replace("\N{NO-BREAK SPACE}", " ") == said


def with_pulleys(**changes: Any) -> sl.Robot:
    return COGIRO.replace(winches=sl.Winch(0.05, **changes))


REFUSED: dict[str, tuple[Callable[[], object], dict[str, str]]] = {
    "one time": (
        lambda: sl.AnchorMotion([0.0], COGIRO.frame_anchors[None]),
        {"item": "position", "value": "of shape (1, 8, 3) with 1 time"},
    ),
    "no batch": (lambda: sl.AnchorMotion([0.0, 1.0], COGIRO.frame_anchors), {"item": "position"}),
    "another time": (
        lambda: sl.AnchorMotion([0.0, 1.0], np.zeros((3, 8, 3))),
        {"value": "of shape (3, 8, 3) with 2 times"},
    ),
    "beyond": (
        lambda: sl.anchors_on_bases(COGIRO, [(base(), [0])]).at([1.0, 10.5]),
        {"item": "time", "value": "10.5 s", "allowed": "0 s to 10 s, the samples of anchors"},
    ),
    "no pairs": (lambda: sl.anchors_on_bases(COGIRO, [base()]), {"item": "bases[0]"}),  # type: ignore[list-item]
    "a path": (lambda: sl.anchors_on_bases(COGIRO, base()), {"item": "bases[0]"}),  # type: ignore[arg-type]
    "none": (lambda: sl.anchors_on_bases(COGIRO, []), {"item": "bases", "value": "empty"}),
    "no cable": (lambda: sl.anchors_on_bases(COGIRO, [(base(), [8])]), {"item": "bases[0]: cable", "value": "8"}),
    "twice": (
        lambda: sl.anchors_on_bases(COGIRO, [(base(), [1, 2]), (base(), [2])]),
        {"item": "bases[1]: cable", "value": "2", "allowed": "a cable on one base"},
    ),
    "apart": (
        lambda: sl.anchors_on_bases(
            COGIRO, [(base(), [0]), (sl.path_from_samples([11.0, 12.0], np.zeros((2, 3))), [1])]
        ),
        {"item": "bases: time", "value": "of one base until 10 s, of another from 11 s"},
    ),
    "tilted pulleys": (
        lambda: sl.anchors_on_bases(with_pulleys(), [(base(), [3])]),
        {
            "item": "bases[0]: pose",
            "value": "tilted by 5.73 deg at 8.725 s",
            "allowed": "without tilt, because it carries pulleys",
        },
    ),
    "turned swivel axes": (
        lambda: sl.anchors_on_bases(with_pulleys(swivel_axis=(0.6, 0.0, 0.8)), [(base(roll=0.0), [3])]),
        {"item": "bases[0]: pose"},
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_motions_are_refused(name: str) -> None:
    call, parts = REFUSED[name]
    with refused(**parts):  # type: ignore[arg-type]
        call()


def test_level_bases_carry_pulleys() -> None:
    anchors = sl.anchors_on_bases(with_pulleys(), [(base(roll=0.0), range(8))])
    assert np.ptp(anchors.position[:, 0, 0]) > 3.0


def test_times_of_bases_that_differ_by_rounding_count_as_one() -> None:
    robot, time = sl.load_robot("cogiro"), np.linspace(0.0, 10.0, 101)
    place = np.outer(np.sin(0.6 * time), [0.3, 0.0, 0.2])
    bases = [
        (sl.path_from_samples(each, sl.Pose(place)), cables)
        for each, cables in ((time, range(4)), (time.round(9), range(4, 8)))
    ]
    anchors = sl.anchors_on_bases(robot, bases)
    assert np.diff(anchors.time).min() > 0.09
    exact = 0.6 * np.cos(0.6 * time)[:, None] * [0.3, 0.0, 0.2]
    np.testing.assert_allclose(anchors.velocity(time), np.repeat(exact[:, None], 8, axis=1), rtol=0.0, atol=1e-5)
