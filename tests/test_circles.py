"""No two modules import each other, even for types only."""

import ast
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.tiers import extended


def modules() -> dict[str, Path]:
    """All modules of sagline with their files."""
    spec = find_spec("sagline")
    assert spec is not None
    assert spec.origin is not None
    root = Path(spec.origin).parent
    parts = {file: file.relative_to(root.parent).with_suffix("").parts for file in root.rglob("*.py")}
    return {".".join(part for part in place if part != "__init__"): file for file, place in parts.items()}


def imported(tree: ast.Module, known: set[str]) -> Iterator[str]:
    """Modules of sagline that a module imports, including imports in functions and for types only."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in known else node.module


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules in which each module leads to all others (strongly connected components of Tarjan)."""
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        number[node] = low[node] = len(number)
        stack.append(node)
        for following in sorted(graph[node]):
            if following not in number:
                visit(following)
                low[node] = min(low[node], low[following])
            elif following in stack:
                low[node] = min(low[node], number[following])
        if low[node] == number[node]:
            place = stack.index(node)
            group = sorted(stack[place:])
            del stack[place:]
            if len(group) > 1 or node in graph[node]:
                found.append(group)

    for node in sorted(graph):
        if node not in number:
            visit(node)
    return found


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    files = modules()
    return {name: set(imported(ast.parse(file.read_text()), set(files))) for name, file in files.items()}


@extended
def test_imports_have_no_circles(graph: dict[str, set[str]]) -> None:
    assert len(graph) > 200
    assert circles(graph) == []


def test_a_circle_is_found() -> None:
    tree = ast.parse("if TYPE_CHECKING:\n    from a.b import C\ndef f():\n    from a import d, E\n    import a.g\n")
    assert set(imported(tree, {"a", "a.b", "a.d", "a.g"})) == {"a.b", "a.d", "a", "a.g"}
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set(), "e": {"e"}}
    assert circles(graph) == [["a", "b", "c"], ["e"]]
