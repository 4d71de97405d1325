"""The controller of a cable robot: states, loops, faults, and link to the machine."""

from sagline.core.surface import group

group(__name__)
