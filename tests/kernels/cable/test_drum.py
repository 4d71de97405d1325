"""The drum compared with arc lengths by quadrature, and remembered winding with a list of pieces of cable."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from sagline.core.arrays import Array, locked
from sagline.kernels.cable import drum
from sagline.kernels.cable.drum import MEMORY_ROWS, follow_memory, lengths_of_turns, turns_of_lengths


class Given(NamedTuple):
    """A drum as in a drawing, in meters and whole turns."""

    radius: float
    diameter: float
    pitch: float
    turns: float
    layers: int
    distance: float
    offset: float
    cable: float


STUDIED = Given(0.048, 0.004, 0.004, 20.0, 4, 0.8, -0.04, 40.0)


def layer_radius(known: Given, layer: int) -> float:
    """Distance of the middle of a layer from the axis: each turn and two turns below form an equilateral triangle."""
    return known.radius + known.diameter / 2 + layer * math.sqrt(known.diameter**2 - (known.diameter / 2) ** 2)


def wound(known: Given, turns: float) -> float:
    """Length of a number of turns: the integral of the speed along the helices."""
    parts, left, layer = [0.0], turns, 0
    while left > 0.0:
        here = min(left, known.turns) if layer < known.layers - 1 else left
        radius = layer_radius(known, layer)

        def speed(angle: float, radius: float = radius) -> float:
            return math.dist(
                (-radius * math.sin(angle), radius * math.cos(angle), known.pitch / (2.0 * math.pi)), (0.0, 0.0, 0.0)
            )

        parts.append(quad(speed, 0.0, 2.0 * math.pi * here, epsabs=0.0, epsrel=2e-14)[0])
        left, layer = left - here, layer + 1
    return math.fsum(parts)


def run(known: Given, turns: float) -> float:
    """Difference of the distance to the pulley and that of the opposite exit."""
    layer = min(int(turns / known.turns), known.layers - 1)
    into = turns - layer * known.turns
    place = known.offset + known.pitch * (into if layer % 2 == 0 else known.turns - into)
    return math.dist((known.distance, place), (0.0, 0.0)) - known.distance


def tables(known: Given) -> tuple[Array, Array]:
    """Kernel arguments of a drum; the beginnings of layers by quadrature."""
    row = np.zeros((1, drum.DRUM_COLUMNS))
    row[0, drum.PITCH_RADIUS] = known.radius + known.diameter / 2
    row[0, drum.LAYER_RISE] = known.diameter * np.sqrt(3.0) / 2
    row[0, drum.GROOVE_PITCH], row[0, drum.LAYER_TURNS] = known.pitch, known.turns
    row[0, drum.LAYERS], row[0, drum.DISTANCE], row[0, drum.OFFSET] = known.layers, known.distance, known.offset
    ends = [known.turns * k for k in range(known.layers + 1)]
    starts = [known.cable - wound(known, turns) - run(known, turns) for turns in ends]
    return locked(row), locked(np.array([starts]))


def test_lengths_are_arc_lengths() -> None:
    row, starts = tables(STUDIED)
    turns = np.array([[0.0], [0.3], [7.25], [19.999], [20.0], [33.5], [40.001], [59.0], [61.7], [80.0]])
    length = np.empty(turns.shape)
    lengths_of_turns(row, starts, locked(turns.copy()), length)
    exact = [STUDIED.cable - wound(STUDIED, n) - run(STUDIED, n) for n in turns[:, 0]]
    np.testing.assert_allclose(length[:, 0], exact, rtol=0.0, atol=1e-13)


def test_the_travel_is_the_slope_of_the_length() -> None:
    row, starts = tables(STUDIED)
    turns = np.linspace(0.5, 79.5, 40)[:, None]
    length, again, travel = np.empty(turns.shape), np.empty(turns.shape), np.empty(turns.shape)
    lengths_of_turns(row, starts, locked(turns.copy()), length)
    turns_of_lengths(row, starts, locked(length.copy()), again, travel)
    high = [wound(STUDIED, n + 1e-4) + run(STUDIED, n + 1e-4) for n in turns[:, 0]]
    low = [wound(STUDIED, n - 1e-4) + run(STUDIED, n - 1e-4) for n in turns[:, 0]]
    np.testing.assert_allclose(travel[:, 0], (np.array(high) - low) / 2e-4, rtol=1e-9)


@pytest.mark.parametrize("radius", [0.02, 0.3])
def test_the_distance_to_the_exit_agrees_with_a_triangle(radius: float) -> None:
    known = STUDIED._replace(radius=radius, offset=0.0, pitch=0.006, turns=10.0, layers=1)
    row, starts = tables(known)
    length = np.empty((2, 1))
    lengths_of_turns(row, starts, locked(np.array([[0.0], [10.0]])), length)
    straight = 10.0 * np.hypot(2 * np.pi * (radius + 0.002), 0.006)
    # 60 mm off at 0.8 m: 2.25 mm, as in docs/model.md
    assert length[0, 0] - length[1, 0] - straight == pytest.approx(np.hypot(0.8, 0.06) - 0.8, abs=1e-14)
    assert np.hypot(0.8, 0.06) - 0.8 == pytest.approx(2.25e-3, abs=0.005e-3)


@given(
    radius=st.floats(1e-3, 2.0),
    diameter=st.floats(1e-4, 0.05),
    pitch=st.floats(1e-4, 0.05),
    turns=st.floats(1.0, 50.0),
    layers=st.integers(1, 7),
    distance=st.floats(1e-3, 30.0) | st.just(np.inf),
    offset=st.floats(-1.0, 1.0),
    shares=st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5),
)
def test_turns_are_recovered_for_every_drum(
    radius: float, diameter: float, pitch: float, turns: float, layers: int, distance: float, offset: float,
    shares: list[float],
) -> None:  # fmt: skip
    row = np.array(
        [[radius + diameter / 2, diameter * np.sqrt(3.0) / 2, pitch, turns, layers, distance, offset]], dtype=float
    )
    ends = turns * np.arange(layers + 1)
    each = np.hypot(2 * np.pi * (row[0, 0] + np.arange(layers) * row[0, 1]), pitch) * turns
    place = offset + pitch * turns * (np.arange(layers + 1) % 2)
    whole = each.sum() + np.hypot(1.0, 1.0 + abs(offset) + pitch * turns)
    slant = place**2 / (np.hypot(distance, place) + distance)
    starts = (whole - np.concatenate(([0.0], np.cumsum(each))) - slant)[None]
    there = np.array(shares)[:, None] * ends[-1]
    length, again, travel = np.empty((5, 1)), np.empty((5, 1)), np.empty((5, 1))
    lengths_of_turns(locked(row), locked(starts), locked(there.copy()), length)
    turns_of_lengths(locked(row), locked(starts), locked(length.copy()), again, travel)
    assert (travel > 0.0).all()
    np.testing.assert_allclose(again, there, rtol=0.0, atol=1e-14 * (whole / travel.min() + 1.0) + 1e-13)


class Pieces:
    """A drum as a list of short strained pieces of cable, the last one outermost; below them, unstrained cable."""

    def __init__(self, length: float, rest: float) -> None:
        self.path, self.rest = length * (1.0 + rest), rest
        self.pieces: list[tuple[float, float]] = []  # unstrained length, strain

    def wind_in(self, amount: float, begin: float, end: float, cuts: int = 400) -> None:
        for k in range(cuts):
            strain = begin + (end - begin) * (k + 0.5) / cuts
            self.pieces.append((amount / cuts, strain))
            self.path -= amount / cuts * (1.0 + strain)

    def pay_out(self, amount: float) -> None:
        while amount > 0.0:
            length, strain = self.pieces.pop() if self.pieces else (np.inf, self.rest)
            if length > amount:
                self.pieces.append((length - amount, strain))
            self.path += min(length, amount) * (1.0 + strain)
            amount -= length


def varied_lengths(seed: int, samples: int = 60) -> tuple[Array, Array]:
    """Lengths that increase and decrease, and strains."""
    rng = np.random.default_rng(seed)
    length = 5.0 + np.cumsum(rng.normal(scale=0.15, size=(samples, 1)), axis=0)
    return locked(length), locked(rng.uniform(0.002, 0.05, (samples, 1)))


def followed(length: Array, strain: Array, rest: float, *, unstrained: bool = True) -> Array:
    found = np.empty(length.shape)
    room = np.empty((MEMORY_ROWS, len(length)))
    follow_memory(length, strain, locked(np.array([rest])), unstrained, found, room)
    return locked(found)


@pytest.mark.parametrize("seed", range(6))
def test_remembered_winding_agrees_with_a_list_of_pieces(seed: int) -> None:
    length, strain = varied_lengths(seed)
    path = followed(length, strain, 0.01)
    slow = Pieces(length[0, 0], 0.01)
    assert path[0, 0] == slow.path
    for k in range(1, len(length)):
        change = length[k, 0] - length[k - 1, 0]
        if change < 0.0:
            slow.wind_in(-change, strain[k - 1, 0], strain[k, 0])
        else:
            slow.pay_out(change)
        assert path[k, 0] == pytest.approx(slow.path, abs=2e-8)  # a divided piece contains the change of its strain
    assert np.abs(path - 1.01 * length).max() > 1e-3


@pytest.mark.parametrize("seed", range(6))
def test_remembered_winding_in_both_directions(seed: int) -> None:
    length, strain = varied_lengths(seed, 400)
    np.testing.assert_allclose(
        followed(followed(length, strain, 0.01), strain, 0.01, unstrained=False), length, rtol=0.0, atol=3e-14
    )


def test_winding_in_and_out_restores_the_state() -> None:
    length, strain = varied_lengths(1)
    deepest = length.max()
    there = locked(np.concatenate((length, [[deepest], [deepest - 1.0], [deepest], [deepest + 1.0]])))
    path = followed(there, locked(np.concatenate((strain, np.full((4, 1), 0.03)))), 0.01)
    assert np.abs(path[:-4] - 1.01 * length).max() > 1e-3
    np.testing.assert_allclose(path[[-4, -2, -1], 0], 1.01 * there[[-4, -2, -1], 0], rtol=0.0, atol=1e-14)
    assert path[-3, 0] == pytest.approx(1.01 * deepest - 1.03, abs=1e-14)


def test_samples_without_lengths_are_skipped() -> None:
    length, strain = varied_lengths(2)
    holes = np.insert(length, [3, 10, 10, 60], np.nan, axis=0)
    filled = followed(locked(holes), locked(np.insert(strain, [3, 10, 10, 60], np.nan, axis=0)), 0.01)
    np.testing.assert_array_equal(filled[~np.isnan(holes)], followed(length, strain, 0.01)[:, 0])
    assert np.isnan(filled[np.isnan(holes)]).all()
