"""sagline: cable-driven parallel robots whose cables sag. `__init__.pyi` declares the public names."""

from sagline.core.surface import group

group(__name__)
