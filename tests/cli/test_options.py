"""Options of all commands: equal names have equal meanings, and tables, figures and files have the same options."""

from __future__ import annotations

import ast
import csv
import json
import shutil
from collections import defaultdict
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from typer.main import get_command
from typer.testing import CliRunner, Result

import sagline as sl
import sagline.cli
from sagline.cli import values
from sagline.cli.main import FORMER, MODULES, NAMES, app
from sagline.cli.options import expanded, tension_named
from sagline.core.arguments import word_of
from sagline.core.surface import public_names
from tests.files.executions import execution
from tests.tiers import extended

EXAMPLES = Path(__file__).parents[2] / "examples"
GROUP: Any = get_command(app)
OPTIONS: dict[str, dict[str, Any]] = defaultdict(dict)  # name of an option -> command -> option
for _name in NAMES:
    for _parameter in GROUP.commands[_name].params:
        if _parameter.param_type_name == "option":
            OPTIONS[_parameter.opts[0]][_name] = _parameter
SHARED = sorted(name for name, commands in OPTIONS.items() if len(commands) > 1)
# commands with figures; `article` and `experiment` have figures in their page
DRAWING = {"track", "run", "tension", "vibrate", "simulate", "workspace", "design"}
# JSON without a table of equal rows, or commands whose files contain all rows: front.csv, Zarr, a page
NO_TABLE = {"design", "sweep", "article", "cache"}


def conversions() -> Iterator[tuple[str, str]]:
    """File and function of the conversion of each option."""
    for file in Path(sagline.cli.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) == "converted":
                name = ast.literal_eval(node.args[3]) if isinstance(node.args[3], ast.Constant) else ""
                yield file.name, name


def test_every_option_names_a_conversion_that_exists() -> None:
    found = [(file, name) for file, name in conversions() if name]
    assert {"pose_of_text", "wrench_of_text"} <= {name for _, name in found}
    assert [(file, name) for file, name in found if not callable(getattr(values, name, None))] == []


@pytest.mark.parametrize("name", SHARED)
def test_options_with_one_name_have_one_meaning(name: str) -> None:
    forms = {
        (option.help, option.metavar, kind_of(command, option), *option.opts, *option.secondary_opts)
        for command, option in OPTIONS[name].items()
    }
    assert len(forms) == 1


def kind_of(command: str, option: Any) -> str:
    """Type of one value of an option that can be repeated, or None."""
    module = import_module(f"sagline.cli.{MODULES.get(command, command)}")
    kind = expanded(getattr(module, command.replace("-", "_"))).__annotations__[option.name]
    for _ in range(2):
        (kind,) = [each for each in get_args(kind) or (kind,) if each is not type(None)]
    return str(kind)


def test_tables_and_figures_have_the_same_options() -> None:
    assert set(OPTIONS["--figures"]) == set(OPTIONS["--format"]) == DRAWING
    assert set(OPTIONS["--style"]) == DRAWING | {"calibrate"}
    assert set(OPTIONS["--json"]) - NO_TABLE == set(OPTIONS["--csv"])
    assert set(OPTIONS["--tension"]) >= {"track", "simulate", "vibrate", "export-c"}
    assert set(OPTIONS["--pose"]) >= {"tension", "vibrate", "simulate", "view"}


def test_former_names_are_not_used_again() -> None:
    for command, names in FORMER.items():
        assert not set(names) & {name for name, commands in OPTIONS.items() if command in commands}
        assert all(command in OPTIONS[name] for name in names.values())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    way = "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1.5]}, {position: [1, 0, 1.5]}]\n"
    (tmp_path / "path.yaml").write_text(way)
    return tmp_path


def sagline_(*words: str) -> Result:
    return CliRunner().invoke(app, words)


def names_in(folder: Path) -> set[str]:
    return {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()} - {"path.yaml"}


def test_out_is_a_folder_or_the_main_file(folder: Path) -> None:
    words = ("track", "cogiro", "path.yaml", "--no-figures", "--csv")
    assert sagline_(*words, "--out", "one").exit_code == 0
    assert sagline_(*words, "--out", "two/plan.nc").exit_code == 0
    stem = "one/cogiro-catenary"
    assert names_in(folder) == {f"{stem}.nc", f"{stem}.csv", "two/plan.nc", "two/plan.csv"}
    first, second = (sl.load_plan(file) for file in ("one/cogiro-catenary.nc", "two/plan.nc"))
    np.testing.assert_array_equal(first.unstrained_length, second.unstrained_length)
    done = sagline_(*words, "--out", "plan.txt")
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1)
    assert "plan.txt" in done.stderr
    assert ".nc" in done.stderr
    (folder / "plan.txt").mkdir()  # an existing folder is a folder, with any name
    assert sagline_(*words, "--out", "plan.txt").exit_code == 0


