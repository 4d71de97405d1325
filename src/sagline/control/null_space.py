"""Which errors of tension lengths can mend without moving the platform, and by which lengths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.control.load_cells import parity
from sagline.core.arrays import Array, locked
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.stiffness import stiffness


class NullSpace(NamedTuple):
    """What can be mended at a pose, and what can be told; N_L = `null_lengths`, K_A = `tension_sensitivity`.

    Attributes:
        projection: Pi = N_L N_L^T, of lengths on those that do not move the platform, shape (..., m, m).
        visible: K_A N_L G, of tensions on those that such lengths change, shape (..., m, m); G = (K_A N_L)^+.
        correction: N_L G, lengths that make up such tensions, shape (..., m, m) [m/N].
        parity: Of the load cells, shape (..., m, m): see `parity`.
    """

    projection: Array
    visible: Array
    correction: Array
    parity: Array


def null_space(state: Equilibrium) -> NullSpace:
    """The changes of length that do not move the platform, to first order, and the tensions at the frame they change.

    Six of the eight directions of a tension error are a wrench that the plan does not know, a payload or a load cell's
    own error; lengths that would hide it would move the platform. They are not among these.

    Args:
        state: An equilibrium of a robot with more cables than free motions, single or N of them.

    Returns:
        The matrices, single or N of them; NaN where the state has no lengths or its stiffness is singular.

    Raises:
        InvalidValueError: If the state is no Equilibrium (of a plan: plan.state).

    Source:
        docs/model.md, section 12.
    """
    known = stiffness(state)
    basis = known.null_lengths
    slope = known.tension_sensitivity @ basis
    lost = np.isnan(slope).any(axis=(-1, -2), keepdims=True)
    inverse = np.where(lost, np.nan, np.linalg.pinv(np.where(lost, 0.0, slope)))
    projection = basis @ np.swapaxes(basis, -1, -2)
    return NullSpace(locked(projection), locked(slope @ inverse), locked(basis @ inverse), parity(state))
