"""Drums of a robot: conversions between lengths off the drum, turns on the drum and encoder counts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array, checked, kernel_input, locked, refuse_first
from sagline.core.errors import InvalidValueError
from sagline.kernels.cable import drum
from sagline.kernels.codes import CATENARY
from sagline.robot.batch import cables_of, drum_heights, on_platform
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.robot.routing import actual_routing, differs, tension_after
from sagline.robot.winch import Winch

ROUNDING: Final = 1e-6  # turns; tolerance of the check that the number of turns on a drum is possible
_ZERO_STEP: Final = (
    "Give it in the robot file, or determine it with home(robot, pose, frame_end_tension) and save the new robot; "
    "then plan again."
)


class Drums:
    """Drums of m cables. All lengths are lengths off the drums at the winding tension.

    Attributes:
        winches: The winch data, fields of shape (m,).
        table: Drum data for kernels, shape (m, DRUM_COLUMNS).
        starts: Length off the drum at which each layer begins [m], shape (m, layers + 1); -inf after an endless layer.
        rest_strain: Strain of the cable on the drum, shape (m,).
        fewest: Smallest number of turns on the drum, shape (m,): 0, or -inf if the length of the cable is not known.
        most: Largest number of turns on the drum, shape (m,); inf if not known.
    """

    def __init__(self, robot: Robot) -> None:
        """Drums of a robot. The winches must have drum_radius and groove_pitch, and the cables a diameter."""
        # Drums with several layers also need drum_width and cable_length. A drum_distance also requires cable_length.
        winches, diameter = robot.winches, robot.cables.diameter
        names = ["drum_radius", "groove_pitch"]
        if winches is not None and (winches.layers > 1.0).any():
            names += ["drum_width", "cable_length"]
        elif winches is not None and winches.drum_distance is not None:
            names += ["cable_length"]
        missing = [f"winches: {name}" for name in names if winches is None or getattr(winches, name) is None]
        if diameter is None:
            missing.append("cables: diameter")
        if winches is None or diameter is None or missing:
            step = "Give them in the robot file, or with robot.replace(winches=Winch(...), cables=Cable(...))."
            raise InvalidValueError(*not_given(missing), "a known value for each drum", step)
        self.winches = winches
        self.table, self.starts = _tables(winches, diameter)
        self.rest_strain, self.fewest, self.most = _limits(winches, robot)

    def turns(self, length: Array) -> tuple[Array, Array]:
        """Turns on the drums and change of length per turn [m] for lengths off the drums (N, m) [m]; NaN stays NaN."""
        turns, travel = self._turns(length)
        if (wrong := self._off(turns)) is not None:
            sample, i = wrong
            stretch = 1.0 + self.rest_strain[i]
            low, high = self._ends(i) / stretch
            item = _at("unstrained length", sample, i, len(length))
            raise self._refusal(item, f"{length[wrong] / stretch:.6g} m", f"{low:.6g} to {high:.6g} m", turns, wrong)
        return turns, travel

    def lengths(self, turns: Array) -> Array:
        """Lengths off the drums [m] for `turns` on the drums, both of shape (N, m)."""
        length = np.empty(turns.shape)
        drum.lengths_of_turns(self.table, self.starts, kernel_input(turns, turns.shape), length)
        return length

    def counts(self, length: Array) -> Array:
        """Encoder counts, not rounded, for lengths off the drums [m], both of shape (N, m)."""
        zero, rate = self.zero_and_rate()
        turns, _ = self.turns(length)
        found: Array = self.winches.count_zero + (zero - turns) * rate
        return found

    def lengths_at(self, counts: Array) -> Array:
        """Lengths off the drums [m] for encoder counts, both of shape (N, m)."""
        zero, rate = self.zero_and_rate()
        turns = zero - (counts - self.winches.count_zero) / rate
        if (wrong := self._off(turns)) is not None:
            sample, i = wrong
            ends = self.winches.count_zero[i] + (zero[i] - np.array([self.fewest[i], self.most[i]])) * rate[i]
            allowed = f"{np.ceil(ends.min()):.0f} to {np.floor(ends.max()):.0f}"
            raise self._refusal(_at("count", sample, i, len(counts)), f"{counts[wrong]:.12g}", allowed, turns, wrong)
        lengths = self.lengths(turns)
        if (negative := lengths < 0.0).any():
            sample, i = (int(k) for k in np.argwhere(negative)[0])
            value = f"{counts[sample, i]:.12g}, a length of {lengths[sample, i]:.6g} m off the drum"
            step = "Correct the count, or count_zero, length_zero and gear of the winches."
            raise InvalidValueError(_at("count", sample, i, len(counts)), value, "a length of at least 0 m", step)
        return lengths

    def zero_and_rate(self) -> tuple[Array, Array]:
        """Turns on the drums at length_zero, and encoder counts per turn that is paid out, both (m,)."""
        per_turn, length = _given(self.winches, "counts_per_turn"), _given(self.winches, "length_zero", _ZERO_STEP)
        turns, _ = self._turns(length[None])
        if (wrong := self._off(turns)) is not None:
            low, high = self._ends(wrong[1])
            item, allowed = f"winches: length_zero[{wrong[1]}]", f"{low:.6g} to {high:.6g} m"
            raise self._refusal(item, f"{length[wrong[1]]:.6g} m", allowed, turns, wrong)
        return turns[0], self.winches.gear * per_turn

    def _turns(self, length: Array) -> tuple[Array, Array]:
        turns, travel = np.empty(length.shape), np.empty(length.shape)
        drum.turns_of_lengths(self.table, self.starts, kernel_input(length, length.shape), turns, travel)
        return turns, travel

    def _off(self, turns: Array) -> tuple[int, int] | None:
        """Sample and cable of the first value of `turns` that is out of range; None if all values are possible."""
        wrong = (turns > self.most + ROUNDING) | (turns < self.fewest - ROUNDING)
        if not wrong.any():
            return None
        sample, cable = np.argwhere(wrong)[0]
        return int(sample), int(cable)

    def _ends(self, cable: int) -> Array:
        """Smallest and largest possible length off the drum of a cable [m]."""
        most = float(self.most[cable])
        low = self.lengths(np.full((1, len(self.most)), most))[0, cable] if most < np.inf else 0.0
        return np.array([max(low, 0.0), self.starts[cable, 0]])

    def _refusal(self, item: str, value: str, allowed: str, turns: Array, wrong: tuple[int, int]) -> InvalidValueError:
        cable = wrong[1]
        whole = _given(self.winches, "cable_length")[cable]
        step = f"There are {whole:g} m of cable (winches: cable_length); correct this or the given value."
        if turns[wrong] > self.most[cable]:
            count = int(self.winches.layers[cable])
            full = f"{count} layer{'s' * (count > 1)}, {self.most[cable]:g} turns"
            step = f"The drum is full with {full}; correct it, or give more layers or less cable_length."
        return InvalidValueError(item, value, allowed, step)


def has_drum_data(robot: Robot) -> bool:
    """True if the robot has all data of its winches that the computation of lengths from counts needs."""
    names = ("drum_radius", "groove_pitch", "counts_per_turn", "length_zero")
    return robot.winches is not None and all(getattr(robot.winches, name) is not None for name in names)


def not_given(names: Sequence[str]) -> tuple[str, str]:
    """Item and value of a message about missing fields; names: type and field, such as "winches: drum_radius"."""
    if len(names) == 1:
        return names[0], "not given"
    kinds = groupby((name.split(": ", 1) for name in names), key=lambda words: words[0])
    grouped = (f"{kind}: {', '.join(word for _, word in each)}" for kind, each in kinds)
    return "the robot", f"without {', '.join(grouped)}"


def _tables(winches: Winch, diameter: Array) -> tuple[Array, Array]:
    """Table of the drums for kernels, and the lengths off the drums at which layers begin [m]."""
    pitch, width = _given(winches, "groove_pitch"), winches.drum_width
    if width is not None:
        step = "A layer has at least one turn; correct one of the two values."
        refuse_first(width < pitch, "winches: drum_width", width, "m", ">= {limit:g} m, its groove_pitch", step, pitch)
    table = np.empty((len(pitch), drum.DRUM_COLUMNS))
    table[:, drum.PITCH_RADIUS] = _given(winches, "drum_radius") + 0.5 * diameter
    table[:, drum.LAYER_RISE] = 0.5 * math.sqrt(3.0) * diameter  # each turn lies in the gap between two turns below
    table[:, drum.GROOVE_PITCH] = pitch
    table[:, drum.LAYER_TURNS] = np.inf if width is None else width / pitch
    table[:, drum.LAYERS] = winches.layers
    table[:, drum.DISTANCE] = np.inf if winches.drum_distance is None else winches.drum_distance
    table[:, drum.OFFSET] = winches.drum_offset
    return locked(table), _layer_starts(winches, table)


def _layer_starts(winches: Winch, table: Array) -> Array:
    """Lengths off the drum at which the layers begin [m]."""
    # A layer begins at the length of the cable minus the length on lower layers, minus the extra length between drum
    # and pulley due to the oblique direction of the cable.
    count = np.arange(int(winches.layers.max()) + 1)
    known = winches.cable_length if winches.cable_length is not None else winches.length_zero
    # if cable_length is unknown, zero turns are at length_zero
    whole = np.zeros(len(table)) if known is None else known
    circle = 2.0 * np.pi * (table[:, drum.PITCH_RADIUS] + count[:, None] * table[:, drum.LAYER_RISE])
    layer = np.hypot(circle, table[:, drum.GROOVE_PITCH]) * table[:, drum.LAYER_TURNS]
    below = np.concatenate((np.zeros((1, len(table))), np.cumsum(layer[:-1], axis=0)))
    width = 0.0 if winches.drum_width is None else winches.drum_width
    place, distance = table[:, drum.OFFSET] + width * (count[:, None] % 2), table[:, drum.DISTANCE]
    slant = place**2 / (np.hypot(distance, place) + distance)
    return locked(np.ascontiguousarray((whole - below - slant).T))


def _limits(winches: Winch, robot: Robot) -> tuple[Array, Array, Array]:
    """Strain of the cable on the drums, and smallest and largest number of turns on the drums, each (m,)."""
    strain = locked(winches.winding_tension / robot.cables.axial_stiffness)
    if winches.cable_length is None:
        endless = np.full(strain.shape, np.inf)
        return strain, locked(-endless), locked(endless)
    turns = np.inf if winches.drum_width is None else winches.drum_width / _given(winches, "groove_pitch")
    return strain, locked(np.zeros(strain.shape)), locked(np.broadcast_to(turns * winches.layers, strain.shape).copy())


def drum_tension(state: Equilibrium) -> Array:
    """Tension of the cables at the drum [N], (m,) or (N, m), with friction if the state has winding directions."""
    # Along an exact cable without friction, T + T^2/(2 EA) - w z is constant; z is the height. In all other models, the
    # cable between pulley and drum has no weight, and the drum tension is the chord tension. A slack cable that leaves
    # a drum downward has a negative tension. A tension that would give a negative length is NaN. See docs/model.md,
    # section 10.
    robot, cables = state.robot, state.cables
    if state.contact is not None and differs(robot, state.contact.winding) and state.contact.winding is not None:
        return locked(actual_routing(state)[-1])
    if cables.model.code != CATENARY:
        return state.chord_tension
    fall = state.exit_point[..., 2] - drum_heights(robot, state.pose)
    # a cable leaves its pulley at its frame end, or at its platform end if the pulley is there
    tension = np.where(on_platform(robot), cables.platform_end_tension, cables.frame_end_tension)
    material = cables_of(robot)
    stiffness = material.axial_stiffness
    drop = 2.0 * material.linear_density * cables.gravity * fall / stiffness
    return locked(tension_after(tension, drop, stiffness))


def warmth(robot: Robot, temperature: Any) -> Array | float:
    """Factor 1 + expansion * `temperature` of a cable length, (m,) or a number; temperature: difference [K]."""
    difference = checked(temperature, "temperature", "K")
    if difference.shape not in ((), (robot.cable_count,)):
        allowed, step = f"shape () or ({robot.cable_count},)", "Give one value, or one value per cable."
        raise InvalidValueError("temperature", f"of shape {difference.shape}", allowed, step)
    if not difference.any():
        return 1.0
    if robot.cables.expansion is None:
        step = "Give it in the robot file or with Cable(..., expansion=...), or omit temperature."
        raise InvalidValueError("cables: expansion", "not given", "known if a temperature is given", step)
    factor: Array = 1.0 + robot.cables.expansion * difference
    if not (factor > 0.0).all():
        shown, allowed = f"{np.ravel(difference)[0]:g} K", "a temperature at which cables have a positive length"
        raise InvalidValueError("temperature", shown, allowed, "Correct the temperature, or expansion.")
    return factor


def _given(winches: Winch, name: str, step: str = "Give it in the robot's winches.") -> Array:
    value: Array | None = getattr(winches, name)
    if value is None:
        raise InvalidValueError(f"winches: {name}", "not given", "one value, or one per cable", step)
    return value


def _at(item: str, sample: int, cable: int, samples: int) -> str:
    return f"{f'sample {sample}, ' if samples > 1 else ''}cable {cable}: {item}"


def drum_lever(robot: Robot, length: Array) -> Array:
    """Lever arm: cable length per radian of drum rotation [m], for lengths off the drums (m,) or (N, m) [m]."""
    # The lever arm depends on the layer. Without drum data, the lever arm is drum_radius plus half of the cable
    # diameter.
    winch = robot.winches
    if winch is None or winch.drum_radius is None:
        step = "Give it in the robot file, or with robot.replace(winches=Winch(drum_radius=...))."
        raise InvalidValueError("winches: drum_radius", "not given", "known if winch speeds are computed", step)
    if winch.groove_pitch is not None and robot.cables.diameter is not None:
        drums = Drums(robot)
        travel: Array = drums.turns(np.atleast_2d(length) * (1.0 + drums.rest_strain))[1] / (2.0 * np.pi)
        return travel.reshape(length.shape)
    thick = 0.0 if robot.cables.diameter is None else 0.5 * robot.cables.diameter
    return np.broadcast_to(winch.drum_radius + thick, length.shape)
