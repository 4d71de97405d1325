"""Size of the source: `make size` prints one table of counts, to compare a change with the state before.

Code lines are lines with a token that is neither a comment nor part of a docstring. A record type is a NamedTuple, a
dataclass or an attrs class. A public-looking name is the name of a function or class at the top of a module, without an
underscore at its beginning. An inner function is one that no public name reaches.
"""

from __future__ import annotations

import ast
import inspect
import io
import re
import sys
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, Final

ROOT: Final = Path(__file__).parents[1]
LONG_FUNCTION, LONG_FILE = 60, 400  # largest numbers of code lines of a function and lines of a file
LAYOUT: Final = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING}
Function = ast.FunctionDef | ast.AsyncFunctionDef


def docstring_lines(tree: ast.AST) -> set[int]:
    """Numbers of the lines of all docstrings of a module."""
    found: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | Function) and ast.get_docstring(node, clean=False) is not None:
            text = node.body[0]
            found.update(range(text.lineno, (text.end_lineno or text.lineno) + 1))
    return found


def code_lines(source: str, docstrings: set[int]) -> set[int]:
    """Numbers of the lines with code."""
    found: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in LAYOUT and token.type != tokenize.ENDMARKER:
            found.update(range(token.start[0], token.end[0] + 1))
    return found - docstrings


def is_record(node: ast.ClassDef) -> bool:
    """True for a NamedTuple, a dataclass or an attrs class."""
    words = " ".join(ast.unparse(each) for each in (*node.bases, *node.decorator_list))
    return bool(re.search(r"NamedTuple|dataclass|attrs\.|\bdefine\b|\bfrozen\b", words))


def top_names(tree: ast.Module) -> Iterator[str]:
    """Names of functions and classes at the top of a module."""
    for node in tree.body:
        if isinstance(node, Function | ast.ClassDef):
            yield node.name


def import_lines(tree: ast.Module) -> int:
    """Number of lines of import statements."""
    found = (node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom))
    return sum((node.end_lineno or node.lineno) - node.lineno + 1 for node in found)


def public_values() -> dict[str, Any]:
    """Public values by name: the values of `sagline`, and values of a group alone, such as `plot.tensions`."""
    import sagline
    from sagline.core.surface import public_names

    found: dict[str, Any] = {name: getattr(sagline, name) for name in public_names("sagline")}
    for group in [name for name, value in found.items() if isinstance(value, ModuleType)]:
        module = found.pop(group)
        own = {name: getattr(module, name) for name in module.__all__}
        found |= {f"{group}.{name}": value for name, value in own.items() if found.get(name) is not value}
    return found


def public_functions() -> dict[tuple[str, str], FunctionType]:
    """Public functions, public methods and constructors, by module and qualified name."""
    found: dict[tuple[str, str], FunctionType] = {}
    for value in public_values().values():
        members: list[object] = [value]
        if isinstance(value, type):
            own = [kind for kind in value.__mro__ if kind.__module__.startswith("sagline")]
            names = ((name, member) for kind in own for name, member in vars(kind).items())
            members = [member for name, member in names if name == "__init__" or name[0] != "_"]
        for member in members:
            inner = (
                getattr(member, "fget", None) or getattr(member, "__func__", None) or getattr(member, "func", member)
            )
            if isinstance(inner, FunctionType):
                found[inner.__module__, inner.__qualname__] = inner
    return found


def overrides_documented(module: str, name: str) -> bool:
    """True for a method that overrides a method of a base class with an Args section."""
    kind, _, method = name.rpartition(".")
    bases = getattr(sys.modules[module], kind).__mro__[1:]
    return any("Args:" in (getattr(vars(base).get(method), "__doc__", None) or "") for base in bases)


def without_args() -> list[str]:
    """Public methods with parameters, if neither the method nor the overridden method has an Args section."""
    found = []
    for (module, name), function in public_functions().items():
        parameters = set(inspect.signature(function).parameters) - {"self", "cls"}
        if "." not in name or name.endswith("__init__") or not parameters or "Args:" in (function.__doc__ or ""):
            continue
        if not overrides_documented(module, name):
            found.append(f"{module}.{name}")
    return sorted(found)


def without_examples() -> list[str]:
    """Public functions without an Examples section."""
    functions = [value for value in public_values().values() if isinstance(value, FunctionType)]
    return sorted(f"{each.__module__}.{each.__name__}" for each in functions if "Examples:" not in (each.__doc__ or ""))


def functions_of(node: ast.AST, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ast.AST]]:
    """Functions and methods of a module with their qualified names; nested functions belong to the outer one."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function):
            yield ".".join((*path, child.name)), child
        else:
            yield from functions_of(child, (*path, child.name) if isinstance(child, ast.ClassDef) else path)


def counts() -> tuple[Counter[str], Counter[str]]:
    """Counts of the whole source, and code lines of each folder."""
    total: Counter[str] = Counter()
    folders: Counter[str] = Counter()
    modules: defaultdict[str, set[str]] = defaultdict(set)
    package = ROOT / "src" / "sagline"
    public = public_functions().keys()
    for file in sorted(package.rglob("*.py")):
        source = file.read_text(encoding="utf-8")
        tree = ast.parse(source)
        docstrings = docstring_lines(tree)
        code = code_lines(source, docstrings)
        parts = file.relative_to(package).parts
        folders[parts[0] if len(parts) > 1 else "(top)"] += len(code)
        total["files"] += 1
        total["code lines"] += len(code)
        total["docstring lines"] += len(docstrings)
        module = ".".join(file.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")
        inner = (node for name, node in functions_of(tree) if (module, name) not in public)
        total["docstring lines of inner functions"] += sum(len(docstring_lines(node)) for node in inner)
        total["import lines"] += import_lines(tree)
        total[f"files of more than {LONG_FILE} lines"] += source.count("\n") > LONG_FILE
        for name in top_names(tree):
            modules[name].add(str(file))
            total["public-looking names"] += not name.startswith("_")
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                total["record types"] += is_record(node)
            if isinstance(node, Function):
                inside = code & set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
                total[f"functions of more than {LONG_FUNCTION} code lines"] += len(inside) > LONG_FUNCTION
            if isinstance(node, ast.ClassDef | Function | ast.Module):
                total["docstrings"] += ast.get_docstring(node) is not None
    total["names in more than one module"] = sum(len(files) > 1 for name, files in modules.items() if name[0] != "_")
    return total, folders


def main() -> int:
    """Print both tables."""
    sys.path.insert(0, str(ROOT / "src"))
    total, folders = counts()
    total["public methods without Args"] = len(without_args())
    total["public functions without Examples"] = len(without_examples())
    total["public names"] = len(public_values())
    for name, count in total.items():
        print(f"{name:45s} {count:7,d}")
    print(f"{'public-looking names for a public one':45s} {total['public-looking names'] / total['public names']:7.1f}")
    print(f"{'import lines, share of the code':45s} {100.0 * total['import lines'] / total['code lines']:6.1f}%")
    print("\ncode lines of the folders")
    for name, count in folders.most_common():
        print(f"{name:45s} {count:7,d}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
