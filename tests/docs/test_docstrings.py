"""The docstrings of the public surface: every argument, result and error is told, and every example runs."""

import ast
import doctest
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

import pytest

from tests.tiers import extended
from tools.size import public_values

pytestmark = extended

# what is told in full; a module or folder that is not listed is not looked at
TOLD = (
    "arrays",
    "article",
    "cables",
    "errors",
    "files",
    "kinematics",
    "motion",
    "plot",
    "robot",
    "statics",
    "status",
    "tension",
    "twin",
)
WIDTH = 80  # columns of code that a page shows without scrolling
CHECKS = ("checked", "exactly", "choice")  # these raise InvalidValueError for their caller


class Public(NamedTuple):
    """A function of the public surface.

    Attributes:
        name: Module and qualified name.
        function: The function.
        told: Docstrings in which its arguments may be told: its own; for a constructor also those of its class and of
            the classes it is made from, whose attributes they become.
    """

    name: str
    function: Callable[..., Any]
    told: tuple[str, ...]


def public_functions() -> Iterator[Public]:
    """The functions of the public surface, public methods and constructors of its classes."""
    for value in public_values().values():
        if isinstance(value, FunctionType):
            yield _public(value)
        elif inspect.isclass(value):
            yield from _methods(value)


def _methods(owner: type) -> Iterator[Public]:
    for kind in owner.__mro__:
        if not kind.__module__.startswith("sagline"):
            continue
        for name, member in vars(kind).items():
            method = getattr(member, "__func__", member)
            if not isinstance(method, FunctionType) or (name.startswith("_") and name != "__init__"):
                continue
            classes = tuple(inspect.getdoc(base) or "" for base in kind.__mro__[:-1]) if name == "__init__" else ()
            yield Public(f"{kind.__module__}.{method.__qualname__}", method, (inspect.getdoc(method) or "", *classes))


def _public(function: Callable[..., Any]) -> Public:
    name = f"{function.__module__}.{function.__qualname__}"
    return Public(name, function, (inspect.getdoc(function) or "",))


def is_told(name: str) -> bool:
    """Whether a function belongs to what is looked at."""
    return name.split(".")[1] in TOLD


FUNCTIONS = {public.name: public for public in public_functions() if is_told(public.name)}


def section(text: str, head: str) -> str:
    """What stands below a head of a docstring."""
    found = re.search(rf"^{head}:\n((?: .*\n|\n)*)", text + "\n", re.MULTILINE)
    return "" if found is None else found[1]


def untold(public: Public) -> list[str]:
    """What the docstrings leave out."""
    signature = inspect.signature(public.function)
    own = public.told[0]
    entries = section(own, "Args") + "".join(section(text, "Attributes") for text in public.told)
    names = [name for name in signature.parameters if name not in ("self", "cls")]
    missing = [name for name in names if not re.search(rf"^ +{name}: \S", entries, re.MULTILINE)]
    returned = signature.return_annotation
    if returned not in (None, "None", inspect.Signature.empty) and not section(own, "Returns"):
        missing.append("Returns")
    if raises(public.function) and not section(own, "Raises"):
        missing.append("Raises")
    return missing


def raises(function: Callable[..., Any]) -> bool:
    """Whether its body raises, or calls one of the checks that do."""
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except OSError:  # a constructor that dataclasses wrote
        return False
    called = {ast.unparse(node.func).split(".")[-1] for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return bool(called & set(CHECKS)) or any(isinstance(node, ast.Raise) for node in ast.walk(tree))


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_argument_result_and_error_is_told(name: str) -> None:
    assert untold(FUNCTIONS[name]) == []


def test_what_is_left_out_would_be_found() -> None:
    def told(span: float, *, rise: float) -> float:
        """Summary.

        Args:
            span: Of the cable [m].
        """
        if rise < span:
            raise ValueError
        return rise

    assert untold(_public(told)) == ["rise", "Returns", "Raises"]
    assert len(FUNCTIONS) > 40


def examples() -> dict[str, doctest.DocTest]:
    """The examples of every docstring of the public surface that has some."""
    finder = doctest.DocTestFinder(recurse=False)
    documented: dict[str, Any] = {public.name: public.function for public in public_functions()}
    documented |= {name: value for name, value in public_values().items() if inspect.isclass(value)}
    found = {name: finder.find(value, name, globs={}) for name, value in documented.items()}
    return {name: tests[0] for name, tests in found.items() if tests and tests[0].examples}


EXAMPLES = examples()


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_every_example_prints_what_it_says(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said: list[str] = []
    failed, tried = doctest.DocTestRunner().run(EXAMPLES[name], out=said.append)
    assert tried > 0
    assert failed == 0, "".join(said)


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_no_line_of_an_example_is_wider_than_a_page(name: str) -> None:
    lines = textwrap.dedent(EXAMPLES[name].docstring or "").splitlines()
    code = [line.strip() for line in lines if line.strip().startswith((">>> ", "... "))]
    assert code
    assert [line for line in code if len(line) > WIDTH + len(">>> ")] == []


def test_the_most_used_have_an_example() -> None:
    from_tension = "sagline.cables.model.CableModel.from_tension"
    wanted = {"Cable", "sagline.cables.cable.Cable.from_material", from_tension, "sagline.files.plan_file.load_plan"}
    wanted |= {f"sagline.statics.stiffness.{name}" for name in ("stiffness", "modes")}
    wanted |= {f"sagline.motion.rest_to_rest.{name}" for name in ("quintic_path", "septic_path")}
    wanted |= {f"sagline.kinematics.{name}.{name}" for name in ("confirm", "forward", "inverse")}
    wanted |= {"sagline.motion.sampled.path_from_samples", "sagline.files.robot_file.load_robot"}
    wanted |= {"Robot", "InverseSolver"}
    wanted |= {"sagline.kinematics.polygon.tension_polygon"}
    assert wanted <= EXAMPLES.keys()
