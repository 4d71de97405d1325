"""All entries of the package are translated to C, compiled, and run without errors of sanitizers."""

from __future__ import annotations

import ast
import ctypes
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import sagline as sl
from sagline.kernels.algebra.functions import sinhc_polynomial
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.plain import plain
from tests.tiers import extended
from tests.translate import inputs
from tests.translate.library import Entry, compiled_c, copied, library_of
from tests.translate.recorded import recorded
from tools.translate import __main__ as command
from tools.translate.program import definition
from tools.translate.signatures import MEMORY, SIGNATURES, functions
from tools.translate.types import ArrayType, Element, Scalar, Type

KINDS = {"Array": Element.FLOAT, "Indices": Element.INT, "Codes": Element.BYTE, "Flags": Element.FLAG}
SCALARS = {"int": Scalar.INT, "float": Scalar.FLOAT, "bool": Scalar.BOOL}


def test_declarations_and_entries_agree() -> None:
    assert set(SIGNATURES) == set(functions()), "renew tools/translate/signatures.py"


@pytest.mark.parametrize("name", sorted(SIGNATURES))
def test_declared_types_agree_with_the_annotations(name: str) -> None:
    parameters = definition(functions()[name]).args.args
    for types in SIGNATURES[name].values():
        for parameter, type_ in zip(parameters, types, strict=True):
            assert parameter.annotation is not None
            assert agrees(parameter.annotation, type_), parameter.arg


def agrees(annotation: ast.expr, type_: Type) -> bool:
    """True if a type agrees with the annotation of a number or an array; for tuples, the number of items."""
    text = ast.unparse(annotation)
    if text in KINDS:
        return isinstance(type_, ArrayType) and type_.element is KINDS[text]
    if text in SCALARS:
        return type_ is SCALARS[text]
    if text.startswith("tuple["):
        assert isinstance(annotation, ast.Subscript)
        inner = annotation.slice.elts if isinstance(annotation.slice, ast.Tuple) else [annotation.slice]
        return len(inner) == len(getattr(type_, "types", ()))
    return True


@pytest.mark.parametrize("function", [sinhc_polynomial, functions()["inverse_poses"]])
def test_a_kernel_of_the_back_end_python_has_the_same_definition(function: Any) -> None:
    own = getattr(function, "py_func", function)
    assert ast.dump(definition(plain(own))) == ast.dump(definition(own))


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    out = tmp_path_factory.mktemp("text") / "kernels.c"
    assert command.main([str(out)]) == 0
    return out.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def library(text: str, tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return compiled_c(text, tmp_path_factory.mktemp("library"))


@extended
def test_a_second_translation_is_identical(text: str, tmp_path: Path) -> None:
    assert command.main([str(tmp_path / "again.c")]) == 0
    assert (tmp_path / "again.c").read_text(encoding="utf-8") == text


@extended
def test_too_little_memory_is_an_error_of_numba_and_a_code_of_c(library: ctypes.CDLL) -> None:
    with recorded() as calls:
        sl.inverse(sl.load_robot("cogiro"), sl.Pose.from_euler([0.2, -0.4, 2.4], 0, 0, 0))
    call = calls[0]
    place = call.types.index(MEMORY)
    numbers, counters = call.before[place]
    small = (*call.before[:place], (numbers[:50].copy(), counters), *call.before[place + 1 :])
    with pytest.raises(ValueError, match="size"):
        inverse_poses(*copied(small))
    assert Entry(library, call.symbol, call.types).code(*copied(small)) == (1, None)


@extended
def test_sanitizers_find_no_error(text: str, tmp_path: Path) -> None:
    source, pickled = tmp_path / "kernels.c", tmp_path / "calls"
    source.write_text(text, encoding="utf-8")
    with recorded() as calls:
        for name in ("cogiro", "article-mixed", "ipanema-3-pulleys"):
            inputs.preset(name)
        inputs.entries()
        inputs.corner_cases()
    pickled.write_bytes(pickle.dumps([(call.symbol, call.types, call.returned, call.before) for call in calls]))
    library = library_of(source, "-O1", "-g", "-DSL_CHECK", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    runtime = subprocess.run(["gcc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=True)
    environment = {**os.environ, "LD_PRELOAD": runtime.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0"}
    command = [sys.executable, "-m", "tests.translate.replay", str(library), str(pickled)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert done.returncode == 0, done.stderr[-3000:]
