"""Creep: strain that follows the tension late; docs/model.md, section 10."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Flags
from sagline.kernels.jit import entry


@entry
def creep_strains(
    time: Array, tension: Array, stiffness: Array, delay: Array, settled: Flags, strain_out: Array
) -> None:
    """Sum of the late strains of springs with dampers beside them, exact for tensions that change evenly.

    Samples whose tension is NaN are left out: the tension changes evenly over the gap.

    Args:
        time: Of the samples [s], rising, (N,).
        tension: [N], (N, m).
        stiffness: Of each element [N], (k,).
        delay: Its time [s], (k,).
        settled: Whether the first tension has long been there, (1,); else the strain begins at zero.
        strain_out: (N, m).
    """
    for i in range(tension.shape[1]):
        for p in range(tension.shape[0]):
            strain_out[p, i] = 0.0 if abs(tension[p, i]) < math.inf else math.nan
        for k in range(stiffness.shape[0]):
            before, strain = -1, 0.0
            for p in range(tension.shape[0]):
                if not abs(tension[p, i]) < math.inf:
                    continue
                if before < 0:
                    strain = tension[p, i] / stiffness[k] if settled[0] else 0.0
                else:
                    step = time[p] - time[before]
                    late = (
                        (tension[p, i] - tension[before, i]) / step * delay[k]
                    )  # by how much it lags when it has run in
                    begin, end = tension[before, i] - late, tension[p, i] - late
                    strain = (end + (strain * stiffness[k] - begin) * math.exp(-step / delay[k])) / stiffness[k]
                strain_out[p, i] += strain
                before = p
