"""Nodes of a chain at the frame: conservation at births and merges, and the energy of released cable, in numpy."""

from typing import NamedTuple

import numpy as np
import pytest

from sagline.core.arrays import Array
from sagline.kernels.dynamics import chain as c
from sagline.kernels.jit import entry

ROOM = 9


@entry
def divide(place: Array, speed: Array, count: int, row: Array, born: int) -> None:
    if born > 0:
        c.insert_node(place, speed, count, row)
    else:
        c.merge_nodes(place, speed, count, row)


@entry
def look(place: Array, speed: Array, count: int, row: Array, pulls: Array, seen: Array) -> None:
    c.fill_frame_node_velocity(place, speed, count, row)
    seen[0] = c.fill_element_forces(place, speed, count, row, pulls)
    seen[1], seen[2] = c.potential(place, count, row)
    seen[3] = c.kinetic(speed, count, row)
    seen[4] = c.whole_force(place, speed, count, row, pulls)


class Chain(NamedTuple):
    """A chain of five elements in any motion, with nodes from the platform to the exit."""

    place: Array
    speed: Array
    row: Array
    rest: float
    rate: float
    free: int = 4

    @property
    def masses(self) -> Array:
        """Masses of its nodes [kg], both ends included."""
        lengths = np.append(np.full(self.free, self.row[c.ELEMENT]), self.rest)
        halves = 0.5 * self.row[c.DENSITY] * lengths
        masses: Array = np.append(halves, 0.0) + np.append(0.0, halves)
        return masses

    @property
    def known(self) -> Array:
        """The whole row of the chain table."""
        row = self.row.copy()
        row[[c.REST, c.RATE]] = self.rest, self.rate
        return row

    def sum(self, rows: Array) -> Array:
        """Sum over the masses of the nodes of rows (3, P)."""
        total: Array = rows[:, : self.free + 2] @ self.masses
        return total


def a_chain(seed: int, share: float, behind: float = 0.0) -> Chain:
    """Five elements, the one at the frame with a part of its length, strained by about 2 %."""
    rng = np.random.default_rng(seed)
    row = np.zeros(c.CHAIN_COLUMNS)
    row[c.EXIT_X : c.EXIT_Z + 1] = rng.uniform(-5, 5, 3)
    row[[c.ELEMENT, c.DENSITY, c.STIFFNESS]] = rng.uniform(0.1, 2), rng.uniform(0.01, 1), rng.uniform(1e4, 1e6)
    rest, rate = share * row[c.ELEMENT], rng.uniform(-2, 2)
    lengths = np.append(np.full(4, row[c.ELEMENT]), rest)
    steps = rng.normal(size=(5, 3)) * 0.3 + [1.0, 0.5, -1.0]
    steps *= (lengths * rng.uniform(1.01, 1.03, 5) / np.linalg.norm(steps, axis=1))[:, None]
    place, speed = np.zeros((3, ROOM)), np.zeros((3, ROOM))
    place[:, :6] = (row[c.EXIT_X : c.EXIT_Z + 1] - np.cumsum(steps[::-1], axis=0)[::-1]).T @ np.eye(5, 6)
    place[:, 5] = row[c.EXIT_X : c.EXIT_Z + 1]
    speed[:, :5] = rng.normal(size=(3, 5))
    speed[:, 5] = rate * (place[:, 4] - place[:, 5]) / rest
    last = np.linalg.norm(place[:, 4] - place[:, 5])
    row[c.BEHIND], row[c.RUN], row[c.GRAVITY] = behind, behind * last / rest, 9.81
    return Chain(place, speed, row, rest, rate)


def tension(chain: Chain) -> float:
    """Tension of the element at the frame [N]."""
    way = np.linalg.norm(chain.place[:, chain.free] - chain.place[:, chain.free + 1]) + chain.row[c.RUN]
    return float(chain.row[c.STIFFNESS] * (way / (chain.rest + chain.row[c.BEHIND]) - 1.0))


def divided(chain: Chain, more: int) -> Chain:
    """The chain after a birth or a merge."""
    place, speed = chain.place.copy(), chain.speed.copy()
    divide(place, speed, chain.free, chain.known, more)
    return Chain(place, speed, chain.row, chain.rest - more * chain.row[c.ELEMENT], chain.rate, chain.free + more)


