"""The article's studies, computed again: one module per study, with pure functions of numbers."""

from sagline.core.surface import group

group(__name__)
