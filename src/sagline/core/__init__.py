"""Base of all other folders: arrays, checks of arguments, errors, numbers as text, and results."""

from sagline.core.surface import group

group(__name__)