@pytest.mark.parametrize("more", [1, -1])
@pytest.mark.parametrize("behind", [0.0, 3.0])
def test_births_and_merges_conserve_length_mass_and_momentum(more: int, behind: float) -> None:
    for seed in range(50):
        before = a_chain(seed, 1.6 if more > 0 else 0.4, behind)
        after = divided(before, more)
        assert after.free * after.row[c.ELEMENT] + after.rest == pytest.approx(4 * after.row[c.ELEMENT] + before.rest)
        assert after.masses.sum() == pytest.approx(before.masses.sum(), rel=1e-14)
        scale = np.abs(before.speed).max() * before.masses.sum()
        assert after.sum(after.speed) == pytest.approx(before.sum(before.speed), abs=1e-14 * scale)
        entering = after.rate * (after.place[:, after.free] - after.place[:, after.free + 1]) / after.rest
        assert after.speed[:, after.free + 1] == pytest.approx(entering, abs=1e-13)
        assert (after.place[:, after.free + 1] == before.place[:, 5]).all()


@pytest.mark.parametrize("behind", [0.0, 3.0])
def test_a_birth_conserves_the_tension_and_without_dead_length_the_center_of_mass(behind: float) -> None:
    for seed in range(50):
        before = a_chain(seed, 1.6, behind)
        after = divided(before, 1)
        assert tension(after) == pytest.approx(tension(before), rel=1e-9)
        inner = np.linalg.norm(after.place[:, 4] - after.place[:, 5]) / after.row[c.ELEMENT] - 1.0
        assert after.row[c.STIFFNESS] * inner == pytest.approx(tension(before), rel=1e-9)
        if behind == 0.0:
            assert after.sum(after.place) == pytest.approx(before.sum(before.place), rel=1e-13, abs=1e-13)


def looked_at(chain: Chain, time: float = 0.0) -> Array:
    """Lost power, strain, potential and kinetic energy, and H after a short time at constant speeds [W, J, J, J, N]."""
    place, speed, pulls, seen = chain.place.copy(), chain.speed.copy(), np.zeros(4 * ROOM), np.zeros(5)
    place[:, : chain.free + 1] += time * speed[:, : chain.free + 1]
    look(place, speed, chain.free, chain._replace(rest=chain.rest + time * chain.rate).known, pulls, seen)
    return seen


def test_released_cable_changes_the_strain_energy_by_h() -> None:
    """With fixed nodes, d(energy)/dL is -H, compared with differences; the released cable adds its momentum."""
    for seed in range(20):
        chain = a_chain(seed, 1.0, behind=2.0)
        still = chain._replace(speed=np.zeros_like(chain.speed))
        step = 1e-6 / chain.rate
        energy = [looked_at(still, time)[1:4].sum() for time in (-step, step)]
        entering_part = looked_at(still._replace(rate=1e-12))[4]  # H without kinetic terms
        assert (energy[1] - energy[0]) / 2e-6 == pytest.approx(-entering_part, rel=1e-6)


def test_elements_dissipate_by_their_strain_rates() -> None:
    """Power lost = sum of EA eta l strain_rate^2, the strain rates by differences."""
    for seed in range(20):
        chain = a_chain(seed, 1.0)
        chain.row[c.LOSS_TIME] = 1e-6
        lengths = np.append(np.full(4, chain.row[c.ELEMENT]), chain.rest)
        h = 1e-6
        strains = []
        for time in (-h, h):
            place = chain.place.copy()
            place[:, :5] += time * chain.speed[:, :5]
            now = lengths + np.array([0, 0, 0, 0, 1.0]) * chain.rate * time
            strains.append(np.linalg.norm(np.diff(place[:, :6], axis=1), axis=0) / now - 1.0)
        rates = (strains[1] - strains[0]) / (2 * h)
        expected = chain.row[c.STIFFNESS] * 1e-6 * (lengths * rates**2).sum()
        assert looked_at(chain)[0] == pytest.approx(expected, rel=1e-6)
