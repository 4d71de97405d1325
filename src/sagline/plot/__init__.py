"""Figures a person would put in a paper: every function draws on the Axes it is given, or makes a figure of its own.

No global state: `matplotlib.pyplot` is neither used nor needed. In a notebook a returned figure shows itself; of an
Axes it is `ax.figure` that does. `save` writes either to a file. What is drawn inside `with style("ieee"):` has the
width, the fonts and the sizes of a journal.
"""

from sagline.plot.calibration import calibration
from sagline.plot.courses import lengths, overview, tensions
from sagline.plot.drawing import drawing
from sagline.plot.energy import energy
from sagline.plot.errors import error, errors
from sagline.plot.execution import execution, measured_tensions, mendable_tensions, place_errors, states
from sagline.plot.film import film
from sagline.plot.frequencies import frequencies
from sagline.plot.front import front
from sagline.plot.maps import frequency_map
from sagline.plot.motion import path, velocity
from sagline.plot.multiples import small_multiples
from sagline.plot.polygon import polygon
from sagline.plot.response import response
from sagline.plot.robot import robot
from sagline.plot.sheet import save
from sagline.plot.slice import slice
from sagline.plot.style import style
from sagline.plot.workspace import workspace

__all__ = [
    "calibration",
    "drawing",
    "energy",
    "error",
    "errors",
    "execution",
    "film",
    "frequencies",
    "frequency_map",
    "front",
    "lengths",
    "measured_tensions",
    "mendable_tensions",
    "overview",
    "path",
    "place_errors",
    "polygon",
    "response",
    "robot",
    "save",
    "slice",
    "small_multiples",
    "states",
    "style",
    "tensions",
    "velocity",
    "workspace",
]
