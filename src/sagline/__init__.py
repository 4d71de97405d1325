"""sagline: cable-driven parallel robots whose cables sag. `__init__.pyi` lists the whole public surface."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from lazy_loader import attach_stub

_load, _, _names = attach_stub(__name__, __file__)
__all__ = sorted([*_names, "__version__"])


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name == "__version__":
        return import_module("importlib.metadata").version("sagline")
    if name not in _names:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return _load(name)


def __dir__() -> list[str]:
    return __all__
