"""Least distances of sagging cables from cables, rods and boxes, with bounds proved by branch and bound.

A cable is divided into pieces. The bulge of a piece is an upper bound of the distance between piece and chord. A lower
bound of the distance of two pieces is the distance of their chords minus both bulges. An upper bound is the distance of
two points of the cables; Newton's method improves it to full precision. A pair of pieces is finished when the two
bounds differ by less than the precision. A pair that is not finished is continued with one piece split. If a cable
occurs in several pairs, these pairs use the same pieces. docs/model.md, section 13.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.kernels.interference import shapes
from sagline.kernels.jit import entry, kernel

# Columns of a piece: ends of its chord (six), bulge, range as shares of the cable, index of the first of its two parts
# (0 if not split).
BULGE = 6
BEGIN = 7
END = 8
PARTS = 9
PIECE_COLUMNS = 10

PIECES = 8192  # largest number of pieces of all cables of a pose
# index of the last row, which contains the number of pieces in its last column, and an edge of a box before it
COUNTER = PIECES - 1
WAITING = 4096  # largest number of waiting pairs of pieces
# largest number of examined pairs per distance; after it, the search returns its present lower bound
PAIRS = 100_000
ROUNDING = 1e-13  # rounding error of a lower bound, relative to the coordinates
FAR = 1e300


def work_arrays_for_pieces() -> tuple[Array, Array]:
    """Work arrays for pieces and for waiting pairs."""
    return np.empty((PIECES, PIECE_COLUMNS)), np.empty((WAITING, 3))


@kernel
def _set_piece(piece: Array, row: Array, first: float, last: float) -> None:
    """Set range and bulge of `piece`, which has the ends `first` and `last`."""
    dx, dy, dz = piece[3] - piece[0], piece[4] - piece[1], piece[5] - piece[2]
    piece[BULGE] = shapes.bulge(row, first, last, dx * dx + dy * dy + dz * dz)
    piece[BEGIN] = first
    piece[END] = last
    piece[PARTS] = 0.0


@kernel
def _whole_piece(piece: Array, row: Array) -> None:
    """Store the whole measured part of a cable as the first piece."""
    piece[0], piece[1], piece[2] = shapes.point(row, row[shapes.FIRST])
    piece[3], piece[4], piece[5] = shapes.point(row, row[shapes.LAST])
    _set_piece(piece, row, row[shapes.FIRST], row[shapes.LAST])


@kernel
def _split_piece(pieces: Array, index: int, row: Array) -> None:
    """Split a piece in the middle, or, for a folded cable, at its lowest point."""
    count = int(pieces[COUNTER, PARTS])
    piece, one, other = pieces[index], pieces[count], pieces[count + 1]
    middle = 0.5 * (piece[BEGIN] + piece[END])
    width = piece[END] - piece[BEGIN]
    bottom = shapes.level_point(row)
    if piece[BEGIN] + 1e-3 * width < bottom < piece[END] - 1e-3 * width:
        middle = bottom
    x, y, z = shapes.point(row, middle)
    for k in range(3):
        one[k] = piece[k]
        other[3 + k] = piece[3 + k]
    one[3], one[4], one[5] = x, y, z
    other[0], other[1], other[2] = x, y, z
    _set_piece(one, row, piece[BEGIN], middle)
    _set_piece(other, row, middle, piece[END])
    piece[PARTS] = count
    pieces[COUNTER, PARTS] = count + 2


@kernel
def _chord_distance(pieces: Array, i: int, j: int, box: Array, to_a_box: bool) -> tuple[float, float, float, float]:
    """Distance [m] of the chords of the pieces `i` and `j`, lower bound for the pieces, nearest points as shares."""
    one = pieces[i]
    if to_a_box:
        square, low, s = shapes.to_box(one, box)
        return math.sqrt(square), math.sqrt(low) - one[BULGE], one[BEGIN] + s * (one[END] - one[BEGIN]), 0.0
    other = pieces[j]
    square, low, s, t = shapes.between_segments(one, other)
    return (
        math.sqrt(square),
        math.sqrt(low) - one[BULGE] - other[BULGE],
        one[BEGIN] + s * (one[END] - one[BEGIN]),
        other[BEGIN] + t * (other[END] - other[BEGIN]),
    )


@kernel
def _refined_distance(one: Array, other: Array, to_a_box: bool, s: float, t: float) -> tuple[float, float, float]:
    """Local minimum [m] of the distance of two cables, and the shares of its points. Search from `s` and `t`."""
    if to_a_box:
        square, s = shapes.nearest_to_box(one, other, s)
    else:
        square, s, t = shapes.nearest_of_curves(one, other, s, t)
    return math.sqrt(square), s, t


@kernel
def _square_at(one: Array, other: Array, to_a_box: bool, s: float, t: float) -> float:
    """Squared distance of two points of a pair [m^2]."""
    if not to_a_box:
        return shapes.square_between(one, other, s, t)
    x, y, z = shapes.point(one, s)
    bx, by, bz = shapes.nearest_in_box(other, x, y, z)
    return (x - bx) * (x - bx) + (y - by) * (y - by) + (z - bz) * (z - bz)


@kernel
def _least_of_pair(
    one: Array, other: Array, i: int, j: int, precision: float, enough: float, pieces: Array, waiting: Array
) -> tuple[float, float, float, float]:
    """Least distance [m] of a cable from another cable or a box, a proved lower bound, and the two nearest points."""
    # If the distance exceeds `enough`, the search ends early with a lower bound of at least `enough` - `precision`.
    to_a_box = other[shapes.KIND] == shapes.BOX
    distance, low, s, t = _chord_distance(pieces, i, j, other, to_a_box)
    if math.isnan(distance):
        return math.nan, math.nan, math.nan, math.nan
    best, best_s, best_t = distance, s, t
    if low < enough - precision:
        best, best_s, best_t = _refined_distance(one, other, to_a_box, s, t)
    else:
        best = math.sqrt(_square_at(one, other, to_a_box, s, t))
    size = ROUNDING * (abs(pieces[i, 0]) + abs(pieces[i, 1]) + abs(pieces[i, 2]) + best)
    proved = FAR
    waiting[0, 0], waiting[0, 1], waiting[0, 2] = i, j, low
    height, looked = 1, 0
    while height > 0:
        height -= 1
        a, b, low = int(waiting[height, 0]), int(waiting[height, 1]), waiting[height, 2]
        bulge_a, bulge_b = pieces[a, BULGE], 0.0 if to_a_box else pieces[b, BULGE]
        count = int(pieces[COUNTER, PARTS])
        stuck = looked >= PAIRS or count + 2 > COUNTER or height + 2 > WAITING or bulge_a + bulge_b == 0.0
        if stuck or low >= min(best, enough) - precision:
            proved = min(proved, low)
            continue
        of_one = bulge_a >= bulge_b
        index = a if of_one else b
        if pieces[index, PARTS] == 0.0:
            _split_piece(pieces, index, one if of_one else other)
        first = int(pieces[index, PARTS])
        for k in range(first, first + 2):
            new_a, new_b = (k, b) if of_one else (a, k)
            distance, low, s, t = _chord_distance(pieces, new_a, new_b, other, to_a_box)
            looked += 1
            if distance < best and _square_at(one, other, to_a_box, s, t) < best * best:
                found, at_s, at_t = _refined_distance(one, other, to_a_box, s, t)
                if found < best:
                    best, best_s, best_t = found, at_s, at_t
            if low >= min(best, enough) - precision:
                proved = min(proved, low)
            else:
                waiting[height, 0], waiting[height, 1], waiting[height, 2] = new_a, new_b, low
                height += 1
        if height >= 2 and waiting[height - 1, 2] > waiting[height - 2, 2]:  # the closer pair is examined first
            for k in range(3):
                waiting[height - 1, k], waiting[height - 2, k] = waiting[height - 2, k], waiting[height - 1, k]
    return best, max(min(proved, best) - size, 0.0), best_s, best_t


@kernel
def _edge_of(box: Array, axis: int, corner: int, edge: Array) -> None:
    """Fill `edge` with one of the four edges of `box` along `axis`."""
    for k in range(3):
        middle = box[shapes.PLACE + k]
        along = box[shapes.AXES + 3 * k + axis] * box[shapes.HALF + axis]
        for side in range(2):
            other = (axis + 1 + side) % 3
            sign = 1.0 if (corner >> side) & 1 else -1.0
            middle += sign * box[shapes.AXES + 3 * k + other] * box[shapes.HALF + other]
        edge[k] = middle - along
        edge[3 + k] = middle + along


@kernel
def _edges_to_box(box: Array, other: Array, edge: Array, nearest: Array, best: float) -> float:
    """The smaller of `best` [m] and the least distance of an edge of `box` from the box `other`. Fills `nearest`."""
    for axis in range(3):
        for corner in range(4):
            _edge_of(box, axis, corner, edge)
            square, _, t = shapes.to_box(edge, other)
            if math.sqrt(square) < best:
                best = math.sqrt(square)
                for k in range(3):
                    nearest[0, k] = edge[k] + t * (edge[3 + k] - edge[k])
                nearest[1, 0], nearest[1, 1], nearest[1, 2] = shapes.nearest_in_box(
                    other, nearest[0, 0], nearest[0, 1], nearest[0, 2]
                )
    return best


@kernel
def _least_of_boxes(box: Array, other: Array, edge: Array, nearest: Array) -> float:
    """Least distance of two boxes [m], 0 if they touch: the least distance of an edge of one box from the other box."""
    best = _edges_to_box(box, other, edge, nearest, FAR)
    turned = _edges_to_box(other, box, edge, nearest, best)
    if turned < best:
        for k in range(3):
            nearest[0, k], nearest[1, k] = nearest[1, k], nearest[0, k]
    return turned


@kernel
def _set_nearest(one: Array, other: Array, s: float, t: float, nearest: Array) -> None:
    """Set the nearest points of a pair from their shares of the cable lengths."""
    x, y, z = shapes.point(one, s)
    nearest[0, 0], nearest[0, 1], nearest[0, 2] = x, y, z
    if other[shapes.KIND] == shapes.BOX:
        nearest[1, 0], nearest[1, 1], nearest[1, 2] = shapes.nearest_in_box(other, x, y, z)
    else:
        nearest[1, 0], nearest[1, 1], nearest[1, 2] = shapes.point(other, t)


@entry
def least_distances(
    moving: Array,
    still: Array,
    pairs: Indices,
    precision: float,
    together: bool,
    pieces: Array,
    waiting: Array,
    distance_out: Array,
    low_out: Array,
    nearest_out: Array,
) -> None:
    """Fill the least distances of pairs at every pose, minus the radii, with proved lower bounds and nearest points."""
    # moving: Shapes that move with the pose, shape (N, K, COLUMNS).
    # still: Fixed shapes, shape (S, COLUMNS).
    # pairs: Indices of two shapes, shape (P, 2). The indices of fixed shapes follow the indices of moving shapes. A box
    #   is the second shape of a pair.
    # precision: Largest difference of the lower bound from the distance [m].
    # together: True if only the least distance over all pairs of a pose is required. If True, all other pairs get only
    #   bounds.
    # pieces: Work array from `work_arrays_for_pieces`.
    # waiting: Work array from `work_arrays_for_pieces`.
    # distance_out: Filled with the distances [m], shape (N, P).
    # low_out: Filled with the proved lower bounds [m], shape (N, P).
    # nearest_out: Filled with the nearest points on the center lines or boxes [m], shape (N, P, 2, 3).
    poses, several = moving.shape[0], moving.shape[1]
    count = several + still.shape[0]
    for k in range(still.shape[0]):
        if still[k, shapes.KIND] != shapes.BOX:
            _whole_piece(pieces[several + k], still[k])
    for n in range(poses):
        pieces[COUNTER, PARTS] = count
        for k in range(several):
            if moving[n, k, shapes.KIND] != shapes.BOX:
                _whole_piece(pieces[k], moving[n, k])
        pieces[several:count, PARTS] = 0.0
        least = FAR
        for p in range(pairs.shape[0]):
            i, j = pairs[p, 0], pairs[p, 1]
            one = moving[n, i] if i < several else still[i - several]
            other = moving[n, j] if j < several else still[j - several]
            radii = one[shapes.RADIUS] + other[shapes.RADIUS]
            nearest = nearest_out[n, p]
            if one[shapes.KIND] == shapes.BOX:
                distance = _least_of_boxes(one, other, pieces[COUNTER], nearest)
                distance_out[n, p] = distance - radii
                low_out[n, p] = distance * (1.0 - ROUNDING) - radii
            else:
                enough = least + radii if together else FAR
                distance, low, s, t = _least_of_pair(one, other, i, j, precision, enough, pieces, waiting)
                distance_out[n, p] = distance - radii
                low_out[n, p] = low - radii
                _set_nearest(one, other, s, t, nearest)
            if distance_out[n, p] < least:
                least = distance_out[n, p]


@entry
def cut_piece(row: Array, ranges: Array, pieces_out: Array) -> None:
    """Fill chords and bulges of pieces of one cable or rod."""
    # row: The cable, shape (COLUMNS,).
    # ranges: First and last shares of the pieces, shape (K, 2).
    # pieces_out: Filled with chords and bulges, shape (K, PIECE_COLUMNS).
    for k in range(ranges.shape[0]):
        piece, first, last = pieces_out[k], ranges[k, 0], ranges[k, 1]
        piece[0], piece[1], piece[2] = shapes.point(row, first)
        piece[3], piece[4], piece[5] = shapes.point(row, last)
        _set_piece(piece, row, first, last)
