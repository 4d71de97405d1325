"""Bad command lines end with one line and exit code 2, and write nothing. Valid ones among them succeed."""

from __future__ import annotations

import os
import re
import shutil
import stat
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from typer.testing import CliRunner, Result

import sagline as sl
from sagline.cli.installation import _example_files
from sagline.cli.main import app
from sagline.plc.wire import addresses_of, groups_at
from sagline.present.page import Chapter
from tests.abuse.command_lines import LINES, Case, cases, commands
from tests.effort import least_seconds
from tests.files.executions import execution
from tests.kinematics.winches import wound
from tests.stand_ins import instead_of_machines
from tests.tiers import extended

pytestmark = extended

SHORT = "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"
SHARE = 250  # share of all bad command lines in `make test`
SLOWEST = 2.0  # s of processor time of an ordinary machine
START = 1.5  # s of loading time of a process
AGAIN = 3
LARGEST = 500 * 1024  # kB
ANSWERS = "\n" * 40  # answers to the questions of `new`: its suggestions


@pytest.fixture(scope="module")
def stocked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the example files, a run, and invalid files."""
    folder = tmp_path_factory.mktemp("stocked")
    for file in _example_files():
        if file.suffix != ".py":
            shutil.copy(file, folder)
    (folder / "short.yaml").write_text(SHORT)
    sl.inverse(sl.load_robot("cogiro"), sl.load_path(folder / "short.yaml")).save(folder / "run.nc")
    sl.inverse(wound(), sl.load_path(folder / "short.yaml")).save(folder / "wound.nc")
    execution().save(folder / "run.mcap")
    (folder / "broken.nc").write_bytes((folder / "run.nc").read_bytes()[:700])
    (folder / "broken.yaml").write_text("name: [\n")
    (folder / "empty.csv").write_text("")
    (folder / "folder").mkdir()
    (folder / "folder.yaml").mkdir()
    (folder / "link.yaml").symlink_to("nowhere.yaml")
    return folder


@pytest.fixture(autouse=True)
def shortened_commands(stocked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Long commands end after the check of their arguments, or do a small part of their work."""
    short = sl.load_path(stocked / "short.yaml")
    monkeypatch.setattr("sagline.article_path", lambda: short)
    monkeypatch.setattr("sagline.cli.article.FIGURES", ())
    monkeypatch.setattr("sagline.cli.article.CELLS", 4)
    monkeypatch.setattr("sagline.cli.article._figures", lambda *_: ())
    monkeypatch.setattr("sagline.workspaces.levels._EVALUATIONS", 30)
    monkeypatch.setattr("sagline.article.report._ReportPart.build", lambda part: Chapter(part.key, part.key, "", ()))
    monkeypatch.setattr("sagline.cli.output.Output.draw", lambda *_: None)

    def started(host: str, port: int, title: str, **_: Any) -> Any:
        server._check(host, port)
        raise SystemExit(0)

    def linked(robot: sl.Robot, plc: str, *, modbus: bool) -> Any:
        groups_at(addresses_of(plc, 102), robot)
        return sl.twin.Machine(robot).link()

    instead_of_machines(monkeypatch)
    monkeypatch.setattr("sagline.cli.control._link", linked)
    from sagline.viewer import server

    monkeypatch.setattr(server, "start_server", started)


def snapshot(folder: Path) -> dict[str, str]:
    """All files of a folder with the times of their last changes."""
    found = {}
    for path in folder.rglob("*"):
        seen = os.lstat(path)
        since = f"{seen.st_ino} {seen.st_size} {seen.st_mtime_ns}" if stat.S_ISREG(seen.st_mode) else ""
        found[str(path.relative_to(folder))] = f"{seen.st_mode} {since}"
    return found


class Bench:
    """A folder in which commands run, a few levels below a folder that is checked for new files."""

    def __init__(self, stock: Path, top: Path) -> None:
        self.stock, self.top, self.place = stock, top, top / "one" / "two" / "three"
        self.renew()

    def renew(self) -> None:
        shutil.rmtree(self.top / "one", ignore_errors=True)
        for extra in self.top.iterdir():
            extra.unlink()
        shutil.copytree(self.stock, self.place, symlinks=True)
        os.mkfifo(self.place / "pipe.yaml")
        os.chdir(self.place)
        self.before = snapshot(self.top)

    def ended(self, case: Case, renewed: bool = False) -> Result:
        if renewed:
            self.renew()
        return CliRunner().invoke(app, case.words, input=ANSWERS)

    def faults(self, case: Case, codes: tuple[int, ...] = (0, 1, 2)) -> list[str]:
        """Errors in the end of a command line; `codes` are the allowed exit codes."""
        start = time.process_time()
        result = self.ended(case)
        seconds = time.process_time() - start
        written = snapshot(self.top) != self.before
        if seconds > SLOWEST:
            seconds = least_seconds(lambda: self.ended(case, renewed=written), SLOWEST, seconds)
        found = [f"{seconds:.1f} s"] if seconds > SLOWEST else []
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            found.append(f"raises {result.exception!r}")
        if result.exit_code == 2:
            found += errors_of_message(result.stdout, result.stderr)
            found += ["writes"] if written else []
        if result.exit_code not in codes:
            found.append(f"exit code {result.exit_code}")
        if "Traceback" in result.output:
            found.append("a traceback")
        if controls(result.output):
            found.append(f"control characters {controls(result.output)!r}")
        if written:
            self.renew()
        return [f"{case.name} {case.words[1:]!r}"[:300] + f": {fault}; {result.output[-200:]!r}" for fault in found]


