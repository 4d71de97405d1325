"""The first run: what is compiled, side by side, and what is said about it."""

import os
import signal
import subprocess
import sys
import time
from io import StringIO
from pathlib import Path as FilePath
from types import SimpleNamespace
from typing import Any

import pytest
from numba.core import event
from rich.console import Console

from sagline.cli import compilation
from sagline.cli.compilation import Stage, compilation_events, first_run_text
from sagline.cli.entries import (
    ANSWERS,
    ENTRIES,
    FIT,
    FORWARD,
    FORWARD_OVER_PULLEYS,
    INVERSE,
    LOSSES,
    MARGINS,
    MODES,
    PERIODS,
    SHARING,
    STARTING_LENGTHS,
    VIBRATION,
)
from sagline.cli.examples import examples
from sagline.cli.progress import progress_line
from sagline.kernels.forward.forward import forward_poses
from sagline.kernels.inverse.poses import inverse_poses, measure_balance
from sagline.kernels.jit import FOLDER, is_compiled
from sagline.kernels.tension.nearest import new_reference_point
from tests.cli import interrupts
from tests.tiers import extended


def process(code: str, folder: FilePath) -> "subprocess.Popen[str]":
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    return subprocess.Popen(
        [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True, preexec_fn=interrupts.heard
    )


def compiling(function: Any, types: Any = ()) -> Any:
    """As numba tells of it."""
    return event.trigger_event("numba:compile", data={"dispatcher": function, "args": types})


def test_nothing_is_told_to_be_finished_before_its_machine_code_is_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def solve(_: object) -> None:
        for function in (inverse_poses, forward_poses):
            with compiling(function, ("int64", "none")):
                pass
            print(f"{function.__name__} written")  # numba saves what it has compiled when it has told of the end

    monkeypatch.setattr(compilation, "_end_with_parent", lambda: None)
    monkeypatch.setitem(ENTRIES, INVERSE, ENTRIES[INVERSE]._replace(solve=solve))
    compilation.main([INVERSE])
    lines = [line.split("\t") for line in capsys.readouterr().out.splitlines()]
    assert [line[0] + line[-1] if len(line) > 1 else line[0] for line in lines] == [
        f"{INVERSE}0", "inverse_poses written", f"{INVERSE}1", f"{FORWARD}0", "forward_poses written", f"{FORWARD}1",
    ]  # fmt: skip


def test_an_entry_is_compiled_when_its_machine_code_is_there(
    tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sagline.kernels.jit.folder_of", lambda module: tmp_path / module.split(".")[2])
    (tmp_path / "inverse").mkdir()
    for name in ("poses.inverse_poses-35.py311.nbi", "poses.inverse_poses_too-35.py311.1.nbc", "other.nbc"):
        (tmp_path / "inverse" / name).touch()
    assert not is_compiled(inverse_poses)
    (tmp_path / "inverse" / "poses.inverse_poses-35.py311.1.nbc").touch()
    assert is_compiled(inverse_poses)
    assert not is_compiled(inverse_poses, 2)
    assert compilation.not_compiled([INVERSE, SHARING, FORWARD]) == [SHARING, FORWARD]


def test_every_entry_names_a_compiled_function() -> None:
    for entry in ENTRIES.values():
        assert callable(entry.function)
        assert entry.function.__module__.startswith("sagline.kernels.")
    assert ENTRIES[INVERSE].function is inverse_poses


def test_two_cores_share_the_work_and_second_versions_follow_their_first() -> None:
    assert compilation.split_entries([FORWARD, INVERSE]) in (([INVERSE], [FORWARD]), ([FORWARD], [INVERSE]))
    here, beside = compilation.split_entries([SHARING, VIBRATION, INVERSE, MARGINS])
    assert here == [SHARING, INVERSE]
    assert sorted(beside) == sorted([VIBRATION, MARGINS])
    assert compilation.split_entries([MARGINS]) == ([MARGINS], [])
    assert compilation.split_entries([FORWARD_OVER_PULLEYS, INVERSE]) == (
        [FORWARD_OVER_PULLEYS],
        [INVERSE],
    )  # its first is here
    assert compilation.split_entries([ANSWERS, INVERSE]) == ([ANSWERS], [INVERSE])
    assert compilation.split_entries([MODES, ANSWERS, INVERSE]) == ([MODES, ANSWERS], [INVERSE])  # where vibration is
    assert compilation.split_entries([MARGINS, VIBRATION, MODES]) == ([VIBRATION, MODES], [MARGINS])
    here, beside = compilation.split_entries(tuple(ENTRIES))
    assert sorted(here + beside) == sorted(ENTRIES)
    for entry in ENTRIES.values():
        (share,) = [each for each in (here, beside) if entry.words in each]
        if entry.after is not None:
            assert share.index(entry.after) < share.index(entry.words)
    times = [sum(ENTRIES[name].seconds for name in each) for each in (here, beside)]
    assert times[0] == pytest.approx(times[1], rel=0.2)


COMPILED_FOR = """
import os
import sys
import sagline
from sagline.cli.entries import ENTRIES

paths = {entry.path: entry.function for entry in ENTRIES.values()}  # of all: a fork has them at once
for words in sys.argv[1:]:
    print(words, end="", flush=True)
    if os.fork() == 0:
        ENTRIES[words].compile()
        print("", *(path for path, each in paths.items() if each.overloads), sep="\\t", flush=True)
        os._exit(0)
    assert os.wait()[1] == 0
"""


@extended
@pytest.mark.skipif(not hasattr(os, "fork"), reason="asks processes that begin with nothing loaded")
@pytest.mark.parametrize("names", [[LOSSES, PERIODS], pytest.param(list(ENTRIES), marks=pytest.mark.soak)])
def test_no_entry_is_compiled_for_one_that_does_not_come_after_it(names: list[str]) -> None:
    """Else two processes would compile the same."""
    code = [sys.executable, "-c", COMPILED_FOR, *names]
    lines = subprocess.run(code, capture_output=True, text=True, check=True).stdout.splitlines()
    found = {words: set(paths) for words, *paths in (line.split("\t") for line in lines)}
    assert list(found) == names
    for words in names:
        paths, after = {ENTRIES[words].path}, ENTRIES[words].after
        while after is not None:
            paths.add(ENTRIES[after].path)
            after = ENTRIES[after].after
        assert found[words] - {ENTRIES[ANSWERS].path} == paths - {ENTRIES[ANSWERS].path}, words


def test_what_is_compiled_is_named_and_counted() -> None:
    stages: list[Stage] = []
    with compilation_events(stages.append), compiling(inverse_poses, ("int64", "none")):
        with compiling(measure_balance), compiling(new_reference_point):
            pass
        with compiling(SimpleNamespace(py_func=os.getcwd)):  # numba's own are not counted
            pass
    assert [(stage.words, stage.done, stage.finished) for stage in stages] == [
        (INVERSE, 0, False), (INVERSE, 1, False), (INVERSE, 2, False), (INVERSE, 3, True),
    ]  # fmt: skip
    stages.clear()
    with compilation_events(stages.append), compiling(inverse_poses, ("int64", "bool")):
        pass
    assert stages[-1].words == SHARING
    stages.clear()
    with compilation_events(stages.append), compiling(forward_poses, ("Tuple(int64, float64, float64, none)", "bool")):
        pass
    assert stages[-1].words == FORWARD
    with compilation_events(stages.append), compiling(forward_poses, ("Tuple(int64, float64, float64, bool)", "bool")):
        pass
    assert stages[-1].words == FORWARD_OVER_PULLEYS
    with compilation_events(stages.append), compiling(measure_balance):
        pass
    assert stages[-1].words == "measure balance"
    with compiling(inverse_poses):
        pass
    assert len(stages) == 6  # nobody listens any more


def test_the_line_says_how_far_it_is(snapshot: Any) -> None:
    assert first_run_text([Stage("a", 0, 9), Stage("b", 0, 0)]) == snapshot(name="beginning")
    assert first_run_text([Stage("a", 3, 9), Stage("b", 12, 9)]) == snapshot(name="counts")


def test_in_a_file_each_entry_is_told_once(snapshot: Any) -> None:
    text = StringIO()
    with progress_line(Console(file=text), "working") as line:
        for done in range(3):
            line.show_compilation(Stage("one", done, 3, done == 2))
            line.show_compilation(Stage("other", done, 3, done == 2))
        line.progress(1, 2)
    assert text.getvalue() == snapshot


def test_on_a_terminal_the_line_lives() -> None:
    text = StringIO()
    with progress_line(Console(file=text, force_terminal=True, width=100), "working") as line:
        line.show_compilation(Stage("one", 31, 42))
        line._bar.refresh()
        line.show_compilation(Stage("one", 42, 42, finished=True))
        line._bar.refresh()
        line.progress(1, 10)
        line._bar.refresh()
        soon = text.getvalue()
        line._bar.tasks[0].start_time = time.monotonic() - 60.0
        line.progress(5, 10)
        line._bar.refresh()
    assert " one 31 of 42 " in soon
    assert "working" in soon.rpartition("kernels")[2]
    assert "━" not in soon
    assert "━" in text.getvalue()[len(soon) :]


class Counted:
    """An entry that only counts."""

    after = None

    def __init__(self, words: str, seconds: float) -> None:
        self.words, self.path, self.seconds = words, words, seconds
        self.is_compiled = False

    def compile(self) -> None:
        self.is_compiled = True


def test_without_the_other_process_all_is_compiled_here(monkeypatch: pytest.MonkeyPatch, tmp_path: FilePath) -> None:
    monkeypatch.setattr("sagline.kernels.jit.FOLDER", tmp_path / "kernels")
    for program in ("/bin/false", str(tmp_path / "missing")):
        entries = {name: Counted(name, 1.0) for name in "abc"}
        monkeypatch.setattr(compilation, "ENTRIES", entries)
        monkeypatch.setattr(compilation, "available_cores", lambda: 2)
        monkeypatch.setattr(sys, "executable", program)
        compilation.compile_all("abc", lambda stage: None)
        assert all(entry.is_compiled for entry in entries.values())
        assert os.listdir(tmp_path) == []


def test_on_one_core_no_other_process_is_started(monkeypatch: pytest.MonkeyPatch) -> None:
    entries = {name: Counted(name, 1.0) for name in "abc"}
    monkeypatch.setattr(compilation, "ENTRIES", entries)
    monkeypatch.setattr(compilation, "available_cores", lambda: 1)
    monkeypatch.setattr(compilation, "CompilerProcess", None)
    compilation.compile_all("abc", lambda stage: None)
    assert all(entry.is_compiled for entry in entries.values())


COMPILE = """
import sys
from sagline.cli import compilation
from sagline.cli.compilation import compilation_events
compilation.available_cores = lambda: 2
def say(stage):
    row = stage.words, stage.done, stage.expected, int(stage.finished)
    sys.stdout.write("\\t".join(map(str, row)) + "\\n")  # one write: two threads report
    sys.stdout.flush()
with compilation_events(say):
    compilation.compile_all(sys.argv[1:] or {names!r}, say)
"""


@extended
def test_two_processes_compile_what_this_one_then_loads(tmp_path: FilePath) -> None:
    names = [FIT, STARTING_LENGTHS]
    code = COMPILE.format(names=names)
    first, second = (process(code, tmp_path).communicate(timeout=600)[0] for _ in range(2))
    assert second == ""  # nothing is compiled twice
    assert [path.name for path in tmp_path.iterdir()] == [FOLDER.name]
    ends = [line.split("\t") for line in first.splitlines() if line.endswith("\t1")]
    assert sorted(words for words, *_ in ends) == sorted(names)
    for words, done, expected, _ in ends:
        assert int(done) == pytest.approx(int(expected), rel=0.25), words


@pytest.mark.soak
@pytest.mark.parametrize("name", [name for name in ENTRIES if name not in (FIT, STARTING_LENGTHS)])
def test_as_many_kernels_are_compiled_as_the_table_says(name: str, tmp_path: FilePath) -> None:
    said, _ = process(COMPILE.format(names=[name]), tmp_path).communicate(timeout=900)
    ends = {line.split("\t")[0]: line.split("\t")[1:] for line in said.splitlines() if line.endswith("\t1")}
    done, expected, _ = ends[name]
    assert int(done) == pytest.approx(int(expected), rel=0.25)


def is_running(pid: str) -> bool:
    """Whether a process is there, and not only what is left of it until somebody asks how it ended."""
    try:
        return FilePath(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@extended
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
@pytest.mark.parametrize("way", [signal.SIGINT, signal.SIGKILL])
def test_however_the_command_ends_the_other_process_ends_too(way: signal.Signals, tmp_path: FilePath) -> None:
    parent = process(COMPILE.format(names=[INVERSE, FORWARD]), tmp_path)
    children = FilePath(f"/proc/{parent.pid}/task/{parent.pid}/children")
    while not (found := children.read_text().split()):
        assert parent.poll() is None
        time.sleep(0.02)
    (child,) = found
    assert parent.stdout is not None
    parent.stdout.readline()  # compiling
    parent.send_signal(way)
    assert parent.wait(timeout=60.0) != 0
    parent.stdout.close()
    end = time.monotonic() + 180.0  # it notices between two kernels, which may take long on a busy machine
    while is_running(child) or any(tmp_path.glob("compiling-*")):
        assert time.monotonic() < end, "the other process is still there"
        time.sleep(0.05)


WATCHED = """
import sys
from numba.core import dispatcher, event
from sagline.cli.main import app
from typer.testing import CliRunner

silent = []
load = dispatcher.Dispatcher.compile

def watched(self, signature):
    heard = event._registered["numba:compile"]
    if self.py_func.__module__.startswith("sagline.") and not heard:
        silent.append(self.py_func.__module__ + "." + self.py_func.__name__)
    return load(self, signature)

dispatcher.Dispatcher.compile = watched
result = CliRunner().invoke(app, sys.argv[1:], input="\\n" * 9)
assert result.exit_code == 0, result.output
print(*silent, sep="\\n", end="")
"""


@extended
@pytest.mark.parametrize(
    "words",
    [
        ("tension", "cogiro", "--out", "out"),
        ("new", "my_robot.yaml"),
        ("convert", "cogiro", "--format", "mjcf"),
        pytest.param(("track", "cogiro", "own_path.yaml"), marks=pytest.mark.soak),
        pytest.param(("forward", "cogiro", "lengths.csv"), marks=pytest.mark.soak),
        pytest.param(("identify", "cable.csv"), marks=pytest.mark.soak),
        pytest.param(("article", "figures", "3-7"), marks=pytest.mark.soak),
    ],
    ids=" ".join,
)
def test_whatever_a_command_compiles_is_told(words: tuple[str, ...], tmp_path: FilePath) -> None:
    """Each kernel is loaded, or compiled where it is not there yet, while somebody listens who would say so."""
    examples(tmp_path, force=False)
    done = subprocess.run([sys.executable, "-c", WATCHED, *words], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
