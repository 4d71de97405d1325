"""What the cables of one pose can do: their chord tensions, and between which pulls T_z - tau sin phi they hang."""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels.cable.pulls import Curves, Section, pull_range, pulls_at
from sagline.kernels.cable.turns import find_turns
from sagline.kernels.codes import CATENARY
from sagline.kernels.jit import glue
from sagline.kernels.memory import Memory

LOOSEST = 5.0  # largest X = wD/(2 tau): a cable fifteen times as long as its chord, which no winch pulls on

# Rows of the bands (BAND_ROWS, m).
LOW, HIGH = 0, 1  # chord tensions [N]; the upper one may be infinite
TAUT = 2  # the largest one that sagging cables are looked at: where there is no limit they are stretched to twice
PULL_LOW, PULL_HIGH = 3, 4  # pulls at LOW and TAUT [N]
LEAST, MOST = 5, 6  # least and largest pull between them [N]
BAND_ROWS = 7


@glue
def fill_bands(curves: Curves, bands: Array, memory: Memory) -> bool:
    """Fill the bands of the cables in place; False where one is too slack to hang, whatever its tension.

    Tensions below which a cable's X = wD/(2 tau) is above LOOSEST are left out: with a least tension of zero the pull
    has no largest value.
    """
    cables = curves.cables
    m = cables.low.size
    exact = curves.model.code == CATENARY
    for i in range(m):
        bands[LOW, i] = cables.low[i]
        bands[HIGH, i] = cables.high[i]
        bands[TAUT, i] = cables.high[i]
        if exact:
            if cables.high[i] == math.inf:
                bands[TAUT, i] = max(cables.low[i], cables.stiffness[i])
            bands[LOW, i] = min(max(cables.low[i], cables.half_weight[i] / LOOSEST), bands[TAUT, i])
    if not exact:
        for i in range(m):
            pull = cables.pull[i]  # of first order, and the same at every tension
            bands[PULL_LOW, i] = bands[PULL_HIGH, i] = bands[LEAST, i] = bands[MOST, i] = pull
        return True
    find_turns(curves, bands[LOW], bands[TAUT], memory)
    pulls_at(curves, bands[LOW], bands[PULL_LOW])
    pulls_at(curves, bands[TAUT], bands[PULL_HIGH])
    hang = True
    for i in range(m):
        section = Section(bands[LOW, i], bands[TAUT, i], bands[PULL_LOW, i], bands[PULL_HIGH, i])
        bands[LEAST, i], bands[MOST, i] = pull_range(curves, i, section)
        hang = hang and bands[LEAST, i] <= bands[MOST, i]
    return hang
