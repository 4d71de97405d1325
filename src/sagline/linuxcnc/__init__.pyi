"""Public names of `sagline.linuxcnc`."""

from .export import export_linuxcnc as export_linuxcnc
