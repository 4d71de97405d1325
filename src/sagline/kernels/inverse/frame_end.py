"""Distribution in the tension at the frame end, linearized at the tensions of the last iteration."""

from __future__ import annotations

from sagline.kernels.balance.setting import Balance, factor_balance, scale_limits
from sagline.kernels.cable.cables import Cables, chord_of, material_of, pulley_of
from sagline.kernels.cable.states import frame_end_tension
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import kernel
from sagline.kernels.tension.nearest import Distribution

STILL = 1e-9  # relative change of tension at which a distribution in frame-end tensions stands still
SLOPE_STEP = 1e-4  # relative step of the central difference of the frame-end tension


@kernel
def linearize_ends(model: Model, distribution: Distribution, cables: Cables, balance: Balance) -> bool:
    """Set the balance up again, in frame-end tensions as they run near the present chord tensions; False: rank lost."""
    for i in range(cables.tau.size):
        tau = cables.tau[i]
        chord, material, pulley = chord_of(cables, i), material_of(cables, i), pulley_of(cables, i)
        above = frame_end_tension(model, chord, material, pulley, tau * (1.0 + SLOPE_STEP))
        below = frame_end_tension(model, chord, material, pulley, tau * (1.0 - SLOPE_STEP))
        slope = (above - below) / (2.0 * SLOPE_STEP * tau)
        balance.offset[i] = frame_end_tension(model, chord, material, pulley, tau) - slope * tau
        balance.scale[i] = slope * distribution.weight[i]
        scale_limits(cables, balance, i)
    return factor_balance(balance)
