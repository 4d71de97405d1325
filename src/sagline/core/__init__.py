"""Base of all other folders: arrays, arguments, errors, numbers and results."""

from sagline.core.surface import group

group(__name__)
