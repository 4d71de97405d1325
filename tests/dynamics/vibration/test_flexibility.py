"""Derivatives of the flexibility of cables compared with complex steps of its integral over the cable."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.vibration.flexibility import Flexibility
from tests.dynamics.linear_systems import flexibility_of, stretch_of
from tests.tiers import wide

STEP = 1e-30


class Hanging(NamedTuple):
    force: Array
    weight: float
    length: float
    stiffness: float


def cables(count: int, seed: int) -> Iterator[Hanging]:
    """Taut to very slack, level to steep, with the lowest point inside or outside."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        length, weight, stiffness = 10.0 ** rng.uniform([0.0, -3.0, 4.0], [2.0, 2.0, 7.0])
        size = weight * length / 10.0 ** rng.uniform(-6.0, 0.3)
        azimuth, slope = rng.uniform([-np.pi, -1.5], [np.pi, 1.5])
        level = max(size * np.cos(slope), 0.02 * weight * length)
        up = size * np.sin(slope) + rng.choice([0.0, 0.5]) * weight * length
        force = np.array([level * np.cos(azimuth), level * np.sin(azimuth), up])
        yield Hanging(force, weight, length, stiffness)


def state_of(one: Hanging) -> sl.Equilibrium:
    """A cable as a part of a state: only its force, length and data are used."""
    robot = sl.Robot(
        "one", [[0, 0, 0]], [[0, 0, 0]], sl.Cable(one.weight, one.stiffness), 1.0, motion_pattern="3T", gravity=1.0
    )
    level = np.array([np.hypot(*one.force[:2])])
    up, length = one.force[2:], np.array([one.length])
    cables = sl.CableState(
        sl.Catenary(), robot.cables, 1.0, level, level, length, level, up, level, np.zeros(1, dtype=np.int8)
    )
    return sl.Equilibrium(robot, sl.Pose(np.zeros(3), np.eye(3)), np.zeros(6), cables)


@pytest.mark.parametrize("count", [10, *wide([40], first=0), pytest.param(2000, marks=pytest.mark.soak)])
def test_derivatives_agree_with_complex_steps(count: int) -> None:
    for one in cables(count, seed=3):
        force, weight, length, stiffness = one
        found = Flexibility(state_of(one), force[None])
        size = np.linalg.norm(force)
        for k, push in enumerate(np.eye(3)):
            by_force = flexibility_of(force + 1j * STEP * size * push, weight, length, stiffness)
            close(found.by_force[0, :, :, k], by_force.imag / (STEP * size))
        small = 1.0 + 1j * STEP
        close(found.by_density[0], flexibility_of(force, weight * small, length, stiffness).imag / (STEP * weight))
        close(found.by_length[0], flexibility_of(force, weight, length * small, stiffness).imag / (STEP * length))
        by_stiffness = flexibility_of(force, weight, length, stiffness * small).imag / (STEP * stiffness)
        close(found.by_stiffness[0], by_stiffness, 1e-12)
        close(found.stretch[0], stretch_of(force, weight, length, stiffness))


def close(found: Array, expected: Array, tolerance: float = 2e-13) -> None:
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance * np.abs(expected).max())


def test_vertical_cables_are_regular() -> None:
    up = Hanging(np.array([0.0, 0.0, -200.0]), 2.0, 10.0, 1e5)
    aside = up._replace(force=np.array([0.0, 2e-9, -200.0]))
    found, near = (Flexibility(state_of(one), one.force[None]) for one in (up, aside))
    for mine, other in zip(vars(found).values(), vars(near).values(), strict=True):
        assert np.isfinite(mine).all()
        np.testing.assert_allclose(mine, other, rtol=1e-9, atol=1e-10 * np.abs(mine).max())


def test_a_slack_weightless_cable_has_none() -> None:
    plan = sl.forward(sl.load_robot("cogiro"), np.full(8, 40.0), model=sl.Elastic())
    state = plan.state
    force = np.zeros((8, 3))
    assert (state.cables.horizontal_tension == 0.0).any()
    found = Flexibility(state, force)
    slack = (state.cables.horizontal_tension == 0.0) & (state.cables.vertical_force == 0.0)
    assert (found.by_force[slack] == 0.0).all()
    assert (found.by_length[slack] == 0.0).all()
