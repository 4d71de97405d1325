"""Tension distribution for redundant cables: methods, margins, and polygon of feasible tensions."""

from sagline.core.surface import group

group(__name__)
