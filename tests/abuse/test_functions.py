"""Each argument of each public function, class and method, replaced by invalid values.

The result is a `SaglineError` with one short line, or correct. No other exception, no warning and no delay occurs.
"""

from __future__ import annotations

import copy
import pickle
import resource
import time
import warnings
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

import attrs
import numpy as np
import pytest

import sagline as sl
from sagline.core.errors import printable
from tests.abuse.bad_values import REFUSED, SAME, Bad, bad_values
from tests.abuse.calls import INTERNAL, LINKS, Call, arguments_of, calls, public_names
from tests.effort import least_seconds
from tests.tiers import extended

pytestmark = extended

SLOWEST = 2.0  # s of processor time of an ordinary machine
LONGEST = 300  # characters
MOST_MEMORY = 500_000  # kB
SHARE = 0.05  # share of the cases in an ordinary run; a long run tests all
SEED = 20260310
REAL = "fiubU"  # kinds of numbers and texts
WITH_PHASES = (sl.dynamic_stiffness, sl.frequency_response)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Call]:
    return calls(tmp_path_factory.mktemp("functions"))


@pytest.fixture(scope="module")
def answers(table: dict[str, Call]) -> dict[str, Any]:
    """Result of each call with valid arguments, computed once."""
    return {name: call.with_replaced("", None) for name, call in table.items()}


def test_every_public_callable_is_in_the_table(table: dict[str, Call]) -> None:
    assert {name.split(":")[0] for name in table} == public_names() - INTERNAL - LINKS


def test_every_argument_is_in_the_table(table: dict[str, Call]) -> None:
    found = []
    for name in sorted(public_names() - INTERNAL - LINKS):
        given = {argument for key, call in table.items() if key.split(":")[0] == name for argument in call.arguments}
        found += [
            f"{name}: {argument}"
            for argument in arguments_of(name)
            if not given & {argument, argument.removesuffix("s")}
        ]
    assert found == []


def test_every_call_succeeds_with_valid_arguments(answers: dict[str, Any], table: dict[str, Call]) -> None:
    assert answers.keys() == table.keys()


def test_copied_and_pickled_results_are_read_only(answers: dict[str, Any]) -> None:
    looked_at, found = 0, []
    for name, answer in answers.items():
        if not _fields(answer):
            continue
        for again in (pickle.loads(pickle.dumps(answer)), copy.deepcopy(answer)):
            assert _same(again, answer), name
            arrays = [array for array in _arrays(again) if array.ndim]
            looked_at += len(arrays)
            found += [name for array in arrays if array.flags.writeable]
    assert sorted(set(found)) == []
    assert looked_at > 500


def test_more_than_a_thousand_cases_exist(table: dict[str, Call]) -> None:
    assert sum(len(list(_cases(call))) for call in table.values()) > 1000


@pytest.mark.parametrize("share", [SHARE, pytest.param(1.0, marks=pytest.mark.soak)])
def test_invalid_arguments_are_refused_or_give_a_correct_result(
    table: dict[str, Call], answers: dict[str, Any], share: float
) -> None:
    generator, used = np.random.default_rng(SEED), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found = []
    for name, call in table.items():
        chosen = [case for case in _cases(call) if generator.random() < share]
        for argument, bad in chosen:
            if what := _fault(call, argument, bad, answers[name]):
                found.append(f"{name}({argument}={bad.label}): {what}")
    assert found == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - used < MOST_MEMORY


def _cases(call: Call) -> Iterator[tuple[str, Bad]]:
    for name, (kind, valid, optional) in call.arguments.items():
        for bad in bad_values(kind, valid, optional):
            yield name, bad


def _fault(call: Call, argument: str, bad: Bad, right: Any) -> str:
    """Error in the outcome of a call, or ""."""
    begin, error, result = time.process_time(), None, None
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            result = call.with_replaced(argument, bad.value)
        except sl.SaglineError as refusal:
            error = refusal
        except Exception as other:
            return f"{type(other).__name__}: {other}"
    seconds = time.process_time() - begin
    if said:
        return f"a warning: {said[0].message}"
    if seconds > SLOWEST:
        seconds = least_seconds(lambda: call.with_replaced(argument, bad.value), SLOWEST, seconds)
    if seconds > SLOWEST:
        return f"{seconds:.1f} s"
    if error is not None:
        return _fault_of_text(str(error)) or (f"refused: {error}" if bad.verdict == SAME else "")
    if bad.verdict == REFUSED:
        return f"answered: {result!r:.200}"
    if bad.verdict == SAME and not _same(result, right):
        return f"another answer: {result!r:.200}"
    return _fault_of_answer(result, REAL + "c" if call.function in WITH_PHASES else REAL)


def _fault_of_text(text: str) -> str:
    if len(text) >= LONGEST or text != printable(text):
        return f"{len(text)} characters: {text!r}"
    return ""


def _fault_of_answer(result: Any, kinds: str) -> str:
    """Results contain real numbers, except phases. They are finite unless a status or a proof gives the reason."""
    arrays = list(_arrays(result))
    if any(array.dtype.kind not in kinds for array in arrays):
        return "an answer of no such numbers"
    status = getattr(result, "status", np.zeros(1))
    told = np.any(np.asarray(status) != 0) if not isinstance(result, sl.Equilibria) else True
    if not told and isinstance(result, sl.Pose | sl.Path | sl.Robot | sl.Cable | sl.Winch):
        bad = [array for array in arrays if array.dtype.kind == "f" and np.isnan(array).any()]
        return f"an answer that is no number: {bad[0]}" if bad else ""
    return ""


def _fields(value: Any) -> list[str]:
    """Names of the fields of a dataclass or an attrs class; none for other types."""
    declared = attrs.fields(type(value)) if attrs.has(type(value)) else fields(value) if is_dataclass(value) else ()
    return [field.name for field in declared]


def _arrays(value: Any) -> Iterator[np.ndarray[Any, Any]]:
    if isinstance(value, np.ndarray | np.generic):
        yield np.asarray(value)
    elif names := _fields(value):
        for name in names:
            yield from _arrays(getattr(value, name))
    elif isinstance(value, tuple | list):
        for entry in value:
            yield from _arrays(entry)


def _same(one: Any, other: Any) -> bool:
    ours, theirs = list(_arrays(one)), list(_arrays(other))
    return type(one) is type(other) and len(ours) == len(theirs) and all(map(_equal, ours, theirs))


def _equal(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> bool:
    return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
