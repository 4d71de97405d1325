"""Moves of a program in G-code: rows of numbers from the interpreter, and their geometry as arrays."""

from __future__ import annotations

from array import array
from typing import NamedTuple

import numpy as np

from sagline.motion.contour import Moves

Point = tuple[float, float, float]


class Row(NamedTuple):
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


def moves_of(numbers: array[float], start_of_all: Point) -> Moves:
    """Moves from the numbers of all rows; `start_of_all`: start of the first move [m]."""
    rows = np.array(numbers).reshape(-1, len(Row._fields))
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
    return Moves(
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
    )
