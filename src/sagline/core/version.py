"""Version of the installed package, which is read at its first use."""

from importlib.metadata import version

__version__ = version("sagline")
