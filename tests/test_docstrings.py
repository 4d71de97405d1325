"""Docstrings: the examples in them run and give what they say, and nothing public leaves out what it takes or gives."""

import ast
import doctest
import inspect
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import sagline as sl

RINGS = ("motion", "robot", "kinematics", "tension")  # of which every section is asked for
WITH_EXAMPLES = (
    "InverseSolver",
    "Robot",
    "confirm",
    "forward",
    "inverse",
    "load_robot",
    "path_from_samples",
    "quintic_path",
    "septic_path",
    "tension_polygon",
)


def members() -> Iterator[tuple[str, Any]]:
    """Everything public by its name: functions, classes and their own public methods."""
    for name in sl.__all__:
        value = getattr(sl, name)
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value):
            yield name, value
            for key, member in vars(value).items():
                function = member.__func__ if isinstance(member, classmethod | staticmethod) else member
                if key == "__init__" or not key.startswith("_"):
                    yield f"{name}.{key}", function


MEMBERS = dict(members())
EXAMPLES = {
    name: found
    for name, value in MEMBERS.items()
    if (inspect.isfunction(value) or inspect.isclass(value))
    and (found := doctest.DocTestParser().get_examples(value.__doc__ or ""))
}


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_the_examples_give_what_they_say(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    test = doctest.DocTest(EXAMPLES[name], {}, name, None, None, None)
    said: list[str] = []
    doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert not said, "".join(said)


def test_the_most_used_have_an_example() -> None:
    assert [name for name in WITH_EXAMPLES if not {name, f"{name}.__init__"} & EXAMPLES.keys()] == []


FUNCTIONS = {
    name: value
    for name, value in MEMBERS.items()
    if inspect.isfunction(value)
    and value.__module__.startswith(tuple(f"sagline.{ring}" for ring in RINGS))
    and (value.__doc__ or not name.endswith("__init__"))  # a dataclass writes its own constructors
}


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_a_docstring_tells_what_goes_in_what_comes_out_and_what_goes_wrong(name: str) -> None:
    function: Callable[..., Any] = FUNCTIONS[name]
    text = inspect.getdoc(function) or ""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    (node,) = (found for found in tree.body if isinstance(found, ast.FunctionDef))
    given = [a for a in inspect.signature(function).parameters if a not in ("self", "cls")]
    for argument in given:
        assert f"    {argument}: " in text, f"{argument} is not explained"
    if node.returns is not None and ast.unparse(node.returns) != "None":
        assert "Returns:" in text
    if any(isinstance(inner, ast.Raise) for inner in ast.walk(node)):
        assert "Raises:" in text
