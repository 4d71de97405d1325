"""Constructs outside of the subset are refused with file, line and an alternative."""

from __future__ import annotations

import re
from pathlib import Path
from types import FunctionType

import pytest

from tools.translate import __main__ as command
from tools.translate.program import translate
from tools.translate.types import NONE, ArrayType, Element, Scalar, TranslationError, Type, plain_tuple

F1, F2 = ArrayType(Element.FLOAT, 1), ArrayType(Element.FLOAT, 2)
TYPES = (F1, F2, Scalar.INT, plain_tuple(Scalar.FLOAT, Scalar.INT))
HEAD = """import numpy as np
TABLE = np.array([1.0, 2.0])
FACTORS = {"steel": 2.0}
def helper(a, n): a[n] = 1.0
def kernel(a, b, n, pair):
"""
FIRST = HEAD.count("\n") + 1  # line of a kernel's first statement

REFUSED = {  # statements, the refused line, and a part of the error message
    "a[::2][0] = 1.0": (0, "step"),
    "a[-n] = 1.0": (0, "-n"),
    "a[n / 2] = 1.0": (0, "float as an index"),
    "x = a\nx = 1.0\na[0] = x": (1, "x has two types"),
    "for _ in range(n):\n    a[0] = x\n    x = y\n    y = x": (1, "no type"),
    "kernel(a, b, n, pair)": (0, "calls itself"),
    "a[0] = round(1.5, ndigits=n)": (0, "ndigits"),
    "helper(a)": (0, "1 arguments of helper"),
    "a[0] = (2.0 * a)[0]": (0, "Mult"),
    "a[0] = np.zeros(n)[0]": (0, "np.zeros"),
    "a[0] = FACTORS['steel']": (0, "dict"),
    "a[0] = 'steel'": (0, "str"),
    "def inner(): pass": (0, "FunctionDef"),
    "try:\n    a[0] = 1.0\nfinally:\n    pass": (0, "Try"),
    "raise ValueError": (0, "Raise"),
    "a[0] = [k for k in range(n)][0]": (0, "ListComp"),
    "a[0] = (lambda x: x)(1.0)": (0, "lambda"),
    "while n > 3:\n    n -= 1\nelse:\n    a[0] = 1.0": (0, "else"),
    "for _ in range(n): pass\nelse:\n    a[0] = 1.0": (0, "else"),
    "for k in range(0, 10, n): a[k] = 1.0": (0, "step"),
    "for k in (1, 2.0): a[0] = k": (0, "loop over"),
    "TABLE[0] = a[0]": (0, "constant array"),
    "TABLE[0] += a[0]": (0, "constant array"),
    "x, y = a[0], a[1], a[2]\na[0] = x": (0, "3 values for 2 targets"),
    "a[0] = nowhere": (0, "nowhere"),
    "a[0] = 1.0 if n and a[0] > 0.0 else 0.0": (0, "int as operand"),
    "if a.shape[n:]: pass": (0, "slice"),
    "a[0] = n is 3": (0, "`is`"),
    "a[0] = n**n": (0, "exponent"),
    "a[0] = a[0] @ n": (0, "MatMult"),
    "if a: a[0] = 1.0": (0, "condition"),
    "a.reshape((-1, 2))[0, 0] = 1.0": (0, "reshape"),
    "b[:, 0].reshape((2, 2))[0, 0] = pair[0]": (0, "strides"),
    "a[0, 1] = 1.0": (0, "2 indices"),
    "a[0] = b.T[0, 0]": (0, "no T"),
    "a[0]": (0, "no effect"),
    "a[0] = pair[n]": (0, "not constant"),
    "a[0] = pair[2]": (0, "item 2"),
    "a[0] = pair == pair": (0, "compared"),
    "a[:] = b": (0, "assigned"),
    "b.size = 3": (0, "b.size"),
    "pair[0] = 1.0": (0, "tuple"),
    "return a if n > 1 else b": (0, "two types"),
}


def kernel_of(body: str, folder: Path) -> FunctionType:
    """A function with the statements, in a new file."""
    file = folder / "kernel.py"
    file.write_text(HEAD + "".join(f"    {line}\n" for line in body.split("\n")), encoding="utf-8")
    space: dict[str, object] = {"__name__": "kernel"}
    exec(compile(file.read_text(encoding="utf-8"), str(file), "exec"), space)
    found = space["kernel"]
    assert isinstance(found, FunctionType)
    return found


@pytest.mark.filterwarnings("ignore::SyntaxWarning")
@pytest.mark.parametrize("body", REFUSED)
def test_a_construct_outside_the_subset_is_refused(body: str, tmp_path: Path) -> None:
    line, construct = REFUSED[body]
    kernel = kernel_of(body, tmp_path)
    with pytest.raises(TranslationError) as caught:
        translate([(kernel, TYPES, "entry")])
    error = caught.value
    assert (error.file, error.line) == (str(tmp_path / "kernel.py"), FIRST + line)
    assert construct in error.construct
    assert error.instead.endswith(".")
    assert str(error).startswith(f"{error.file}:{error.line}: ")


def test_the_error_names_the_place_of_the_call(tmp_path: Path) -> None:
    kernel = kernel_of("helper(a, 1.0)", tmp_path)
    with pytest.raises(TranslationError) as caught:
        translate([(kernel, TYPES, "entry")])
    assert caught.value.line == HEAD.split("\n").index("def helper(a, n): a[n] = 1.0") + 1
    assert caught.value.__notes__ == [f"called in {tmp_path / 'kernel.py'}:{FIRST}"]


def test_an_entry_returns_no_array(tmp_path: Path) -> None:
    with pytest.raises(TranslationError):
        translate([(kernel_of("return a", tmp_path), TYPES, "entry")])


@pytest.mark.parametrize(("given", "expected"), [(NONE, "1.0"), (Scalar.INT, "2.0")])
def test_none_is_decided_by_the_type(given: Type, expected: str, tmp_path: Path) -> None:
    kernel = kernel_of("a[0] = 1.0 if n is None else 2.0", tmp_path)
    text = translate([(kernel, (F1, F2, given, plain_tuple()), "entry")])
    assert f"AT1(a, 0) = {expected};" in text


def test_a_function_is_emitted_once_for_each_set_of_types(tmp_path: Path) -> None:
    kernel = kernel_of("helper(a, n)\nhelper(a, 2)\nhelper(b[0], 1)\nhelper(b[:, 0], 1)", tmp_path)
    text = translate([(kernel, TYPES, "entry")])
    heads = re.findall(r"static void (kernel_helper\w*)\((\w+) a", text)
    assert heads == [("kernel_helper", "Float1"), ("kernel_helper_2", "Float1View")]


def test_the_command_prints_its_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([]) == 2
    assert "OUT.c" in capsys.readouterr().err
