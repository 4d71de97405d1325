"""Robots with exact sagging cables in MuJoCo: models, and the engine plug-in `sagline.cables`."""

from sagline.core.surface import group

group(__name__)