@pytest.mark.parametrize(
    "words", ["article errata", "examples", "sweep own_sweep.yaml", "design cogiro design.yaml", "run"]
)
def test_out_is_a_folder_for_files_with_fixed_names(words: str, folder: Path) -> None:
    for file in ("own_sweep.yaml", "own_planar.yaml", "design.yaml"):
        shutil.copy(EXAMPLES / file, folder)
    before = names_in(folder)
    done = sagline_(*words.split(), "--out", "into.nc")
    assert (done.exit_code, done.stderr.count("\n"), names_in(folder)) == (2, 1, before)
    assert "into.nc" in done.stderr


def test_files_on_stdout_are_the_same(folder: Path) -> None:
    sagline_("track", "cogiro", "path.yaml", "--no-figures", "--out", "plan.nc")
    text = sagline_("lengths", "plan.nc").stdout
    assert sagline_("lengths", "plan.nc", "--out", "into").exit_code == 0
    assert sagline_("lengths", "plan.nc", "--out", "own.csv").exit_code == 0
    assert (folder / "into" / "plan-lengths.csv").read_text() == (folder / "own.csv").read_text() == text


def rows_of(file: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))


def test_tables_have_the_numbers_of_json(folder: Path) -> None:
    done = sagline_("tension", "article-mixed", "--csv", "--json", "--no-figures", "--out", "t.csv")
    tensions = json.loads(done.stdout)["tensions"]
    rows = rows_of(folder / "t.csv")
    assert [row["method"] for row in rows] == list(tensions)
    for row in rows:
        found = [float(row[f"T{k} [N]"]) for k in range(8)]
        np.testing.assert_allclose(found, tensions[row["method"]]["chord_tension"], rtol=1e-12)
    done = sagline_("robots", "--csv", "--json")
    robots = {robot["name"]: robot for robot in json.loads(done.stdout)}
    for row in rows_of(folder / "output" / "robots.csv"):
        assert float(row["mass [kg]"]) == robots[row["robot"]]["mass_kg"]
        assert [float(row[f"frame {axis} [m]"]) for axis in "xyz"] == robots[row["robot"]]["frame_size_m"]
    assert sagline_("robots", "--out", "r.csv").exit_code == 2  # no effect
    cables = json.loads(sagline_("show", "cogiro", "--csv", "--out", "c.csv", "--json").stdout)
    rows = rows_of(folder / "c.csv")
    assert [[float(row[f"frame_anchors {axis} [m]"]) for axis in "xyz"] for row in rows] == cables["frame_anchors"][
        "value"
    ]
    assert [float(row["tension_max [N]"]) for row in rows] == cables["tension_max"]["value"]


def test_the_cycles_of_a_log_are_a_table(folder: Path) -> None:
    done = execution()
    done.save(folder / "run.mcap")
    assert sagline_("log", "run.mcap", "--csv", "--json").exit_code == 0
    rows = rows_of(folder / "output" / "run-cycles.csv")
    np.testing.assert_array_equal([float(row["x [m]"] or "nan") for row in rows], done.position[:, 0])
    for head, tensions in (("T{} [N]", done.tension), ("planned T{} [N]", done.planned_tension)):
        found = [[float(row[head.format(k)] or "nan") for k in range(tensions.shape[1])] for row in rows]
        np.testing.assert_array_equal(found, tensions)


def test_a_simulation_has_a_table_of_its_samples(folder: Path) -> None:
    words = ("simulate", "cogiro", "--pose", "1,0.5,2", "--break", "3@0.1s", "--after", "0.3", "--csv")
    done = sagline_(*words, "--no-figures", "--out", "s.nc")
    assert done.exit_code == 0, done.stderr
    read, rows = sl.load_simulation("s.nc"), rows_of(folder / "s.csv")
    np.testing.assert_array_equal([[float(row[f"T{k} [N]"]) for k in range(8)] for row in rows], read.tensions)
    np.testing.assert_array_equal([float(row["z [m]"]) for row in rows], read.pose.position[:, 2])
    np.testing.assert_allclose(read.pose.position[0], [1.0, 0.5, 2.0], atol=1e-9)
    assert read.damping.loss_time == 1e-3  # as in the viewer
    sagline_(*words, "--no-figures", "--loss-time", "0.002", "--out", "t.nc")
    assert sl.load_simulation("t.nc").damping.loss_time == 0.002
    sagline_("simulate", "cogiro", "--after", "0.1", "--no-figures", "--out", "u.nc")
    assert sl.load_simulation("u.nc").damping.loss_time == 0.0


