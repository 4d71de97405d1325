"""What to do about a number that the readings do not tell."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

STEPS: Final = {  # the easiest first
    "pulley_radius": "measure the pulley with a caliper",
    "mass": "weigh the platform",
    "linear_density": "weigh some meters of the cable",
    "drum_radius": "measure the drum and its cable with a caliper, or pay out a length along a tape",
    "dead_cable": "measure the run from drum to pulley with a tape",
    "load_cell_bias": "read the load cell without load",
    "load_cell_gain": "check the load cell with a known weight",
    "axial_stiffness": "take poses of very different tensions, or pull a piece of the cable",
    "center_of_mass": "balance the platform, or take poses of more tilt",
    "platform_anchors": "measure the platform's anchors",
    "length_zero": "home at a pose that is measured",
    "target": "measure the target on the platform, or take poses of more tilt",
    "measuring_frame": "measure more poses, some of them turned",
    "frame_anchors": "measure frame anchors with a total station",
}


def easy_place(name: str) -> int:
    """Place of a kind among those that are easier to measure."""
    return list(STEPS).index(name)


def easiest(names: Iterable[str]) -> str:
    """What tells numbers of some kinds apart with the least work.

    Args:
        names: Of `unknowns.KINDS`.
    """
    return STEPS[min(names, key=easy_place)]
