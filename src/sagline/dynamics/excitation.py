"""How much a motion excites the vibrations of the platform, and how much they are seen."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.dynamics.moves import Move, moves_of
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.statics.balance import inertial_wrench

_NEAR: Final = 3.0  # times: excitations that differ by less both count
_INSTANTS: Final = 2000  # of a move, where its inertia is taken


def most_excited(state: Equilibrium, frequency: Array, shape: Array, path: Path) -> Array:
    """The frequencies that a path excites most: one, or two where the second is excited a third as much or more.

    Args:
        state: A single state.
        frequency: Of its modes [Hz], shape (K,).
        shape: Motions of the platform in them, of unit modal mass, one a column, shape (6, K).
        path: A path from rest to rest; of several moves, the one that excites a mode most counts.

    Returns:
        Frequencies [Hz], shape (1,) or (2,), the most excited first.

    Raises:
        InvalidValueError: If no mode has a frequency, or the path is in motion at an end or does not move.
    """
    moves = [move for move in moves_of(instance(path, Path, "path")) if move.curve is not None]
    known = np.flatnonzero(frequency > 0.0)
    if not (moves and known.size):
        item, value = ("path", "without motion") if not moves else ("modes", "without a frequency")
        raise InvalidValueError(item, value, "a motion, and modes that it can excite", "Take another path, or state.")
    if np.isnan(frequency).any():
        step = "Take another: its platform falls."
        raise InvalidValueError("modes", "of an unstable state", "of a stable one", step)
    frequency, shape = frequency[known], shape[:, known]
    excited = np.max([excitation(state.one_robot, move, frequency, shape) for move in moves], axis=0)
    order = np.argsort(-excited, kind="stable")[:2]
    return locked(frequency[order[excited[order] * _NEAR >= excited[order[0]]]])


def excitation(robot: Robot, move: Move, frequency: Array, shape: Array) -> Array:
    """How much a move excites each mode, and the mode moves the platform.

    Args:
        robot: The robot.
        move: From rest to rest.
        frequency: Of the modes [Hz], shape (K,).
        shape: Motions of the platform in them, of unit modal mass, one a column, shape (6, K).

    Returns:
        |phi . M d| |phi| |A(w)|/w of each, shape (K,).
    """
    time = np.linspace(0.0, move.duration, _INSTANTS + 1)
    assert move.curve is not None
    motion = move.rates(time)
    jet = move.curve.at(motion[0])
    twist, twist_rate, _ = jet.twists(motion)
    force = inertial_wrench(robot, jet.pose, twist, twist_rate) @ shape  # of each mode over time
    turning = 2.0 * np.pi * frequency
    transform = np.trapezoid(force * np.exp(-1j * np.outer(time, turning)), time, axis=0)
    seen: Array = np.abs(transform) * np.linalg.norm(shape, axis=0) / turning
    return seen
