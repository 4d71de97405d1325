"""The studies of the article, computed again. A module contains a study, or a chapter of the page about a study."""

from sagline.core.surface import group

group(__name__)
