"""The inputs of the table give the same numbers, to the last bit, with every back end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.tiers import extended
from tests.translate.backends import all_backends
from tests.translate.inputs import CORNERS, TABLE
from tests.translate.library import copied
from tests.translate.recorded import Run, compare, difference, from_kernels, from_wasm, load_callers, recorded
from tools.translate import wasm
from tools.translate.signatures import CHAIN, FOUND, MEMORY, entries

LIMIT = 1e-12  # of WebAssembly, relative for numbers above 1
FORWARD_LIMIT = 1e-9  # a solution has a residual up to 1e-10 N, which depends on the last digits


@pytest.fixture(scope="module")
def python() -> Run:
    load_callers()
    return from_kernels("python")


@pytest.fixture(scope="module")
def backends(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Run]:
    return all_backends(tmp_path_factory.mktemp("library"))


def assert_equal(found: dict[Any, Any]) -> None:
    assert {key: each for key, each in found.items() if each.different} == {}
    assert sum(each.compared for each in found.values()) > 50


@pytest.mark.parametrize("corner", CORNERS)
def test_corner_cases_are_equal_in_python(corner: str, python: Run) -> None:
    assert_equal(compare(CORNERS[corner], {"python": python}))


@extended
@pytest.mark.parametrize("inputs", TABLE)
def test_the_table_is_equal_in_all_back_ends(inputs: str, backends: dict[str, Run]) -> None:
    found = compare(TABLE[inputs], backends)
    assert_equal(found)
    if inputs == "entries":
        assert set(found) == {(backend, symbol) for backend in backends for _, _, symbol in entries()}


@extended
@pytest.mark.parametrize("inputs", ["corner cases", "entries", "cogiro", "ipanema-3-pulleys"])
def test_webassembly_differs_by_the_digits_of_its_mathematical_functions(inputs: str, tmp_path: Path) -> None:
    run, reached = from_wasm(tmp_path), set[str]()
    with recorded() as calls:
        TABLE[inputs]()
    for call in calls:
        name = call.symbol.removeprefix(wasm.PREFIX)
        if name not in wasm.ENTRIES:
            continue
        reached.add(name)
        arguments = copied(call.before)
        run(call, arguments)
        for type_, *values in zip(call.types, call.before, call.after, arguments, strict=True):
            if type_ not in (MEMORY, CHAIN):  # work arrays
                assert difference(*values).largest <= (FORWARD_LIMIT if type_ == FOUND else LIMIT), name
            if type_ == FOUND:
                assert difference(*(each[0] for each in values)).largest <= LIMIT, name  # poses
    assert inputs != "entries" or reached == set(wasm.ENTRIES)
