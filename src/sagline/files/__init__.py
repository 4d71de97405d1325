"""Files for users and other programs."""

from sagline.core.surface import group

group(__name__)
