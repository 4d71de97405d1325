"""Version of the installed package; loaded when it is first used."""

from importlib.metadata import version

__version__ = version("sagline")
