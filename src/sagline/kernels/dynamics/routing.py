"""Compliance of the frame ends of free spans whose cables run over pulleys or have dead length."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable import rows as t
from sagline.kernels.cable.over_pulleys import end_motion_per_length
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model, Terms, model_of
from sagline.kernels.dynamics import string as s
from sagline.kernels.jit import entry


@entry
def fill_routing_compliance(
    terms: Terms, robots: Array, wraps: Array, leaving: Array, rows: Array, strings: Array
) -> None:
    """Fill the last columns of the table of strings, (N, m, STRING_COLUMNS), of cables with something behind them.

    Args:
        terms: Cable model.
        robots: cable_table, (1 or N, m, CABLE_COLUMNS).
        wraps: Wrap angles [rad], (N, m).
        leaving: Tensions where the cables leave their pulleys [N], (N, m).
        rows: Work array, (CABLE_ROWS, m).
        strings: Its other columns are known.
    """
    bare = model_of(terms)
    model = Model(bare.code, bare.k_h, bare.k_p, bare.gravity, True)
    for p in range(strings.shape[0]):
        cables = robots[min(p, robots.shape[0] - 1)]
        for i in range(strings.shape[1]):
            rows[t.WRAP, i], rows[t.LEAVING, i] = wraps[p, i], leaving[p, i]
            rows[t.WRAP_SINE, i], rows[t.WRAP_COSINE, i] = math.sin(wraps[p, i]), math.cos(wraps[p, i])
            x, z, gives = end_motion_per_length(model, cables, rows, i)
            root = math.sqrt(gives)
            strings[p, i, s.BEHIND_X], strings[p, i, s.BEHIND_Z] = root * x, root * z
            # the whole plane turns about the swivel axis
            slack = pulley_at(cables, i).radius * (1.0 - rows[t.WRAP_COSINE, i])
            strings[p, i, s.BEHIND_Y] = slack / strings[p, i, s.HORIZONTAL] if slack > 0.0 else 0.0
