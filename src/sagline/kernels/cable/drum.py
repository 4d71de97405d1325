"""Cable on a drum: number of turns as a function of the length off the drum, and strain of the wound cable.

The number of turns is zero at the first groove, where the cable is fastened, and increases while cable is wound in.
Layer k lies in the grooves between the turns of layer k - 1, and advances in the opposite direction. docs/model.md,
section 10.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import entry, formula

# columns of the table of drums
PITCH_RADIUS, LAYER_RISE, GROOVE_PITCH, LAYER_TURNS, LAYERS, DISTANCE, OFFSET = range(7)
DRUM_COLUMNS = 7
# Rows of a drum's memory. Each column is a piece of cable on the drum. Its deeper end was wound before its upper end.
DEEP_LENGTH, DEEP_PATH, DEEP_STRAIN, TOP_STRAIN = range(4)
MEMORY_ROWS = 4
STEPS = 60  # largest number of Newton steps; for a convex function of one variable, two or three are sufficient
# size of the last step, in turns or relative to all turns; the next step would have the square of this size
SETTLED = 1e-8


@formula
def _slant_length(distance: float, offset: float) -> float:
    """Extra length [m] of the slanted cable between drum and pulley. The result is zero if `distance` is infinite."""
    return offset * offset / (math.sqrt(distance * distance + offset * offset) + distance)


@formula
def _turn_length(drum: Array, layer: int) -> float:
    """Length of one turn of `layer`, a helix [m]."""
    circle = 2.0 * math.pi * (drum[PITCH_RADIUS] + layer * drum[LAYER_RISE])
    return math.sqrt(circle * circle + drum[GROOVE_PITCH] * drum[GROOVE_PITCH])


@formula
def _exit_position(drum: Array, layer: int, turns: float) -> tuple[float, float]:
    """Axial position at which the cable leaves the drum, relative to the pulley's middle, and its change per turn."""
    if layer % 2 == 0:
        return drum[OFFSET] + drum[GROOVE_PITCH] * turns, drum[GROOVE_PITCH]
    return drum[OFFSET] + drum[GROOVE_PITCH] * (drum[LAYER_TURNS] - turns), -drum[GROOVE_PITCH]


@formula
def _wound_length(drum: Array, layer: int, turns: float) -> float:
    """Cable length [m] in the first `turns` turns of `layer`: a convex and increasing function of `turns`."""
    first, _ = _exit_position(drum, layer, 0.0)
    place, _ = _exit_position(drum, layer, turns)
    distance = drum[DISTANCE]
    return _turn_length(drum, layer) * turns + (_slant_length(distance, place) - _slant_length(distance, first))


@entry
def turns_of_lengths(drums: Array, starts: Array, length: Array, turns_out: Array, travel_out: Array) -> None:
    """Fill the number of turns on each drum, and the change of length per turn [m], for each `length` off the drum."""
    # The number of turns is negative if `length` exceeds the whole cable, and exceeds the capacity beyond the last
    # layer.
    # `drums`: table, (m, DRUM_COLUMNS). `starts`: length off the drum at which each layer begins, in decreasing order,
    # (m, layers + 1). `length`: lengths at the winding tension [m], (N, m). `turns_out`, `travel_out`: filled, (N, m).
    for p in range(length.shape[0]):
        for i in range(length.shape[1]):
            drum = drums[i]
            last = int(drum[LAYERS]) - 1
            layer = 0
            while layer < last and length[p, i] < starts[i, layer + 1]:
                layer += 1
            turn, distance = _turn_length(drum, layer), drum[DISTANCE]
            first, advance = _exit_position(drum, layer, 0.0)
            missing = starts[i, layer] - length[p, i] + _slant_length(distance, first)
            turns = (starts[i, layer] - length[p, i]) / turn
            travel = turn
            for _ in range(STEPS):
                place = first + advance * turns
                run = math.sqrt(distance * distance + place * place)
                travel = turn + advance * place / run
                step = (missing - turn * turns - place * place / (run + distance)) / travel
                turns += step
                if abs(step) <= SETTLED * max(abs(turns), 1.0):
                    break
            below = layer * drum[LAYER_TURNS] if layer > 0 else 0.0
            turns_out[p, i] = below + turns
            travel_out[p, i] = travel


