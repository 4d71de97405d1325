"""Public names. The stubs of the packages declare them; each name is loaded at its first use."""

from __future__ import annotations

import re
import sys
from functools import cache
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType
from typing import Any

_LINE = re.compile(r"^from (\.\S*) import (?:(\w+) as \2|\*)$", re.MULTILINE)


@cache
def public_names(package: str, *, listed: bool = False) -> dict[str, str]:
    """Public names of `package`, and the modules that contain them; `listed`: True to omit names from `import *`."""
    stub = Path(__file__).parents[1].joinpath(*package.split(".")[1:], "__init__.pyi")
    found: dict[str, str] = {}
    for place, name in _LINE.findall(stub.read_text(encoding="utf-8")):
        module = resolve_name(place, package)
        if name:
            found[name] = module
        elif not listed:
            found |= dict.fromkeys(public_names(module), module) | found
    return found


class Group(ModuleType):
    """A package that lists the names in its stub, and loads each name at its first use."""

    @property
    def __all__(self) -> list[str]:
        """Names that `import *` imports."""
        return sorted(public_names(self.__name__, listed=True))

    def __dir__(self) -> list[str]:
        """Names that `dir` lists."""
        return self.__all__

    def __getattr__(self, name: str) -> Any:
        """Load a public name."""
        module = public_names(self.__name__).get(name)
        if module is None:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        if module == self.__name__:
            return import_module(f"{module}.{name}")
        value = getattr(import_module(module), name)
        setattr(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        """Set the attribute `name`. A public name is kept when the import system binds a module with the same name."""
        if not isinstance(value, ModuleType) or public_names(self.__name__).get(name, self.__name__) == self.__name__:
            super().__setattr__(name, value)


def group(package: str) -> None:
    """Change the class of a package to `Group` while the package is imported."""
    sys.modules[package].__class__ = Group
