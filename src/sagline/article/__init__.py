"""The studies of the article, computed again; a module has a study (functions of numbers) or a chapter of the page."""

from sagline.core.surface import group

group(__name__)
