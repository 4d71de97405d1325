"""Motion along lines and arcs at given speeds: rounded corners, speeds within an acceleration, and samples over time.

The blocks of moves are processed one after another, so that the memory does not depend on the length of a program.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Flags, Indices

SMOOTH: Final = 0.01  # [rad], largest change of direction that is passed without a stop
REVERSAL: Final = np.pi - 0.01  # [rad], a larger change of direction is a stop, not an arc
SHARP: Final = 1e-12  # [m], a corner with a smaller tolerance is not rounded
STRAIGHT: Final = 1e-4  # [rad], a smaller change of direction between two lines needs no arc
LEAST: Final = 1e-12  # [m], a shorter move is a rounding error
EXACT_STOP: Final = -1.0  # tolerance of a move that ends at rest
BLOCK: Final = 1 << 16  # largest number of samples per block

Point = tuple[float, float, float]


class MoveRow(NamedTuple):
    """A move: where it ends, its arc, and its speed."""

    x: float
    y: float
    z: float
    center_x: float
    center_y: float
    center_z: float
    normal: float  # axis of an arc: 0, 1 or 2
    angle: float  # [rad], about the normal; 0 for a line
    speed: float  # [m/s]
    tolerance: float  # [m]
    dwell: float  # [s]
    line: float


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """M consecutive moves. At the arc length u, a move has the position o + d u + (r + g u) (cos(k u) e + sin(k u) f).

    Lines have r = g = k = 0, and arcs have d = 0 or the direction of a helix.
    """

    origin: Array  # o [m], shape (M, 3)
    direction: Array  # d, shape (M, 3)
    radial: Array  # unit vector e from the center of the arc to its start, shape (M, 3); zero for a line
    side: Array  # unit vector f, normal to e in the direction of the motion, shape (M, 3); zero for a line
    radius: Array  # r [m], shape (M,)
    growth: Array  # g, change of the radius per arc length, shape (M,)
    turning: Array  # k [rad/m], shape (M,)
    length: Array  # arc length [m], shape (M,); zero for a dwell
    speed: Array  # largest speed [m/s], shape (M,)
    tolerance: Array  # largest distance of a rounded corner at the end of the move [m], shape (M,); or EXACT_STOP
    dwell: Array  # time at rest [s], shape (M,); zero for a motion
    line: Indices  # line of the program, shape (M,)
    room: Array  # largest length that each of two rounded corners may take [m], shape (M,)
    passed: Flags  # True if the end is passed without a stop, shape (M,); False before the corners are rounded
    turn: Array  # change of direction at an end that is passed without an arc [rad], shape (M,)

    @classmethod
    def of_rows(cls, numbers: array[float], start_of_all: Point) -> Moves:
        """Moves from the numbers of all rows; `start_of_all`: start of the first move [m]."""
        rows = np.array(numbers).reshape(-1, len(MoveRow._fields))
        end = rows[:, :3]
        start = np.vstack((start_of_all, end))[:-1]
        center, axis, angle = rows[:, 3:6], rows[:, 6].astype(np.int64), rows[:, 7]
        arc, dwell = angle != 0.0, rows[:, 10]
        normal = np.eye(3)[axis] * arc[:, None]
        shift = end - start
        out, last = start - center, end - center
        out = np.where(arc[:, None], out - normal * np.sum(out * normal, axis=1, keepdims=True), 0.0)
        last = np.where(arc[:, None], last - normal * np.sum(last * normal, axis=1, keepdims=True), 0.0)
        radius, final = np.linalg.norm(out, axis=1), np.linalg.norm(last, axis=1)
        rise = normal * np.sum(shift * normal, axis=1, keepdims=True)
        path = np.hypot(0.5 * (radius + final) * angle, np.linalg.norm(rise, axis=1))
        length = np.where(dwell > 0.0, 0.0, np.where(arc, path, np.linalg.norm(shift, axis=1)))
        whole = np.where(length > 0.0, length, 1.0)
        radial = out / np.where(arc, radius, 1.0)[:, None]
        return cls(
            origin=np.where(arc[:, None], start - out, start),
            direction=np.where(arc[:, None], rise, shift) / whole[:, None],
            radial=radial,
            side=np.cross(normal, radial) * np.sign(angle)[:, None],
            radius=radius,
            growth=np.where(arc, final - radius, 0.0) / whole,
            turning=np.abs(angle) / whole,
            length=length,
            speed=rows[:, 8],
            tolerance=rows[:, 9],
            dwell=dwell,
            line=rows[:, 11].astype(np.int64),
            room=0.5 * length,
            passed=np.zeros(len(rows), dtype=np.bool_),
            turn=np.zeros(len(rows)),
        )

    def __len__(self) -> int:
        """Number of moves M."""
        return len(self.length)

    def __getitem__(self, which: Any) -> Moves:
        """The selected moves."""
        return Moves(**{each.name: getattr(self, each.name)[which] for each in fields(self)})

    def and_then(self, other: Moves) -> Moves:
        """These moves, then `other`."""
        pairs = {each.name: (getattr(self, each.name), getattr(other, each.name)) for each in fields(self)}
        return Moves(**{name: np.concatenate(pair) for name, pair in pairs.items()})

    def tangent(self, at: Array) -> Array:
        """Unit tangents (M, 3) at the arc lengths `at` (M,) [m]; zero for a dwell."""
        tangent = _place(self, at)[1]
        size = np.linalg.norm(tangent, axis=1, keepdims=True)
        unit: Array = tangent / np.where(size > 0.0, size, 1.0)
        return unit


class Samples(NamedTuple):
    """N samples of a motion without rotation, at most `BLOCK`."""

    time: Array  # [s], shape (N,)
    position: Array  # [m], shape (N, 3)
    velocity: Array  # [m/s], shape (N, 3)
    acceleration: Array  # [m/s^2], shape (N, 3)
    line: Indices  # line of the program, shape (N,)
    rests: Array  # times of rest since the previous block [s], and the first time, 0 s


class _Timed:
    """Moves with their times. Each move accelerates, keeps its speed, and decelerates."""

    def __init__(self, moves: Moves, squares: Array, acceleration: float) -> None:
        """Compute the times from the squared speeds (M + 1,) at the ends of the moves."""
        before, after = squares[:-1], squares[1:]
        top = np.minimum(_limit(moves, acceleration), 0.5 * (before + after) + acceleration * moves.length)
        top = np.maximum(np.maximum(top, before), after)
        enter, cruise, leave = np.sqrt(before), np.sqrt(top), np.sqrt(after)
        even = np.maximum(moves.length - (2.0 * top - before - after) / (2.0 * acceleration), 0.0)
        steady = np.divide(even, cruise, out=np.zeros_like(even), where=cruise > 0.0)
        # enter: speed at the start [m/s], shape (M,)
        # cruise: largest speed [m/s], shape (M,)
        # leave: speed at the end [m/s], shape (M,)
        self.moves, self.enter, self.cruise, self.leave = moves, enter, cruise, leave
        self.duration = (2.0 * cruise - enter - leave) / acceleration + steady + moves.dwell  # [s]


def samples_along(blocks: Iterable[Moves], acceleration: float, rate: float, most: float) -> Iterator[Samples]:
    """Samples of the motion along consecutive `blocks`, at the times 0, 1/rate, 2/rate, ... and at the end."""
    # The first move starts at rest, and the last move ends at rest. `most`: limit of the time [s]; `OverflowError` with
    # the line of the program if a motion ends later.
    start, taken, rests = 0.0, 0, np.zeros(1)
    for timed, final in _timed(_joined(blocks), acceleration):
        ends = start + np.cumsum(timed.duration)
        if (late := ~(ends <= most)).any():
            raise OverflowError(int(timed.moves.line[int(np.argmax(late))]))
        steps = float(ends[-1]) * rate
        # if the end time is a multiple of 1/rate, except for rounding, no additional sample is needed
        whole = final and abs(steps - round(steps)) <= 1e-9 * steps
        stop = max(taken, round(steps) if whole else int(np.ceil(steps)))
        rests = np.append(rests, ends[timed.leave == 0.0])
        for low in range(taken, stop + final, BLOCK):
            high = min(low + BLOCK, stop + final)
            clock = np.arange(low, high) / rate
            if high > stop:
                clock[-1] = ends[-1]
            yield _sampled(timed, clock, ends, acceleration, rests)
            rests = rests[:0]
        start, taken = float(ends[-1]), stop


def _joined(blocks: Iterable[Moves]) -> Iterator[Moves]:
    """Moves with rounded corners. The last move is held back until its corner with the next block is known."""
    held: Moves | None = None
    for block in blocks:
        chain = block if held is None else held.and_then(block)
        if len(chain) > 1:
            joined, held = _rounded(chain)
            yield joined
        else:
            held = chain
    if held is not None and len(held):
        yield held


def _rounded(chain: Moves) -> tuple[Moves, Moves]:
    """All moves of `chain` except the last, with an arc in each rounded corner; and the last move, shortened."""
    first, second = chain[:-1], chain[1:]
    before, after = first.tangent(first.length), second.tangent(np.zeros(len(second)))
    cosine = np.sum(before * after, axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), cosine)
    moving = (first.length > 0.0) & (second.length > 0.0) & (first.tolerance >= 0.0)
    lines = (first.turning == 0.0) & (second.turning == 0.0)
    bent = moving & lines & (first.tolerance > SHARP) & (angle > STRAIGHT) & (angle < REVERSAL)
    half = np.where(bent, angle, 1.0) / 2.0
    # distance of the corner from the arc: cut tan(angle/4)
    cut = np.minimum(np.minimum(first.tolerance / np.tan(half / 2.0), first.room), second.room)
    cut = np.where(bent, cut, 0.0)
    radius = np.where(bent, cut / np.tan(half), 1.0)
    inward = (after - cosine[:, None] * before) / np.where(bent, np.sin(2.0 * half), 1.0)[:, None]
    passed = bent | (moving & (angle <= SMOOTH))
    arcs = replace(
        first,
        origin=second.origin - cut[:, None] * before + radius[:, None] * inward,
        direction=np.zeros_like(before),
        radial=-inward,
        side=before,
        radius=radius,
        growth=np.zeros(len(first)),
        turning=1.0 / radius,
        length=np.where(bent, radius * angle, 0.0),
        speed=np.minimum(first.speed, second.speed),
        dwell=np.zeros(len(first)),
        passed=passed,
    )
    head = np.append(0.0, cut)
    chain = replace(
        chain, origin=chain.origin + head[:, None] * chain.direction, length=chain.length - head - np.append(cut, 0.0)
    )
    order = np.arange(2 * len(first)).reshape(2, -1).T.ravel()  # each move, then its corner
    own = replace(chain[:-1], passed=passed, turn=np.where(passed & ~bent, angle, 0.0))
    both = own.and_then(arcs)[order]
    return both[(both.length > LEAST) | (both.dwell > 0.0)], chain[-1:]


def _timed(blocks: Iterable[Moves], acceleration: float) -> Iterator[tuple[_Timed, bool]]:
    """Moves with their speeds; and True for the last block."""
    # The speeds at the end of a block depend on the next block. Moves are held back until the speeds at their ends no
    # longer depend on later moves.
    held: Moves | None = None
    entry = 0.0
    for block in blocks:
        chain = block if held is None else held.and_then(block)
        if not len(chain):
            continue
        slowest, fastest = (_squares(chain, acceleration, entry, end) for end in (0.0, float(chain.speed[-1] ** 2)))
        known = int(np.flatnonzero(slowest[:-1] == fastest[:-1])[-1])
        if known > 0:
            yield _Timed(chain[:known], slowest[: known + 1], acceleration), False
        held, entry = chain[known:], float(slowest[known])
    if held is not None and len(held):
        yield _Timed(held, _squares(held, acceleration, entry, 0.0), acceleration), True


def _limit(moves: Moves, acceleration: float) -> Array:
    """Squares of the largest speeds (M,): the given speeds, and the acceleration toward the center of an arc."""
    bend = moves.radius * moves.turning**2
    inward = np.divide(acceleration, bend, out=np.full(len(moves), np.inf), where=bend > 0.0)
    limit: Array = np.minimum(moves.speed**2, inward)
    return limit


def _squares(chain: Moves, acceleration: float, entry: float, end: float) -> Array:
    """Squares of the largest speeds (M + 1,) at the ends of the moves, which the acceleration allows to reach."""
    limit, turn = _limit(chain, acceleration), chain.turn[:-1]
    # a turn between short lines counts as an arc that takes half of each line
    arc = acceleration * np.minimum(chain.length[:-1], chain.length[1:])
    smooth = np.divide(arc, turn, out=np.full(len(turn), np.inf), where=turn > 0.0)
    inner = np.where(chain.passed[:-1], np.minimum(np.minimum(limit[:-1], limit[1:]), smooth), 0.0)
    bounds = np.append(np.append(entry, inner), end)
    gain = np.append(0.0, np.cumsum(2.0 * acceleration * chain.length))
    down = np.minimum.accumulate((bounds + gain)[::-1])[::-1] - gain
    down[0] = entry
    up = np.minimum.accumulate(down - gain) + gain
    squares: Array = np.clip(up, 0.0, bounds)
    squares[0] = entry
    return squares


def _sampled(timed: _Timed, clock: Array, ends: Array, acceleration: float, rests: Array) -> Samples:
    """Samples at the times `clock` (N,) [s]. `ends`: end times of the moves (M,) [s]."""
    k = np.minimum(np.searchsorted(ends, clock, side="right"), len(ends) - 1)
    moves, enter, cruise, leave = timed.moves[k], timed.enter[k], timed.cruise[k], timed.leave[k]
    left = np.clip(ends[k] - clock, 0.0, timed.duration[k])
    since = timed.duration[k] - left
    rising, falling = (cruise - enter) / acceleration, (cruise - leave) / acceleration
    phases = [since < rising, left <= falling]
    slope = np.select(phases, [acceleration, -acceleration], 0.0)
    slope[moves.dwell > 0.0] = 0.0
    along = np.select(
        phases,
        [since * (enter + 0.5 * acceleration * since), moves.length - left * (leave + 0.5 * acceleration * left)],
        (cruise**2 - enter**2) / (2.0 * acceleration) + cruise * (since - rising),
    )
    speed = np.select(phases, [enter + acceleration * since, leave + acceleration * left], cruise)
    position, tangent, bend = _place(moves, along)
    return Samples(
        clock,
        position,
        speed[:, None] * tangent,
        slope[:, None] * tangent + (speed**2)[:, None] * bend,
        moves.line,
        rests,
    )


def _place(moves: Moves, along: Array) -> tuple[Array, Array, Array]:
    """Positions (M, 3) at the arc lengths `along` (M,) [m], and their first and second derivatives."""
    angle = moves.turning * along
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    out, across = cosine * moves.radial + sine * moves.side, cosine * moves.side - sine * moves.radial
    radius, k, growth = (moves.radius + moves.growth * along)[:, None], moves.turning[:, None], moves.growth[:, None]
    position = moves.origin + along[:, None] * moves.direction + radius * out
    tangent = moves.direction + growth * out + radius * k * across
    return position, tangent, 2.0 * growth * k * across - radius * k**2 * out
