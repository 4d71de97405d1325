"""Data that a link sends and receives over real sockets, for all protocols."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sagline.control import Mode, Sample
from sagline.plc import block_link
from sagline.plc.block_link import BlockLink, _GroupThread
from sagline.plc.blocks import CLAIM, FROM_PLC, TO_PLC, Block
from sagline.plc.modbus_link import _ModbusWire
from sagline.plc.s7_link import _S7Wire
from sagline.plc.wire import WireError
from tests.control.protocol import OWNER_TIMEOUT
from tests.plc.protocol import Refusal
from tests.plc.samples import (
    a_command,
    a_sample,
    bad,
    foreign,
    of_another_group,
    of_another_version,
    older,
    repeated,
    sample_blocks,
    status,
    torn,
)
from tests.plc.servers import BOTH, OWNER, PATIENCE, S7, Kind, linked, plcs, taken, until
from tests.tiers import extended, wide


@pytest.mark.parametrize("kind", BOTH)
def test_a_sample_is_received(kind: Kind) -> None:
    sample = status(7)
    with plcs(kind, sample) as servers, linked(kind, servers) as link:
        got = taken(link)
        assert link.groups == ((0, 1), (2, 3), (4, 5), (6, 7))
    np.testing.assert_array_equal(got.length, sample.length)
    np.testing.assert_array_equal(got.counter, np.full(4, 7))
    assert np.all((got.age > 0.0) & (got.age < PATIENCE))


@extended
@pytest.mark.parametrize("kind", BOTH)
def test_a_group_without_our_grant_gets_only_the_claim(kind: Kind) -> None:
    with plcs(kind, status(1, owner=99)) as servers, linked(kind, servers) as link:
        link.exchange(a_command(8, owner=OWNER))
        written: list[tuple[bytes, bytes]] = [(b"", b"")] * 4

        def claimed() -> bool:
            written[:] = [
                (w[0], w[1] if any(w[1]) else old[1]) for w, old in zip(servers.written(), written, strict=True)
            ]
            return all(claim for _, claim in written)

        until(claimed)
        for command, claim in written:
            assert CLAIM.read(claim) == {"magic": CLAIM.magic, "owner": OWNER}
            assert not any(command)


@pytest.mark.parametrize("kind", wide(reversed(BOTH)))
def test_a_group_with_our_grant_gets_the_command(kind: Kind) -> None:
    command = a_command(8, owner=OWNER)
    with plcs(kind, status(1, owner=OWNER)) as servers, linked(kind, servers) as link:
        link.exchange(command)
        until(lambda: all(any(command) for command, _ in servers.written()))
        for i, (block, claim) in enumerate(servers.written()):
            values = TO_PLC.read(block)
            assert not isinstance(values, Refusal)
            assert (values["counter"], values["mode"], values["owner"]) == (command.counter, Mode.FOLLOW, OWNER)
            assert [values[f"winch[{k}].length"] for k in (1, 2)] == command.length[2 * i : 2 * i + 2].tolist()
            assert not any(claim)


@extended
@pytest.mark.parametrize("kind", BOTH)
def test_the_last_command_is_written_before_the_link_closes(kind: Kind) -> None:
    owners = np.array([OWNER, 0, 99, OWNER])
    with plcs(kind, a_sample(8, owner=owners)) as servers:
        with linked(kind, servers) as link:
            link.exchange(a_command(8, owner=OWNER, mode=Mode.LEAVE))
        written = servers.written()
    assert [any(command) for command, _ in written] == [True, False, False, True]
    assert not any(any(claim) for _, claim in written)


@extended
@pytest.mark.parametrize("kind", BOTH)
def test_a_reading_link_writes_nothing(kind: Kind) -> None:
    with plcs(kind, status(1, owner=OWNER)) as servers, linked(kind, servers) as link:
        for counter in (2, 3):
            servers.publish(sample_blocks(status(counter)))
            until(lambda counter=counter: np.all(taken(link).counter == counter))  # type: ignore[misc]
        assert not any(any(command) or any(claim) for command, claim in servers.written())


def next_discarded(link: BlockLink, group: int) -> Sample:
    """The next sample with one more discarded block of a group."""
    before = taken(link).discarded[group]
    until(lambda: taken(link).discarded[group] > before)
    return taken(link)


NO_NEWS: list[tuple[Callable[[bytearray], None], str]] = [
    (torn, "is torn"),
    (foreign, "program"),
    (of_another_version, "layout 3"),
    (of_another_group, "group 0"),
    (repeated, "repeated"),
    (older, "9 after 10"),
]


@pytest.mark.parametrize(("spoil", "reason"), wide(NO_NEWS))
def test_a_repeated_block_is_counted_with_its_reason_and_ages(spoil: Callable[[bytearray], None], reason: str) -> None:
    with plcs(S7, status(10)) as servers, linked(S7, servers) as link:
        servers.publish(bad(11, spoil))
        sample = next_discarded(link, 2)
        found = sample.reasons[2]
        assert found is not None
        assert reason in found.reason
        assert found.next_step not in ("", found.reason)
        until(lambda: np.all(taken(link).counter == [11, 11, 10, 11]))
        assert taken(link).age[2] >= sample.age[2]
        np.testing.assert_array_equal(taken(link).length[4:6], status(10).length[4:6])
        servers.publish(sample_blocks(status(12)))
        until(lambda: np.all(taken(link).counter == 12))


@extended
def test_counters_wrap_around() -> None:
    with plcs(S7, status(2**31 - 1)) as servers, linked(S7, servers) as link:
        servers.publish(sample_blocks(status(1)))
        until(lambda: np.all(taken(link).counter == 1))


@extended
def test_a_restarted_plc_is_accepted_after_a_silence_and_a_stopped_one_never() -> None:
    with plcs(S7, status(1000)) as servers, linked(S7, servers) as link:
        servers.publish([*sample_blocks(status(1))[:3], sample_blocks(status(1000))[3]])
        until(lambda: np.all(taken(link).counter[:3] == 1))
        sample = taken(link)
        assert sample.counter[3] == 1000
        assert sample.age[3] > 0.4


@pytest.mark.parametrize(("late", "written"), [(0.05, [b"command"]), (0.15, [])])
def test_commands_that_wait_too_long_are_discarded(late: float, written: list[bytes]) -> None:
    class Wire:
        def __init__(self) -> None:
            self.written: list[bytes] = []

        def open(self) -> None:
            clock[0] = late

        def write(self, block: Block, data: bytes) -> None:
            self.written.append(data)

        def read(self, block: Block) -> bytes:
            return b""

        def close(self) -> None:
            pass

        abort = close

        def reached(self) -> bool:
            return True

    clock, wire = [0.0], Wire()
    group = _GroupThread(1, 2, wire, lambda: clock[0])
    group.hand_over(TO_PLC, b"command")
    group.start()
    group.settled.wait(PATIENCE)
    group.finish()
    group.join(PATIENCE)
    assert wire.written == written


class Scripted:
    """A connection that returns given answers or raises given errors, and the state of its group; in one thread."""

    def __init__(self, *answers: bytes | Exception, step: float = 0.01) -> None:
        self.answers, self.time, self.step = list(answers), 0.0, step
        self.group = _GroupThread(0, 2, self, self.clock)
        self.counters, self.troubles = list[int | None](), list[str]()

    def clock(self) -> float:
        self.time += self.step
        return self.time

    def open(self) -> None:
        pass

    def write(self, block: Block, data: bytes) -> None:
        pass

    def read(self, block: Block) -> bytes:
        newest, trouble = self.group.newest, self.group.trouble
        self.counters.append(None if newest is None else newest.values["counter"])
        self.troubles.append("" if trouble is None else trouble.reason)
        self.group.ask()
        if not self.answers:
            self.group.finish()
            return b""
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        pass

    abort = close

    def reached(self) -> bool:
        return True


def counters_and_reasons(*answers: bytes | Exception) -> tuple[list[int | None], list[str]]:
    """Counters of the newest block of group 0 after each answer, with the reasons of discarded blocks."""
    wire = Scripted(*answers)
    wire.group.run()
    return wire.counters[1:], wire.troubles[1:]


def block(counter: int) -> bytes:
    return sample_blocks(status(counter))[0]


@pytest.mark.parametrize("error", [struct.error("short"), AttributeError("recv"), AssertionError(), OSError("gone")])
def test_a_group_continues_after_any_error_with_the_reason(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(block_link, "RETRY", 0.0)
    counters, troubles = counters_and_reasons(block(7), error, block(8))
    assert counters == [7, 7, 8]
    assert (troubles[0], troubles[2]) == ("", "")
    assert f"{type(error).__name__} ({error})" in troubles[1]


def test_a_restarted_plc_is_accepted_at_once_with_a_new_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(block_link, "RETRY", 0.0)
    gone = WireError(Refusal("the PLC closes the connection at once", "Check it"))
    assert counters_and_reasons(block(1000), gone, block(1), block(2))[0] == [1000, 1000, 1, 2]
    assert counters_and_reasons(block(1000), block(1), block(2))[0] == [1000, 1000, 1000]


def test_a_lower_counter_is_accepted_after_silence_and_an_equal_one_never() -> None:
    wire = Scripted(block(1000), block(1000), block(1), step=OWNER_TIMEOUT)
    wire.group.run()
    assert wire.counters[1:] == [1000, 1000, 1]
    assert wire.group.discarded == 2  # the equal one, and the empty block at the end


class Broken:
    """A client of a library that raises an unexpected exception."""

    def __init__(self, error: Exception) -> None:
        self._error = error

    def __getattr__(self, name: str) -> Any:
        def fail(*_: Any, **__: Any) -> None:
            raise self._error

        return fail


@pytest.mark.parametrize("error", [struct.error("short"), AttributeError("recv"), AssertionError()])
def test_errors_of_a_library_are_reported_as_connection_errors(error: Exception) -> None:
    for wire in (_S7Wire("127.0.0.1", 102), _ModbusWire("127.0.0.1", 502, 1)):
        vars(wire)["_client"] = Broken(error)
        with pytest.raises(WireError, match=r"(S7|Modbus)"):
            wire.read(FROM_PLC)
        with pytest.raises(WireError, match=r"(S7|Modbus)"):
            wire.write(CLAIM, bytes(8))
        wire.close()


def test_a_missing_connection_is_reported() -> None:
    with pytest.raises(WireError, match=r"connection .*closed"):
        _S7Wire("127.0.0.1", 102).read(FROM_PLC)
