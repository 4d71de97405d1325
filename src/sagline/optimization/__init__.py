"""Design optimization: design variables, goals, optimizers and results."""

from sagline.core.surface import group

group(__name__)
