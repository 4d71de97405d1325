"""End of the command after an error: one line, an exit code, and no other output."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from io import BytesIO, StringIO, TextIOWrapper
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.ending import exit_code_of
from sagline.cli.main import app
from sagline.cli.terminal import show_data
from tests.tiers import extended, wide

COMMAND = [sys.executable, "-m", "sagline.cli"]
needs_full = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")


def broken(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("sagline.load_robot", fail)


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (RuntimeError("boom\nbang"), 70),
        (KeyError(), 70),
        (AssertionError("x" * 5000), 70),
        (RecursionError("deep"), 70),
        (MemoryError("Unable to allocate 15 TiB"), 2),
        (OSError(36, "File name too long", "x" * 400), 2),
        (PermissionError(13, "Permission denied", "a.nc"), 2),
        (sl.InvalidValueError("pose", "x" * 9000, "numbers", "Correct it."), 2),
        (sl.FileError("\x1b[2J.yaml", "is\nodd", "Rename it."), 2),
        (KeyboardInterrupt(), 130),
    ],
    ids=lambda value: str(value) if isinstance(value, int) else type(value).__name__,
)
def test_every_error_is_reported_in_one_line(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, snapshot: Any
) -> None:
    broken(monkeypatch, error)
    result = CliRunner().invoke(app, ["robots"])
    assert (result.exit_code, result.stdout) == (code, "")
    assert result.stderr.count("\n") == 1
    assert len(result.stderr) <= 300
    assert result.stderr == snapshot


@pytest.mark.parametrize("words", [["--debug", "robots"], ["robots", "--debug"]])
def test_the_traceback_is_printed_only_on_request(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    broken(monkeypatch, RuntimeError("boom"))
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 70
    assert result.stderr.startswith("Traceback ")
    assert "in fail" in result.stderr
    assert "RuntimeError: boom." in result.stderr.splitlines()[-1]


def test_files_written_before_the_error_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("short.yaml").write_text(
        "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"
    )

    def fail(*_: object) -> None:
        raise sl.FileError("figure.png", "cannot be written (No space left on device)", "Make room.")

    monkeypatch.setattr("sagline.cli.output.Output.draw", fail)
    result = CliRunner().invoke(app, ["track", "cogiro", "short.yaml"])
    assert result.exit_code == 2
    error, written = result.stderr.splitlines()
    assert error.startswith("Error: figure.png: ")
    assert written.endswith(" cogiro-catenary.nc in output")
    assert os.listdir("output") == ["cogiro-catenary.nc"]


@pytest.mark.parametrize("length", [280, 292, 293, 5000])
def test_a_long_error_is_cut_once(length: int, capsys: pytest.CaptureFixture[str]) -> None:
    error = sl.FileError("a", "x" * (length - len("a: . Next.")), "Next.")

    def fail() -> None:
        raise error

    assert exit_code_of(fail) == 2
    line = capsys.readouterr().err
    assert line == f"Error: {error}\n"
    assert len(line) <= 300
    assert line.count("…") == (length > 292)


@pytest.mark.parametrize("command", wide(["show", "forward", "tension", "track"], first=2))
def test_names_from_files_contain_no_terminal_commands(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Readers refuse such names, so the printing is tested without them."""
    monkeypatch.chdir(tmp_path)
    evil = "\x1b[31mred\x9b2J\x07[bold]x[/bold] :smile: \u202eevil"
    robot = sl.load_robot("cogiro")
    object.__setattr__(robot, "name", evil)
    object.__setattr__(robot, "source", f"source {evil}")
    object.__setattr__(robot, "notes", f"notes {evil}\nmore")
    Path("short.yaml").write_text(
        "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"
    )
    plan = sl.inverse(robot, sl.load_path("short.yaml"))
    monkeypatch.setattr("sagline.load_robot", lambda _: robot)
    header = ",".join(f"L{k}" for k in range(8))
    row = ",".join(f"{length:.6f}" for length in plan.unstrained_length[0])
    Path("lengths.csv").write_text(f"{header}\n{row}\n")
    words = {
        "show": ["cogiro"],
        "tension": ["cogiro", "--no-figures"],
        "track": ["cogiro", "short.yaml", "--no-figures"],
        "forward": ["cogiro", "lengths.csv"],
    }[command]
    for more in ([], ["--json"]):
        result = CliRunner().invoke(app, [command, *words, *more])
        assert result.exit_code in (0, 2), result.output
        assert [c for c in result.output if not c.isprintable() and c != "\n"] == []
        assert "\U0001f604" not in result.output
        if command == "show":
            assert "[bold]x[/bold] :smile:" in result.output


def test_a_file_on_stdout_is_exact_except_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(StringIO):
        def isatty(self) -> bool:
            return True

    text, seen = "a: \u202e\x9b\n\tb: é\n", Terminal()
    monkeypatch.setattr(sys, "stdout", seen)
    show_data(text)
    assert seen.getvalue() == "a: \\u202e\\x9b\n\tb: é\n"
    raw = BytesIO()
    monkeypatch.setattr(sys, "stdout", TextIOWrapper(raw, encoding="ascii"))
    show_data(text)
    assert raw.getvalue() == text.encode()


