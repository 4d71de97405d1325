"""Digital twin of a machine: the true robot, its drives, PLCs and network."""

from sagline.core.surface import group

group(__name__)
