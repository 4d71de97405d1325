"""The studies of the article, computed again: each study is a module with pure functions of numbers."""

from sagline.core.surface import group

group(__name__)
