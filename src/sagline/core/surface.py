"""Public names of the packages. The stub of a package declares its names, which are loaded at their first use."""

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
    """Public names of `package`, each with its module; listed: True to omit names that come from `import *`."""
    found: dict[str, str] = {}
    for place, name in _LINE.findall(_stub(package)):
        module = resolve_name(place, package)
        if name:
            found[name] = module
        elif not listed:
            found |= dict.fromkeys(public_names(module), module) | found
    return found


def ordered_names(package: str) -> dict[str, str]:
    """Names between `# isort: off` and `# isort: on` in the stub of `package`, in this order, each with its module."""
    block = _stub(package).partition("# isort: off\n")[2].partition("# isort: on\n")[0]
    return {name: resolve_name(place, package) for place, name in _LINE.findall(block)}


@cache
def ordered_classes(package: str) -> dict[str, Any]:
    """Classes of `ordered_names`, by name."""
    return {name: getattr(import_module(module), name) for name, module in ordered_names(package).items()}


def _stub(package: str) -> str:
    return Path(__file__).parents[1].joinpath(*package.split(".")[1:], "__init__.pyi").read_text(encoding="utf-8")


class Group(ModuleType):
    """Type of a package that lists the names of its stub, and loads each name at its first use."""

    @property
    def __all__(self) -> list[str]:
        """Names that `import *` imports."""
        return sorted(public_names(self.__name__, listed=True))

    def __dir__(self) -> list[str]:
        """Names that `dir` lists."""
        return self.__all__

    def __getattr__(self, name: str) -> Any:
        """Load the public name `name` from its module."""
        module = public_names(self.__name__).get(name)
        if module is None:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        if module == self.__name__:
            return import_module(f"{module}.{name}")
        value = getattr(import_module(module), name)
        setattr(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute, unless the import system would replace a public name by a module with this name."""
        if not isinstance(value, ModuleType) or public_names(self.__name__).get(name, self.__name__) == self.__name__:
            super().__setattr__(name, value)


def group(package: str) -> None:
    """Change the type of `package` to `Group`; a package calls this function during its import."""
    sys.modules[package].__class__ = Group
