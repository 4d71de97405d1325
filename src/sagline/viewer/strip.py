"""What stands beneath a picture or a film: whose it is, what its colors mean, and how it differs from what is.

`browser/strip.js` draws it; here is what it says.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sagline.viewer.readout import spaced
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.view import View

HEIGHT: Final = 4.0  # of the size of its text
_STOPS = 16  # of the bar's colors


def strip_of(view: View, *remarks: str) -> dict[str, Any]:
    """What there is to say about a view, as JSON knows it.

    Args:
        view: What is shown.
        remarks: To be said beneath the title before all else.
    """
    settings, scale = view.settings, view.scale
    unit = force_unit(view.snapshot.robot)
    drawn = [(settings.sag_scale, "sag"), (settings.error_scale, "errors")]
    larger = [f"{what} drawn {factor:g} times as large" for factor, what in drawn if factor != 1.0]
    shares = np.linspace(0.0, 1.0, _STOPS)
    colors = scale.colors(scale.low * (scale.high / scale.low) ** shares)
    return {
        "title": view.snapshot.robot.name,
        "remark": ", ".join((*remarks, *larger)),
        "colors": ["#{:02x}{:02x}{:02x}".format(*map(int, color)) for color in colors],
        "ticks": [[f"{tick / unit.newtons:g}", place] for tick, place in spaced(scale)],
        "legend": f"Chord tension [{unit.name}]",
    }
