"""Names and signatures of the public surface."""

from __future__ import annotations

import inspect
import re
from enum import Enum
from types import ModuleType
from typing import Any

import sagline as sl
from sagline.core.surface import public_names

MODULES = (sl.control, sl.plc, sl.plot, sl.sweep, sl.twin)


def record() -> dict[str, Any]:
    """Every public name with its signature, members of classes included."""
    return {
        module.__name__: {name: _describe(getattr(module, name)) for name in _names(module)}
        for module in (sl, *MODULES)
    }


def _names(module: ModuleType) -> list[str]:
    return sorted(public_names(module.__name__))


def _describe(value: Any) -> Any:
    if isinstance(value, type):
        bases = [base.__name__ for base in value.__mro__[1:] if base is not object]
        if issubclass(value, Enum):
            return {"bases": bases, "members": {member.name: str(member.value) for member in value}}
        members = {name: _member(value, name) for name in sorted(dir(value)) if not name.startswith("_")}
        return {"call": _signature(value), "bases": bases, "members": members}
    if isinstance(value, ModuleType):
        return "module"
    return _signature(value) if callable(value) else type(value).__name__


def _member(owner: type, name: str) -> str:
    found = inspect.getattr_static(owner, name)
    if isinstance(found, staticmethod | classmethod):
        return f"{type(found).__name__} {_signature(getattr(owner, name))}"
    return _signature(found) if inspect.isfunction(found) else "attribute"


def _signature(value: Any) -> str:
    try:
        text = re.sub(r" at 0x[0-9a-f]+", "", str(inspect.signature(value)))
        return text.replace("-> 'None'", "-> None")  # generated constructors and explicit ones
    except (TypeError, ValueError):
        return "()"
