"""Sharing in the tension at the frame end, which is no linear function: linearized where the last round left it."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.setting import factor_balance, limit_variable, refer
from sagline.kernels.cable.hanging import frame_end_tension
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.codes import (
    FRAME_END_TENSION,
)
from sagline.kernels.jit import kernel

STILL = 1e-9  # relative change of tension at which a sharing in frame-end tensions stands still
SLOPE_STEP = 1e-4  # relative step of the central difference of the frame-end tension


@kernel
def linearize_ends(model: Model, preference: Array, geometry: Array, work: Array) -> None:
    """Fill SCALE, OFFSET, LOW and HIGH of the frame-end tensions as they run near the present chord tensions."""
    ends = np.empty(3)
    for i in range(work.shape[1]):
        tau = work[tables.TAU, i]
        for k in range(3):
            ends[k] = frame_end_tension(
                model,
                Chord(geometry[g.CHORD, i], geometry[g.SINE, i], geometry[g.COSINE, i]),
                Material(work[tables.DENSITY_ROW, i], work[tables.STIFFNESS_ROW, i]),
                tau * (1.0 + (k - 1) * SLOPE_STEP),
            )
        slope = (ends[2] - ends[0]) / (2.0 * SLOPE_STEP * tau)
        work[tables.OFFSET, i] = ends[1] - slope * tau
        limit_variable(slope * preference[tables.ROOT_WEIGHT, i], work, i)


@kernel
def relinearize(
    model: Model,
    method: int,
    freedom: Array,
    preference: Array,
    previous: Array,
    geometry: Array,
    work: Array,
    full: Array,
    matrix: Array,
    reduced: Array,
    balance: Array,
    q: Array,
    inverse: Array,
    null: Array,
    reference: Array,
) -> bool:
    """Set the balance up again, in frame-end tensions as they run near the present chord tensions; False: rank lost."""
    linearize_ends(model, preference, geometry, work)
    if not factor_balance(freedom, geometry, work, full, matrix, reduced, balance, q, inverse, null):
        return False
    refer(method, FRAME_END_TENSION, preference, previous, work, null, reference)
    return True
