"""Links and servers with bad arguments: one line, before any connection."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import pytest

import sagline as sl
from tests.abuse.bad_values import REFUSED, Bad, bad_values
from tests.plc.servers import unused_address
from tests.refusal import refused as expected
from tests.tiers import extended

pytestmark = extended

ROBOT = sl.load_robot("article-prototype")
VALID: dict[str, tuple[str, Any, bool]] = {
    "robot": ("one", ROBOT, False),
    "timeout": ("number", 2.0, False),
    "device": ("whole", 1, False),
    "machine": ("one", sl.twin.Machine, False),
    "port": ("whole", 0, False),
}


def refused(call: Callable[..., Any], name: str, expected: type[Exception] | None, **others: Any) -> Iterator[str]:
    """Errors in the refusals of bad values of an argument."""
    kind, valid, optional = VALID[name]
    for bad in bad_values(kind, valid, optional):
        if problem := _problem(call, {**others, name: bad.value}, bad, expected):
            yield f"{name} = {bad.label}: {problem}"


def _problem(call: Callable[..., Any], arguments: dict[str, Any], bad: Bad, expected: type[Exception] | None) -> str:
    try:
        call(**arguments)
    except sl.SaglineError as error:
        if expected is None or not isinstance(error, expected):
            return "" if len(str(error)) < 300 and str(error).isprintable() else "a long line"
    except Exception as error:
        return repr(error)
    return "taken" if bad.verdict is REFUSED else ""


@pytest.mark.parametrize("kind", [sl.plc.S7Link, sl.plc.ModbusLink])
def test_links_refuse_bad_arguments_in_one_line_first(kind: Callable[..., Any]) -> None:
    given: dict[str, Any] = {"addresses": [unused_address() for _ in range(4)], "robot": ROBOT}
    names = ("robot", "timeout", *(("device",) if kind is sl.plc.ModbusLink else ()))
    for name in names:
        others = {key: value for key, value in given.items() if key != name}
        assert list(refused(kind, name, sl.plc.LinkError, **others)) == []


def test_a_server_refuses_bad_arguments_in_one_line() -> None:
    machine = sl.twin.Machine(ROBOT)

    def served(**arguments: Any) -> None:
        with closing(sl.twin.Server(**arguments)):
            pass

    assert list(refused(served, "port", None, machine=machine)) == []
    for arguments in (
        {"host": 5},
        {"host": "a b"},
        {"host": "\0"},
        {"host": "x" * 300},
        {"modbus": 1},
        {"port": 65534},
    ):
        with pytest.raises(sl.SaglineError) as caught:
            served(machine=machine, **arguments)
        assert len(str(caught.value)) < 300
    with expected("machine", kind=sl.InvalidValueError):
        served(machine=ROBOT)
