"""The commands in README and in help texts run as printed, in a folder with the files of `sagline examples`."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.installation import KINDS, _example_files
from sagline.cli.main import app
from sagline.files.mcap_reader import read_log
from sagline.files.mcap_writer import Recorder
from sagline.present.page import Chapter
from tests.abuse.command_lines import commands
from tests.calibration.made_up import made_up
from tests.files.executions import execution
from tests.kinematics.winches import wound
from tests.stand_ins import instead_of_machines
from tests.tiers import extended

ROOT = Path(__file__).parents[2]
LONG = (
    "track", "lengths", "encoder", "tension", "vibrate", "simulate", "workspace", "sweep", "design", "calibrate",
    "view", "share", "twin", "log",
)  # fmt: skip


def lines_of(text: str) -> list[list[str]]:
    """Lines that begin with `sagline`, as words."""
    whole = text.replace("\\\n", " ")
    return [shlex.split(found, comments=True)[1:] for found in re.findall(r"^ *(sagline \S.*)$", whole, re.MULTILINE)]


def printed() -> list[list[str]]:
    """Commands of the section on the command line in README, and examples in the help of every command."""
    readme = (ROOT / "README.md").read_text()
    section = readme.partition("## On the command line")[2].partition("\n## ")[0]
    found = lines_of(section.partition("```sh\n")[2].partition("```")[0])
    assert len(found) >= 9
    for command in commands().values():
        found += lines_of(command.help)
    return [line for k, line in enumerate(found) if line not in found[:k]]


def in_tiers(lines: list[list[str]]) -> list[Any]:
    """The lines; commands with long computations are in the second tier."""
    return [pytest.param(line, marks=extended) if line[0] in LONG else line for line in lines]


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("examples")
    result = CliRunner().invoke(app, ["examples", "--out", str(place)])
    assert result.exit_code == 0, result.output
    return place


@pytest.fixture
def folder(examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Current folder with the files of `sagline examples`."""
    shutil.copytree(examples, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def with_winches(place: Path) -> None:
    """A robot of the user with drums, a run of it and its counts."""
    (place / "my_robot.yaml").write_text(sl.dump_robot(wound()))
    plan = sl.inverse(wound(), sl.Pose.from_euler([[0.0, 0.0, 2.0], [0.1, 0.0, 2.0]], 0.0, 0.0, 0.0))
    (place / "output").mkdir()
    plan.save(place / "output" / "my-robot-catenary.nc")
    header = ",".join(f"C{k}" for k in range(8))
    np.savetxt(place / "counts.csv", sl.encoder_counts(plan), delimiter=",", header=header, comments="")


def with_run(file: Path) -> None:
    """A run, ROBOT-MODEL.nc, written by `sagline track`."""
    file.parent.mkdir()
    robot, _, model = file.stem.rpartition("-")
    path = sl.quintic_path([(0.0, 0.0, 1.5), (0.1, 0.0, 1.5)], durations=1.0, rate=10)
    sl.inverse(sl.load_robot(robot), path, {"catenary": sl.Catenary(), "empirical": sl.Empirical()}[model]).save(file)


def with_logs(place: Path) -> None:
    """A log, a log of a killed process, and a log of a twin."""
    execution().save(place / "run.mcap")
    whole = (place / "run.mcap").read_bytes()
    (place / "killed.mcap").write_bytes(whole[:-20_000])
    with Recorder(place / "twin.mcap", execution().robot) as recorder:
        recorder.truth(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def with_two_runs(place: Path) -> None:
    """Two runs of a robot."""
    for name, speed in (("run_a.nc", 1.0), ("run_b.nc", 0.5)):
        path = sl.quintic_path([(0.0, 0.0, 1.5), (0.1, 0.0, 1.5)], durations=1.0 / speed, rate=10)
        sl.inverse(sl.load_robot("article-mixed"), path).save(place / name)


@pytest.mark.parametrize("words", in_tiers(printed()), ids=" ".join)
def test_a_printed_command_runs(words: list[str], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    served: list[Any] = []

    def serve(robot: sl.Robot, *more: Any, **others: Any) -> int:
        served.append(robot)
        return 0

    def serve_run(robot: sl.Robot, run: Path, address: Any, beside: Path | None) -> int:
        served.append([sl.load_plan(file) for file in (run, beside) if file is not None])
        return 0

    def serve_log(log: Path, *more: Any, truth: Path | None, **others: Any) -> int:
        assert truth is None or read_log(truth).truth
        served.append(sl.load_execution(log))
        return 0

    def serve_found(file: Path, *more: Any, **others: Any) -> int:
        served.append(sl.load_calibration(file))
        return 0

    monkeypatch.setattr("sagline.cli.view.view_robot", serve)
    monkeypatch.setattr("sagline.cli.view._view_run", serve_run)
    monkeypatch.setattr("sagline.cli.view._view_calibration", serve_found)
    monkeypatch.setattr("sagline.cli.view._view_log", serve_log)
    monkeypatch.setattr("sagline.article.report._ReportPart.build", lambda part: Chapter(part.key, part.key, "", ()))
    monkeypatch.setattr("sagline.cli.article.FIGURES", ())
    monkeypatch.setattr("sagline.cli.article.CELLS", 4)
    monkeypatch.setattr("sagline.cli.article._figures", lambda *_: ())
    monkeypatch.setattr("sagline.plot.sheet.RESOLUTION", 50)  # dots per inch: a coarse picture saves time
    instead_of_machines(monkeypatch)
    if words[0] == "twin":
        words = [*words, "--port", "0"]  # another twin may use the default ports
    if words[0] == "workspace":
        words = [*words, "--cells", "6"]  # less work, as with CELLS above
    if "worn.yaml" in words:
        (folder / "worn.yaml").write_text(sl.dump_robot(sl.load_robot("article-prototype").replace(mass=52.0)))
    if any(word.endswith(".mcap") for word in words):
        with_logs(folder)
    if "--beside" in words:
        with_two_runs(folder)
    if words == ["view", "found.nc"]:
        made_up(count=6).save(folder / "found.nc")
    if words[0] == "encoder" or "--counts" in words:
        with_winches(folder)
    else:
        for word in words:
            if word.startswith("output/"):
                with_run(folder / word)
    result = CliRunner().invoke(app, words, input="\n" * 9)  # default answers to all questions
    assert result.exit_code == 0, result.output
    assert len(served) == (words[0] == "view")


@pytest.mark.soak
def test_the_command_of_the_whole_article_runs(folder: Path) -> None:
    assert CliRunner().invoke(app, ["article"]).exit_code == 0


def test_examples_are_copied_and_replace_no_file_without_permission(tmp_path: Path) -> None:
    words = ["examples", "--out", str(tmp_path / "new")]
    assert CliRunner().invoke(app, words).exit_code == 0
    source = {file.name: file.read_bytes() for file in (ROOT / "examples").iterdir() if file.suffix in KINDS}
    assert {file.name: file.read_bytes() for file in (tmp_path / "new").iterdir()} == source
    assert {"own_robot.yaml", "own_path.yaml", "lengths.csv", "cable.csv", "robot.wcrfx"} < set(source)
    (tmp_path / "new" / "lengths.csv").write_text("mine")
    (tmp_path / "new" / "cable.csv").unlink()
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 2
    assert "--force" in result.stderr
    assert not (tmp_path / "new" / "cable.csv").exists()
    assert CliRunner().invoke(app, [*words, "--force"]).exit_code == 0
    assert (tmp_path / "new" / "lengths.csv").read_bytes() == source["lengths.csv"]


@extended
def test_an_installed_package_contains_the_examples(tmp_path: Path) -> None:
    """The folder of hatch: `examples` of the source becomes `sagline/examples` of the wheel."""
    import tomllib

    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())
    included = settings["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included == {"examples": "sagline/examples"}
    package = Path(sl.__file__).parent
    shutil.copytree(package, tmp_path / "sagline", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "examples", tmp_path / "sagline" / "examples")
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); from sagline.cli.installation import _example_files; "
    code += "print(*_example_files(), sep='\\n')"
    done = subprocess.run([sys.executable, "-I", "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    found = [Path(line) for line in done.stdout.splitlines()]
    assert {file.parent for file in found} == {tmp_path / "sagline" / "examples"}
    assert [file.name for file in found] == [file.name for file in _example_files()]
