"""Load cells against each other: an error of one of them is at odds with the platform's balance, at any lengths."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.robot.several import first_of
from sagline.statics.slopes import cable_slopes, on_platform
from sagline.statics.tension_slopes import tension_slopes

SIGMAS: Final = 5.0  # by which a reading may be off before it means something
OWN_DEVIATION: Final = 1.0  # N, of a cell that does not say
BIAS: Final = 2.0  # N, 0.1 % of a cell of 2 kN
_LIFT: Final = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
_HIDDEN: Final = 1e-6  # of an error: what is less visible is not visible


def cell_sigma(robot: Robot) -> Array:
    """Standard deviation of what the load cells read, bias included [N], shape (m,)."""
    return np.hypot(*cell_errors(robot))


def cell_errors(robot: Robot) -> tuple[Array, Array]:
    """Standard deviations of what good load cells read, and the biases they may have [N], both of shape (m,)."""
    winches, none = robot.winches, np.zeros(robot.cable_count)
    own, bias = (none, none) if winches is None else (winches.load_cell_deviation, np.abs(winches.load_cell_bias))
    return np.where(own > 0.0, own, OWN_DEVIATION), np.maximum(bias, BIAS)


def balance_slope(state: Equilibrium) -> Array:
    """How the wrench of the cables changes with the tensions at the frame ends, the platform held.

    Args:
        state: An equilibrium, single or N of them.

    Returns:
        Its free parts, shape (..., n, m) [N/N, N m/N]; n the number of free motions.
    """
    slopes = cable_slopes(state)
    wrench = on_platform(slopes.by_length, slopes.levers) / tension_slopes(state, slopes).by_length[..., None, :]
    found: Array = -first_of(state.robot).freedom @ wrench  # the slopes are of the force on the cable
    return found


def parity(state: Equilibrium) -> Array:
    """What the balance of the platform says of each load cell, whatever its load weighs.

    Where the platform rests, tensions other than planned must leave the wrench as it is, but for a load that is not the
    planned one. With V the projection on all that they must not do, less the direction of the load, row i is
    V_i/sqrt(V_ii): times the tensions less the plan it is the error of cell i alone that is most like what is seen, as
    far as it is visible. The cell with the largest is named. Without the load's direction taken out, a load of another
    weight would be taken for a cell.

    Args:
        state: An equilibrium, single or N of them.

    Returns:
        Shape (..., m, m); zero rows for cells whose errors are not visible, NaN where the state has no lengths.

    Raises:
        InvalidValueError: If the state is no Equilibrium (of a plan: plan.state).

    Source:
        docs/model.md, section 12.
    """
    slope = balance_slope(instance(state, Equilibrium, "state"))
    lost = np.isnan(slope).any(axis=(-1, -2), keepdims=True)
    slope = np.where(lost, 0.0, slope)
    inverse = np.linalg.pinv(slope)
    load = inverse @ (first_of(state.robot).freedom @ _LIFT)
    size = np.linalg.norm(load, axis=-1, keepdims=True)
    load = load / np.where(size > 0.0, size, 1.0)
    visible = inverse @ slope - load[..., :, None] * load[..., None, :]
    own = np.einsum("...ii->...i", visible)
    scale = np.where(own > _HIDDEN, 1.0 / np.sqrt(np.maximum(own, _HIDDEN)), 0.0)
    return locked(np.where(lost, np.nan, scale[..., None] * visible))
