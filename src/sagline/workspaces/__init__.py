"""Workspaces: wrench sets, margins, criteria, boundaries, and proofs for boxes of poses."""

from sagline.core.surface import group

group(__name__)
