"""Robots as units of co-simulation (FMU, Functional Mock-up Interface)."""

from sagline.core.surface import group

group(__name__)
