"""Public names of `sagline.fmu`."""

from .export import export_fmu as export_fmu
