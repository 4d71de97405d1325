"""Figures for papers: every function draws on given Axes or creates a new figure, without `matplotlib.pyplot`.

A notebook shows a figure that a function returns. If a function returns Axes, show `ax.figure`. `save` writes a figure
or Axes to a file. Inside `with style("ieee"):`, figures have the width, fonts and sizes of a journal.
"""

from sagline.core.surface import group

group(__name__)
