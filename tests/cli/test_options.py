"""Options name the functions of `sagline.cli.values` that convert them; the names are resolved when a command runs."""

import ast
from collections.abc import Iterator
from pathlib import Path

import sagline.cli
from sagline.cli import values


def conversions() -> Iterator[tuple[str, str]]:
    """File and name of the conversion of each option."""
    for file in Path(sagline.cli.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "converted_option":
                name = ast.literal_eval(node.args[2]) if isinstance(node.args[2], ast.Constant) else ""
                yield file.name, name


def test_every_option_names_a_conversion_that_exists() -> None:
    found = [(file, name) for file, name in conversions() if name]
    assert {"pose_of_text", "wrench_of_text"} <= {name for _, name in found}
    assert [(file, name) for file, name in found if not callable(getattr(values, name, None))] == []