@entry
def lengths_of_turns(drums: Array, starts: Array, turns: Array, length_out: Array) -> None:
    """Lengths off the drum for the numbers of turns `turns`; arguments as in `turns_of_lengths`."""
    for p in range(turns.shape[0]):
        for i in range(turns.shape[1]):
            drum = drums[i]
            layer = 0
            if turns[p, i] > drum[LAYER_TURNS]:
                layer = int(min(turns[p, i] / drum[LAYER_TURNS], drum[LAYERS] - 1.0))
            below = layer * drum[LAYER_TURNS] if layer > 0 else 0.0
            length_out[p, i] = starts[i, layer] - _wound_length(drum, layer, turns[p, i] - below)


@entry
def follow_memory(
    given: Array, strain: Array, rest_strain: Array, unstrained: bool, found_out: Array, memory: Array
) -> None:
    """Conversion between unstrained lengths off the drum and lengths along the path of winding."""
    # On the drum the cable keeps the strain with which it was wound. The strain at the drum is linear in length between
    # two samples. Cable that never left the drum has the initial strain. Samples with NaN are omitted.
    # `given`: lengths off the drum [m], (N, m): unstrained if `unstrained` is true, else along the path of winding.
    # `strain`: strain of the cable at the drum for each sample, (N, m). `rest_strain`: initial strain of the cable on
    # the drum, (m,). `found_out`: filled with the converted lengths [m], (N, m). `memory`: work array, (MEMORY_ROWS,
    # N).
    for i in range(given.shape[1]):
        depth, begun = 0, False
        length = path = last = base_length = base_path = 0.0
        for p in range(given.shape[0]):
            value, now = given[p, i], strain[p, i]
            found_out[p, i] = math.nan
            if not (abs(value) < math.inf and abs(now) < math.inf):
                continue
            if not begun:
                begun, last = True, now
                length = value if unstrained else value / (1.0 + rest_strain[i])
                path = length * (1.0 + rest_strain[i]) if unstrained else value
                base_length, base_path = length, path
            elif value < (length if unstrained else path):
                memory[DEEP_LENGTH, depth], memory[DEEP_PATH, depth] = length, path
                memory[DEEP_STRAIN, depth], memory[TOP_STRAIN, depth] = last, now
                stretch = 1.0 + 0.5 * (last + now)
                depth += 1
                if unstrained:
                    length, path = value, path - (length - value) * stretch
                else:
                    length, path = length - (path - value) / stretch, value
            else:
                row = DEEP_LENGTH if unstrained else DEEP_PATH
                while depth > 0 and value >= memory[row, depth - 1]:
                    depth -= 1
                    length = memory[DEEP_LENGTH, depth]
                if depth == 0:
                    stretch = 1.0 + rest_strain[i]
                    if unstrained:
                        length, path = value, base_path + (value - base_length) * stretch
                    else:
                        length, path = base_length + (value - base_path) / stretch, value
                else:
                    top = depth - 1
                    deep = memory[DEEP_STRAIN, top]
                    whole = memory[DEEP_LENGTH, top] - length
                    slope = (memory[TOP_STRAIN, top] - deep) / whole if whole > 0.0 else 0.0
                    if unstrained:
                        left = memory[DEEP_LENGTH, top] - value
                        length = value
                        path = memory[DEEP_PATH, top] - left * (1.0 + deep + 0.5 * slope * left)
                    else:
                        missing = memory[DEEP_PATH, top] - value
                        begin = 1.0 + deep
                        left = 2.0 * missing / (begin + math.sqrt(begin * begin + 2.0 * slope * missing))
                        length, path = memory[DEEP_LENGTH, top] - left, value
                    memory[TOP_STRAIN, top] = deep + slope * left
            last = now
            found_out[p, i] = path if unstrained else length
