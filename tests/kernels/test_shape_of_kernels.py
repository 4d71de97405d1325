"""Numbers of arguments of kernels."""

import ast
from pathlib import Path

from sagline import kernels

MOST = 8
MANY = 6  # more than so many are for few
SHARE_OF_MANY = 0.10


def inner_kernels() -> dict[str, int]:
    """Argument counts of all kernels that only kernels call."""
    found = {}
    for source in Path(kernels.__file__).parent.rglob("*.py"):
        for node in ast.parse(source.read_text()).body:
            if isinstance(node, ast.FunctionDef):
                decorators = {name.id for name in node.decorator_list if isinstance(name, ast.Name)}
                if decorators & {"kernel", "formula", "glue"}:
                    found[f"{source.parent.name}/{source.name}: {node.name}"] = len(node.args.args)
    return found


def test_kernels_have_few_arguments() -> None:
    counts = inner_kernels()
    assert len(counts) > 100
    assert {name: count for name, count in counts.items() if count > MOST} == {}
    many = [name for name, count in counts.items() if count > MANY]
    assert len(many) <= SHARE_OF_MANY * len(counts), many


PULLEY_COLUMNS = {"PULLEY_RADIUS", "ENTRY", "DEAD_CABLE", "DEAD_RISE"}


def test_only_geometry_and_pulley_use_pulley_radii() -> None:
    """All other kernels use chords, wraps and routed lengths."""
    folder = Path(kernels.__file__).parent
    knowing = set()
    for source in folder.rglob("*.py"):
        names = {node.attr for node in ast.walk(ast.parse(source.read_text())) if isinstance(node, ast.Attribute)}
        if names & PULLEY_COLUMNS:
            knowing.add(source.relative_to(folder).as_posix())
    assert knowing == {"cable/geometry.py", "cable/pulley.py"}
