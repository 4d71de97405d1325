"""Which way drums turn, and poses from lengths over guides and with friction."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, checked, locked
from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kinematics.forward_rows import Found, solve_rows
from sagline.robot.behind import with_behind
from sagline.robot.robot import Robot
from sagline.robot.several import Robots, robots_at

Winding = ArrayLike | Literal["path"]
ROUNDS: Final = 100  # each lessens what is missed by about (exp(mu psi) - 1) times the share of the cable behind
SETTLED: Final = 1e-13  # of a length
_OPEN = (codes.FORWARD_NOT_CONVERGED, codes.FORWARD_NO_LENGTHS)


def checked_winding(winding: ArrayLike, shape: tuple[int, ...], cables: int) -> Array:
    """Directions of winding, one a cable.

    Args:
        winding: What the caller gave: +1, -1 and 0.
        shape: () for a single pose, (N,) for N.
        cables: Number of cables m.

    Returns:
        Array of shape (m,) or (N, m).

    Raises:
        InvalidValueError: If they are not.
    """
    array = checked(winding, "winding", "")
    shapes = [(cables,)] + [(*shape, cables)] * bool(shape)
    if array.shape not in shapes:
        step = "Give one for each cable, or None for no friction."
        raise InvalidValueError("winding", f"of shape {array.shape}", f"shape {' or '.join(map(str, shapes))}", step)
    wrong = ~np.isin(array, (-1.0, 0.0, 1.0))
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        allowed = "1 winding in, -1 paying out, or 0 standing"
        raise InvalidValueError(
            f"winding[{', '.join(map(str, index))}]", f"{array[index]:g}", allowed, "Give the sign of the motion."
        )
    return array


def without_guides(robot: Robot, solver: str, instead: str) -> Robot:
    """The robot, refused where its cables hang between guides.

    Args:
        robot: The robot.
        solver: What does not take them, for the message.
        instead: What does.

    Returns:
        The same robot.

    Raises:
        InvalidValueError: If its winches have guides.
    """
    if robot.winches is None or robot.winches.guides is None:
        return robot
    step = f"Use {instead}(), or robot.replace(winches=robot.winches.replace(guides=None)) for a straight guided run."
    raise InvalidValueError("winches: guides", "given", f"None for {solver}", step)


def settled(
    robot: Robots, model: CableModel, found: Found, lengths: Array, loads: Array, winding: Array | None
) -> Found:
    """Equilibria at lengths that count what is really behind the pulleys.

    Kernels get the lengths less what guides and friction add at the tensions of the round before, until that stays.

    Args:
        robot: The robot, or one a sample.
        model: Cable model.
        found: Equilibria as if the lengths were those over a straight guided run without friction.
        lengths: Unstrained lengths (N, m).
        loads: External plus inertial wrenches (1 or N, 6).
        winding: Directions of friction, shape (m,) or (N, m), or None.

    Returns:
        The answers; NOT_CONVERGED where that does not settle, or a cable is too slack to hang between its guides.
    """
    more = np.zeros(lengths.shape)
    still = np.flatnonzero(~np.isin(found.pose_status, _OPEN))
    for _ in range(ROUNDS):
        if not still.size:
            return found
        robots = robots_at(robot, still)
        some = found.part(still)
        turning = winding if winding is None or winding.ndim == 1 else winding[still]
        added = _added(robots, model, some, turning)
        slack = np.isnan(added)
        added = np.where(slack, more[still], added)
        given = lengths[still] - added
        moved = (np.abs(added - more[still]) > SETTLED * lengths[still]).any(axis=1)
        more[still] = added
        lost = (moved & ~(given > 0.0).all(axis=1)) | (~moved & slack.any(axis=1))
        found.pose_status[still[lost]] = codes.FORWARD_NOT_CONVERGED
        again = moved & ~lost
        still, starts = still[again], locked(some.poses[again])
        if still.size:
            load = loads if len(loads) == 1 else locked(loads[still])
            found.keep(still, solve_rows(robots_at(robot, still), model, locked(given[again]), starts, load))
            still = still[~np.isin(found.pose_status[still], _OPEN)]
    found.pose_status[still] = codes.FORWARD_NOT_CONVERGED
    return found


def _added(robot: Robots, model: CableModel, found: Found, winding: Array | None) -> Array:
    """What guides and friction add to the lengths behind the pulleys [m], (N, m); NaN where a cable is too slack."""
    shape = (len(found.poses),)
    plain = found.solution(robot, model, np.zeros(6), shape).state
    real = with_behind(plain, winding)
    assert plain.contact is not None
    assert real.contact is not None
    return (real.contact.wrapped_length - plain.contact.wrapped_length) + (
        real.contact.dead_length - plain.contact.dead_length
    )
