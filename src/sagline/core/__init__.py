"""Arrays, arguments, errors, numbers and results: the base that every other folder uses."""

from sagline.core.surface import group

group(__name__)
