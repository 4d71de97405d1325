"""Options that require or exclude another option are declared, and refused if they have no effect."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import sagline.cli
from sagline.cli.main import MODULES, NAMES, app

Context = frozenset[tuple[int, bool, str]]  # line of an `if`, its branch, and a parameter in its condition
GROUP: Any = get_command(app)
COMMANDS: dict[str, Any] = {name: GROUP.commands[name] for name in NAMES}


def label(parameter: Any) -> str:
    return str(parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar)


DECLARED = [
    (name, parameter, condition)
    for name, command in COMMANDS.items()
    for parameter in command.params
    for condition in command.conditions.get(parameter.name, ())
]


def words(parameter: Any) -> list[str]:
    """A parameter as on the command line."""
    if parameter.param_type_name == "argument":
        return ["1"]
    return [parameter.opts[0]] if parameter.is_flag else [parameter.opts[0], "1"]


@pytest.mark.parametrize(
    ("name", "parameter", "condition"), DECLARED, ids=lambda each: str(getattr(each, "name", each))
)
def test_an_option_without_effect_is_rejected(name: str, parameter: Any, condition: Any) -> None:
    command = COMMANDS[name]
    (other,) = [each for each in command.params if label(each) == condition.other]
    required = [word for each in command.params if each.required for word in words(each)]
    given = [*required, *words(parameter)]
    if not condition.given:
        given += words(other)
    elif other.default:  # a flag that is true by default
        given.append(other.secondary_opts[0])
    done = CliRunner().invoke(app, [name, *given])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1
    assert f"{label(parameter)} is given {'without' if condition.given else 'with'} {condition.other};" in done.stderr


def parameters_in(node: ast.AST, names: set[str]) -> list[str]:
    return [each.id for each in ast.walk(node) if isinstance(each, ast.Name) and each.id in names]


def uses(node: ast.AST | Sequence[ast.AST], names: set[str], context: Context) -> Iterator[tuple[str, Context]]:
    """Uses of parameters with their branches; statements after a branch with a return belong to the other branch."""
    if isinstance(node, ast.Name):
        if node.id in names:
            yield node.id, context
    elif isinstance(node, ast.If | ast.IfExp):
        yield from uses(node.test, names, context)
        for part, branch in ((node.body, True), (node.orelse, False)):
            yield from uses(part, names, context | {(node.lineno, branch, q) for q in parameters_in(node.test, names)})
    elif isinstance(node, ast.AST):
        for _, value in ast.iter_fields(node):
            if isinstance(value, ast.AST | list):
                yield from uses(value, names, context)
    else:
        for each in node:
            if isinstance(each, ast.AST):
                yield from uses(each, names, context)
                if isinstance(each, ast.If) and isinstance(each.body[-1], ast.Return):
                    context |= {(each.lineno, False, q) for q in parameters_in(each.test, names)}


def function_of(name: str) -> ast.FunctionDef:
    file = Path(sagline.cli.__file__).parent / f"{MODULES.get(name, name)}.py"
    body = ast.parse(file.read_text(encoding="utf-8")).body
    (found,) = [each for each in body if isinstance(each, ast.FunctionDef) and each.name == name.replace("-", "_")]
    return found


@pytest.mark.parametrize("name", NAMES)
def test_an_option_used_in_one_branch_of_another_is_declared(name: str) -> None:
    function = function_of(name)
    parameters = {each.arg for each in function.args.args}
    found: dict[str, Context] = {}
    for parameter, context in uses(function.body, parameters, frozenset()):
        found[parameter] = found.get(parameter, context) & context
    assert set(found) == parameters  # each is used
    declared = {(each.name, condition.other) for which, each, condition in DECLARED if which == name}
    labels = {each.name: label(each) for each in COMMANDS[name].params}
    missing = {(p, labels[q]) for p, context in found.items() for _, _, q in context if q != p} - declared
    assert not missing