@extended
def test_figures_have_the_requested_style_and_formats(folder: Path) -> None:
    words = ("simulate", "cogiro", "--after", "0.1", "--out", "s.nc", "--style", "ieee")
    assert sagline_(*words, "--format", "svg").exit_code == 0
    assert names_in(folder) == {"s.nc", "s-motion.svg", "s-energy.svg"}
    assert 'width="252pt"' in (folder / "s-motion.svg").read_text()  # 3.5 in
    done = sagline_(*words, "--format", "gif")
    assert (done.exit_code, "--format" in done.stderr, "pdf" in done.stderr) == (2, True, True)


def test_a_simulation_at_an_infeasible_pose_names_the_shortfall(folder: Path) -> None:
    done = sagline_("simulate", "article-suspended", "--pose", "7.45,0,1.5")
    plan = sl.inverse(sl.load_robot("article-suspended"), sl.Pose([7.45, 0, 1.5], np.eye(3)))
    assert done.exit_code == 2
    assert f" {float(plan.shortfall):.4g} N; " in done.stderr
    assert f" {', '.join(map(str, np.flatnonzero(plan.blocking)))})" in done.stderr


def test_the_tension_method_applies_to_the_modes(folder: Path) -> None:
    words = ("vibrate", "cogiro", "--pose", "0,0,2", "--up-to", "8", "--no-figures", "--no-csv", "--json")
    found = json.loads(sagline_(*words, "--tension", "centroid").stdout)["modes"]
    state = sl.inverse(sl.load_robot("cogiro"), sl.Pose([0, 0, 2], np.eye(3)), tension=sl.Centroid()).state
    massless = [mode["frequency_hz"] for mode in found if mode["kind"] == "massless"]
    np.testing.assert_allclose(massless, sl.modes(state).frequency, rtol=1e-9)
    assert names_in(folder) == set()


VERDICTS = (
    "robots",
    "show cogiro",
    "track cogiro path.yaml --no-figures",
    "tension cogiro --no-figures",
    "vibrate cogiro --up-to 4 --no-figures --no-csv",
    "workspace cogiro --cells 4 --no-figures",
    "simulate cogiro --after 0.1 --no-figures",
)


@pytest.mark.parametrize("line", VERDICTS)
def test_a_verdict_is_the_first_line(line: str, folder: Path) -> None:
    first, *rest = sagline_(*line.split()).stdout.splitlines()
    assert len(first.split()) > 2
    assert any(character.isdigit() for character in first)
    rules = [k for k, row in enumerate(rest) if set(row.strip()) == {"─"}]
    assert rules[0] <= 4  # followed by the table


@extended
def test_run_draws_and_writes_only_on_request(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sagline.article_path", lambda: sl.load_path("path.yaml"))
    monkeypatch.setattr("sagline.cli.article.CELLS", 4)
    assert sagline_("run", "--no-figures", "--csv").exit_code == 0
    kinds = {Path(name).suffix for name in names_in(folder)}
    assert kinds == {".nc", ".csv", ".glb"}
    assert len(names_in(folder)) == 4 + 4 + 2


def test_every_tension_method_is_an_option() -> None:
    for option, kind in (("--tension", sl.TensionMethod), ("--model", sl.CableModel)):
        public = {name: getattr(sl, name) for name in public_names("sagline")}
        names = {word_of(name) for name, value in public.items() if isinstance(value, type) and issubclass(value, kind)}
        for command in OPTIONS[option].values():
            listed = command.help.removesuffix(".").partition(": ")[2].split(", ")
            assert {*listed} == names - {word_of(kind.__name__), "quadratic-program"}
    assert type(tension_named("p-norm", "horizontal")) is sl.tension.PNorm


@pytest.mark.parametrize("words", [("track", "cogiro"), ("export-c", "cogiro")])
def test_an_unknown_tension_method_is_refused(words: tuple[str, ...]) -> None:
    result = CliRunner().invoke(app, [*words, "--tension", "foo"])
    assert result.exit_code == 2
    assert "'foo'" in result.stderr
    assert "'minimum-norm'" in result.stderr
