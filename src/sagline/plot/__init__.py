"""Figures for papers: every function draws on given Axes or creates a new figure, without `matplotlib.pyplot`.

A notebook shows a returned figure; for returned Axes, show `ax.figure`. `save` writes a figure or Axes to a file.
`with style("ieee"):` sets width, fonts and sizes of a journal.
"""

from sagline.plot.calibration import calibration
from sagline.plot.drawing import drawing
from sagline.plot.dynamics import energy, frequencies, frequency_map, response
from sagline.plot.execution import execution, measured_tensions, mendable_tensions, place_errors, states
from sagline.plot.film import film
from sagline.plot.front import front
from sagline.plot.plan import error, errors, lengths, overview, path, small_multiples, tensions, velocity
from sagline.plot.polygon import polygon
from sagline.plot.robot import robot
from sagline.plot.sheet import save
from sagline.plot.style import style
from sagline.plot.workspace import slice, workspace

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