@extended
@needs_full
@pytest.mark.parametrize(
    "words", [["robots"], ["robots", "--json"], ["--help"], ["--version"], ["show", "--help"], ["convert", "cogiro"]]
)
def test_a_full_disk_behind_stdout(words: list[str]) -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run([*COMMAND, *words], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert "standard output" in done.stderr
    assert os.strerror(errno.ENOSPC) in done.stderr
    assert done.stderr.count("\n") == 1


@extended
@pytest.mark.parametrize("words", [["robots", "--json"], ["--help"], ["convert", "cogiro"]])
def test_a_closed_pipe_ends_the_command(words: list[str]) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run([*COMMAND, *words], stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")  # as after SIGPIPE


@extended
def test_stdout_and_stderr_may_be_closed() -> None:
    line = f'"{sys.executable}" -m sagline.cli'
    for words in ("robots", "robots --json", "--help", "--version", "show --help", "convert cogiro"):
        done = subprocess.run(["sh", "-c", f"{line} {words} >&-"], stderr=subprocess.PIPE, text=True)
        assert done.returncode == 2
        assert "standard output" in done.stderr
        assert "closed" in done.stderr
        assert done.stderr.count("\n") == 1
    done = subprocess.run(["sh", "-c", f"{line} show nothing 2>&-"], stdout=subprocess.PIPE, text=True)
    assert (done.returncode, done.stdout) == (2, "")


@extended
def test_every_encoding_of_the_output_works() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    done = subprocess.run([*COMMAND, "robots"], capture_output=True, env=environment)
    assert (done.returncode, done.stderr) == (0, b"")
    assert rb"15 \xd7 11 \xd7 6" in done.stdout
    done = subprocess.run([*COMMAND, "show", "article-mixed", "--json"], capture_output=True, env=environment)
    assert json.loads(done.stdout.decode("ascii"))["inertia"]["unit"] == "kg m²"


@extended
def test_warnings_of_libraries_are_not_printed() -> None:
    code = (
        "import logging, sys, warnings\n"
        "from sagline.cli import __main__ as start\n"
        "from sagline.robot import catalogue\n"
        "def noisy():\n"
        "    warnings.warn('of a library', RuntimeWarning)\n"
        "    logging.getLogger('matplotlib').warning('of another')\n"
        "    print('answer')\n"
        "    raise SystemExit(0)\n"
        "catalogue.robot_names = noisy\n"
        "start.app_entry()\n"
    )
    done = subprocess.run([sys.executable, "-c", code, "robots"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "answer\n", "")
    done = subprocess.run([sys.executable, "-c", code, "robots", "--debug"], capture_output=True, text=True)
    assert "of a library" in done.stderr


@extended
def test_an_error_in_a_thread_is_reported_in_one_line() -> None:
    code = (
        "import threading\n"
        "from sagline.cli import __main__ as start\n"
        "from sagline.robot import catalogue\n"
        "def fails():\n"
        "    thread = threading.Thread(target=lambda: 1 / 0)\n"
        "    thread.start()\n"
        "    thread.join()\n"
        "    return []\n"
        "catalogue.robot_names = fails\n"
        "start.app_entry()\n"
    )
    done = subprocess.run([sys.executable, "-c", code, "robots"], capture_output=True, text=True)
    assert "ZeroDivisionError" in done.stderr
    assert done.stderr.count("\n") == 1


def test_the_end_of_the_input_is_an_error() -> None:
    def asks() -> None:
        import typer

        raise typer.Abort

    assert exit_code_of(asks) == 2


@extended
def test_only_light_modules_are_loaded_first() -> None:
    """Only light modules are loaded before the first statement of the command: until then Ctrl-C has no handler."""
    heavy = ("numpy", "numba", "typer", "rich", "yaml", "matplotlib")
    code = f"import sys, sagline.cli.__main__; print([name for name in {heavy} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


LOADED = """
import sys
from sagline.cli.main import app
from typer.testing import CliRunner

assert CliRunner().invoke(app, sys.argv[1:]).exit_code == 0
print(*(name for name in sys.modules if name.split(".")[0] == "sagline"))
"""


@extended
@pytest.mark.parametrize(
    ("words", "most"),
    [(["--help"], 40), (["track", "--help"], 20), (["robots"], 50), (["track", "cogiro"], 80)],
)
def test_a_command_loads_few_modules(words: list[str], most: int, tmp_path: Path) -> None:
    """Each subcommand is imported when it is used, and its libraries when it is called."""
    done = subprocess.run(
        [sys.executable, "-c", LOADED, *words], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    loaded = done.stdout.split()
    assert len(loaded) <= most
    assert ("sagline.cli.view" in loaded) is (words == ["--help"])


def test_a_long_list_of_allowed_words_ends_with_a_whole_word(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sagline.cli.ending.ALTERNATIVES", 60)
    line = ["track", "cogiro", "--tension", "nothing"]
    assert exit_code_of(lambda: app(line, standalone_mode=False)) == 2
    words = " ".join(capsys.readouterr().err.split())
    assert "'lowest-sum' and 8 more" in words
    assert "'lowest-maximum'" not in words
