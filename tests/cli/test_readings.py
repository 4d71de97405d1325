"""The first run of the viewer: what comes when."""

import threading
from collections.abc import Callable, Iterator
from typing import ClassVar

import pytest

from sagline.cli import hosting as module
from sagline.cli.compilation import Stage
from sagline.cli.entries import MARGINS, POLYGON, VIBRATION
from sagline.cli.hosting import ENTRY_OF, ORDER, CompiledReadings
from sagline.viewer.feature import Computation


class Watched:
    """Stands for a viewer."""

    def __init__(self) -> None:
        self.shown = threading.Event()
        self.refreshed = 0

    def refresh(self) -> None:
        self.refreshed += 1

    def wait(self, what: str) -> None:
        raise AssertionError(what)


class FakeSide:
    """Says what it is told to; ends when it is killed."""

    said: ClassVar[Callable[[], Iterator[Stage]]]
    started: ClassVar[list[list[str]]]

    def __init__(self, names: list[str]) -> None:
        self.started.append(list(names))
        self.moved = 0

    def __enter__(self) -> "FakeSide":
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def kill(self) -> None:
        pass

    def move_kernels(self) -> None:
        self.moved += 1

    def stages(self) -> Iterator[Stage]:
        yield from type(self).said()


@pytest.fixture
def side(monkeypatch: pytest.MonkeyPatch) -> type[FakeSide]:
    monkeypatch.setattr(FakeSide, "started", [], raising=False)
    monkeypatch.setattr(module, "CompilerProcess", FakeSide)
    monkeypatch.setattr(module, "available_cores", lambda: 2)
    return FakeSide


def test_readings_come_one_after_the_other(side: type[FakeSide], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "not_compiled", lambda names: [MARGINS, POLYGON])
    steps, viewer = threading.Semaphore(0), Watched()

    def said() -> Iterator[Stage]:
        for name in (MARGINS, POLYGON):
            yield Stage(name, 1, 2)
            steps.acquire()
            yield Stage(name, 2, 2, finished=True)

    monkeypatch.setattr(side, "said", said, raising=False)
    readings, others = CompiledReadings(), [True] * (len(Computation) - 2)
    assert [readings.ready(each) for each in Computation] == [False, False, *others]
    with readings.compiled_for(viewer):  # type: ignore[arg-type]
        for count, expected in ((1, [True, False, *others]), (2, [True, True, *others])):
            steps.release()
            while viewer.refreshed < count:
                threading.Event().wait(0.001)
            assert [readings.ready(each) for each in Computation] == expected
    assert side.started == [[MARGINS, POLYGON]]
    assert not readings.missing


def test_if_the_other_process_fails_they_come_all_the_same(
    side: type[FakeSide], monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: list[str] = []
    entries = {
        name: type("Entry", (), {"compile": lambda self, name=name: compiled.append(name)})()
        for name in (MARGINS, VIBRATION)
    }
    monkeypatch.setattr(module, "ENTRIES", entries)
    monkeypatch.setattr(module, "not_compiled", lambda names: [MARGINS, VIBRATION])
    monkeypatch.setattr(side, "said", lambda: iter(()), raising=False)
    readings, viewer = CompiledReadings(), Watched()
    with readings.compiled_for(viewer):  # type: ignore[arg-type]
        while viewer.refreshed < 2:
            threading.Event().wait(0.001)
    assert compiled == [MARGINS, VIBRATION]
    assert not readings.missing


def test_warm_nothing_is_started(side: type[FakeSide], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "not_compiled", lambda names: [])
    readings = CompiledReadings()
    with readings.compiled_for(Watched()):  # type: ignore[arg-type]
        pass
    assert side.started == []
    assert all(readings.ready(each) for each in Computation)
    assert {ENTRY_OF[each.name] for each in Computation} < set(ORDER)


def test_on_one_core_the_cables_come_first(side: type[FakeSide], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "available_cores", lambda: 1)
    monkeypatch.setattr(module, "not_compiled", lambda names: [MARGINS])
    monkeypatch.setattr(side, "said", lambda: iter([Stage(MARGINS, 1, 1, finished=True)]), raising=False)
    viewer = Watched()
    with CompiledReadings().compiled_for(viewer):  # type: ignore[arg-type]
        threading.Event().wait(0.3)
        assert side.started == []
        viewer.shown.set()
        while not viewer.refreshed:
            threading.Event().wait(0.001)
    assert side.started == [[MARGINS]]