def errors_of_message(stdout: str, stderr: str) -> list[str]:
    """Errors in a message of refusal."""
    found = [f"stdout {stdout[:80]!r}"] if stdout else []
    lines = stderr.rstrip("\n").split("\n")
    if len(lines) != 1 or not lines[0].startswith("Error: "):
        found.append(f"{len(lines)} lines, of which {lines[:2]}")
    if max(map(len, lines)) >= 300:
        found.append(f"{max(map(len, lines))} characters")
    return found


def controls(text: str) -> str:
    return "".join(c for c in text if not c.isprintable() and c != "\n")


def tried(stock: Path, top: Path, some: list[Case]) -> list[str]:
    bench, here = Bench(stock, top), Path.cwd()
    try:
        return [fault for case in some for fault in bench.faults(case)]
    finally:
        os.chdir(here)


def test_bad_command_lines_print_one_line_and_write_nothing(stocked: Path, tmp_path: Path) -> None:
    assert tried(stocked, tmp_path, cases(10, SHARE)) == []


@pytest.mark.soak
def test_all_bad_command_lines(stocked: Path, tmp_path: Path) -> None:
    every = cases(10, None)
    assert len(every) > 5000
    assert tried(stocked, tmp_path, every) == []


def test_every_command_and_option_is_tried(stocked: Path, tmp_path: Path) -> None:
    names = {case.name for case in cases(10, None)}
    for name, command in commands().items():
        assert {f"{name} {parameter.opts[0]}" for parameter in command.params if parameter.opts[0][:2] == "--"} <= names
    lines = [Case(name, words) for name, words in LINES.items()]
    bench, here = Bench(stocked, tmp_path), Path.cwd()
    try:
        for case in lines:  # valid lines succeed, so each refusal above is due to its bad value
            assert bench.faults(case, (0,)) == []
    finally:
        os.chdir(here)


def memory_of(pid: int) -> int:
    """Largest memory of a process so far [kB]; `wait4` would include the memory of its parent."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(found[1]) if found else 0


class Ended(NamedTuple):
    """Exit code, outputs, time and memory of a process."""

    code: int
    printed: str
    errors: str
    seconds: float  # of processor time
    memory: int  # kB


def in_a_process(words: list[str], place: Path) -> Ended:
    encoded = [word.encode("utf-8", "surrogateescape") for word in words]
    with open(place / "out", "wb") as out, open(place / "err", "wb") as err:
        process = subprocess.Popen(
            [sys.executable, "-m", "sagline.cli", *encoded], cwd=place, stdout=out, stderr=err, stdin=subprocess.DEVNULL
        )
        memory = 0
        while (ended := os.wait4(process.pid, os.WNOHANG))[0] == 0:
            memory = max(memory, memory_of(process.pid))
            time.sleep(0.01)
        _, status, used = ended
    process.returncode = os.waitstatus_to_exitcode(status)
    printed, errors = (place / "out").read_text(), (place / "err").read_text()
    return Ended(process.returncode, printed, errors, used.ru_utime + used.ru_stime, memory)


def takes_long(case: Case, place: Path) -> str:
    """True if a process repeatedly takes much longer than a valid one of the same command.

    Other processes on the same cores slow both of them in the same way.
    """
    told = ""
    for _ in range(AGAIN):
        plain, bad = (in_a_process(words, place).seconds for words in (LINES.get(case.name.split()[0], []), case.words))
        told = f"{bad:.1f} s; as it works {plain:.1f} s"
        if bad <= plain * (SLOWEST + START) / START:
            return ""
    return told


def faults_of_process(case: Case, place: Path) -> list[str]:
    """Errors in the end of a real process, its time and its memory."""
    ended = in_a_process(case.words, place)
    found = errors_of_message(ended.printed, ended.errors) if ended.code == 2 else []
    if ended.code not in (0, 1, 2) or "Traceback" in ended.errors:
        found.append(f"exit code {ended.code}")
    if ended.seconds > SLOWEST + START and (told := takes_long(case, place)):
        found.append(told)
    if ended.memory > LARGEST:
        found.append(f"{ended.memory // 1024} MB")
    return [f"{case.name} {case.words[1:]!r}: {fault}; {ended.errors[-200:]!r}" for fault in found]


@pytest.mark.parametrize("count", [8, pytest.param(300, marks=pytest.mark.soak)])
def test_real_processes_take_little_time_and_memory(count: int, stocked: Path, tmp_path: Path) -> None:
    place = tmp_path / "place"
    shutil.copytree(stocked, place, symlinks=True)
    os.mkfifo(place / "pipe.yaml")
    quick = (case for case in cases(11, None) if case.words[0] not in ("view", "article", "run"))
    some = [case for case, _ in zip(quick, range(count), strict=False)]
    # repeat in case of an error: the first run may compile a small kernel
    again = [case for case in some if faults_of_process(case, place)]
    assert [fault for case in again for fault in faults_of_process(case, place)] == []
