"""Cables with elongation and sag: material, five cable models, and cable states."""

from sagline.core.surface import group

group(__name__)
