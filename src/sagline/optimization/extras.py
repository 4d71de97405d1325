"""Packages that only a search needs, loaded when one begins."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from sagline.core.errors import InvalidValueError


def extra(module: str) -> Any:
    """A module of one of the packages of `sagline[design]`.

    Args:
        module: Its full name.

    Returns:
        The module.

    Raises:
        InvalidValueError: If its package is not installed; the message says how to get it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        step = 'Install it: pip install "sagline[design]"; or choose "differential_evolution", which needs nothing.'
        raise InvalidValueError(f"the package {package}", "missing", "installed", step) from None
