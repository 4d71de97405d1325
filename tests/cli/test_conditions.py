"""Options that require or exclude another option are declared, and refused if they have no effect."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any, get_type_hints

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from sagline.cli.main import MODULES, NAMES, app

Context = frozenset[tuple[int, bool, str]]  # line of an `if`, its branch, and an option in its condition
Options = Mapping[str, Sequence[str]]  # for each parameter of a command, its options
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
def test_an_option_without_effect_is_rejected(name: str, parameter: Any, condition: tuple[str, bool]) -> None:
    wanted, needed = condition
    command = COMMANDS[name]
    (other,) = [each for each in command.params if label(each) == wanted]
    required = [word for each in command.params if each.required for word in words(each)]
    given = [*required, *words(parameter)]
    if not needed:
        given += words(other)
    elif other.default:  # a flag that is true by default
        given.append(other.secondary_opts[0])
    done = CliRunner().invoke(app, [name, *given])
    assert done.exit_code == 2
    assert done.stderr.count("\n") == 1
    assert f"{label(parameter)} is given {'without' if needed else 'with'} {wanted};" in done.stderr


def named(node: ast.AST, options: Options) -> Sequence[str]:
    """Options of a name: those of a parameter, or the one of a field of a group."""
    if isinstance(node, ast.Attribute) and node.attr in named(node.value, options):
        return [node.attr]
    return options.get(node.id, ()) if isinstance(node, ast.Name) else ()


def uses(node: ast.AST | Sequence[ast.AST], options: Options, context: Context) -> Iterator[tuple[str, Context]]:
    """Uses of options with their branches; statements after a branch with a return belong to the other branch."""
    if isinstance(node, ast.AST) and (found := named(node, options)):
        yield from ((each, context) for each in found)
    elif isinstance(node, ast.If | ast.IfExp):
        yield from uses(node.test, options, context)
        tested = {each for each, _ in uses(node.test, options, frozenset())}
        for part, branch in ((node.body, True), (node.orelse, False)):
            yield from uses(part, options, context | {(node.lineno, branch, each) for each in tested})
    elif isinstance(node, ast.AST):
        for _, value in ast.iter_fields(node):
            if isinstance(value, ast.AST | list):
                yield from uses(value, options, context)
    else:
        for each in node:
            if isinstance(each, ast.AST):
                yield from uses(each, options, context)
                if isinstance(each, ast.If) and isinstance(each.body[-1], ast.Return):
                    tested = {option for option, _ in uses(each.test, options, frozenset())}
                    context |= {(each.lineno, False, option) for option in tested}


def function_of(name: str) -> tuple[ast.FunctionDef, Options]:
    """Syntax tree of the function of a command, and its options."""
    module = import_module(f"sagline.cli.{MODULES.get(name, name)}")
    function = getattr(module, name.replace("-", "_"))
    (tree,) = ast.parse(inspect.getsource(function)).body
    assert isinstance(tree, ast.FunctionDef)
    declared = {each.name for each in COMMANDS[name].params}
    options = {
        parameter: [each.name for each in fields(hint) if each.name in declared] if is_dataclass(hint) else [parameter]
        for parameter, hint in get_type_hints(function).items()
        if parameter != "return"
    }
    return tree, options


@pytest.mark.parametrize("name", NAMES)
def test_an_option_used_in_one_branch_of_another_is_declared(name: str) -> None:
    function, options = function_of(name)
    found: dict[str, Context] = {}
    for option, context in uses(function.body, options, frozenset()):
        found[option] = found.get(option, context) & context
    assert set(found) == {each.name for each in COMMANDS[name].params}  # each is used
    declared = {(each.name, wanted) for which, each, (wanted, _) in DECLARED if which == name}
    labels = {each.name: label(each) for each in COMMANDS[name].params}
    missing = {(p, labels[q]) for p, context in found.items() for _, _, q in context if q != p} - declared
    assert not missing
