"""Winding directions of drums, and forward kinematics with guides and friction."""

from __future__ import annotations

from collections import deque
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kinematics.forward_rows import ForwardRows, solve_forward_rows
from sagline.robot.batch import Robots, robots_at
from sagline.robot.robot import Robot
from sagline.robot.routing import with_routing

Winding = ArrayLike | Literal["path"]
# usually about ten are needed, but more for large changes of the routing length or for high friction
ITERATIONS: Final = 100
MEMORY: Final = 5  # number of previous iterations that Anderson mixing uses
_RANK: Final = 1e-6
TOLERANCE: Final = 1e-13  # convergence tolerance, relative to a length
_OPEN = (codes.FORWARD_NOT_CONVERGED, codes.FORWARD_NO_LENGTHS)


def checked_winding(winding: ArrayLike, shape: tuple[int, ...], cables: int) -> Array:
    """Winding directions, one per cable.

    winding: directions +1, -1 and 0; shape: () for a single pose, (N,) for N poses. Returns an array of shape (m,) or
    (N, m).
    """
    array = checked(winding, "winding", "")
    shapes = [(cables,)] + [(*shape, cables)] * bool(shape)
    if array.shape not in shapes:
        step = "Give one direction for each cable, or None for no friction."
        raise InvalidValueError("winding", f"of shape {array.shape}", f"shape {' or '.join(map(str, shapes))}", step)
    wrong = ~np.isin(array, (-1.0, 0.0, 1.0))
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        allowed = "1 winding in, -1 paying out, or 0 at rest"
        raise InvalidValueError(
            f"winding[{', '.join(map(str, index))}]", f"{array[index]:g}", allowed, "Give the sign of the motion."
        )
    return array


def without_guides(robot: Robot, solver: str, instead: str) -> Robot:
    """Return `robot` unchanged, but refuse a robot with guides.

    solver: name of the function that does not support guides, for the message.
    """
    if robot.winches is None or robot.winches.guides is None:
        return robot
    step = f"Use {instead}(), or robot.replace(winches=robot.winches.replace(guides=None)) for a straight guided run."
    raise InvalidValueError("winches: guides", "given", f"None for {solver}", step)


def iterate_routing(
    robot: Robots,
    model: CableModel,
    found: ForwardRows,
    lengths: Array,
    loads: Array,
    winding: Array | None,
    taken: Array | None = None,
) -> ForwardRows:
    """Equilibria at lengths that include the actual routing.

    The lengths for the kernels are the given lengths minus the correction for guides and friction. Each iteration
    computes the correction at the last tensions, until convergence.

    found: equilibria for straight guided cables without friction, at the given lengths minus the initial correction;
    lengths: unstrained lengths (N, m); loads: external plus inertial wrenches (1 or N, 6); winding: directions of
    friction, shape (m,) or (N, m), or None; taken: initial correction for guides and friction [m], (N, m); None for
    zero. Returns the results; NOT_CONVERGED if the iteration does not converge, or a cable is too slack for a catenary
    between its guides.
    """
    more = np.zeros(lengths.shape) if taken is None else taken.copy()
    past: deque[tuple[Array, Array]] = deque(maxlen=MEMORY)  # input and residual of the last iterations
    still = np.flatnonzero(~np.isin(found.pose_status, _OPEN))
    for _ in range(ITERATIONS):
        if not still.size:
            return found
        some = found.part(still)
        turning = winding if winding is None or winding.ndim == 1 else winding[still]
        added = _routing_change(robots_at(robot, still), model, some, turning)
        slack = np.isnan(added)
        missed = np.where(slack, 0.0, added - more[still])
        moving = (np.abs(missed) > TOLERANCE * lengths[still]).any(axis=1)
        whole = np.zeros(lengths.shape)
        whole[still] = missed
        mixed = more[still] + _anderson_step(more[still], missed, [(x[still], f[still]) for x, f in past])
        past.append((more.copy(), whole))
        given = lengths[still] - mixed
        lost = np.where(moving, ~(given > 0.0).all(axis=1), slack.any(axis=1))
        found.pose_status[still[lost]] = codes.FORWARD_NOT_CONVERGED
        again = moving & ~lost
        still, starts = still[again], locked(some.poses[again])
        if still.size:
            more[still] = mixed[again]
            load = loads if len(loads) == 1 else locked(loads[still])
            found.keep(still, solve_forward_rows(robots_at(robot, still), model, locked(given[again]), starts, load))
            still = still[~np.isin(found.pose_status[still], _OPEN)]
    found.pose_status[still] = codes.FORWARD_NOT_CONVERGED
    return found


def _anderson_step(taken: Array, missed: Array, past: list[tuple[Array, Array]]) -> Array:
    """The next iterate by Anderson mixing, from previous inputs and residuals, (N, m)."""
    if not past:
        return missed
    changes = np.stack([missed - before for _, before in past], axis=-1)
    moves = np.stack([taken - before for before, _ in past], axis=-1)
    shares = np.linalg.pinv(changes, rcond=_RANK) @ missed[..., None]
    step: Array = missed - ((moves + changes) @ shares)[..., 0]
    return step


def _routing_change(robot: Robots, model: CableModel, found: ForwardRows, winding: Array | None) -> Array:
    """Change of the lengths due to guides and friction [m], (N, m); NaN for a cable that is too slack."""
    shape = (len(found.poses),)
    plain = found.solution(robot, model, np.zeros(6), shape).state
    real = with_routing(plain, winding)
    assert plain.contact is not None
    assert real.contact is not None
    return (real.contact.wrapped_length - plain.contact.wrapped_length) + (
        real.contact.dead_length - plain.contact.dead_length
    )
