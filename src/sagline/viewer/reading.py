"""What of a page can come after its cables."""

from __future__ import annotations

from enum import Enum


class Reading(Enum):
    """What can come after the cables: what it takes may still be compiled."""

    MARGIN = "capacity margin"
    POLYGON = "polygon of feasible tensions"
    SHARING = "what further ways of sharing choose"
    FREQUENCIES = "natural frequencies"
    REST = "where the platform rests if the model is approximate"
    MODES = "modes with cable mass"
    SIMULATION = "what follows when a cable is cut"
    WORKSPACE = "margins over a set of loads"
    VERDICTS = "whether a pose is feasible at all"
