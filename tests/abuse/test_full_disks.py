"""Disks that become full at random sizes: each file is whole or absent, and one line reports the error."""

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from sagline.files.writing import atomic_files, write_text
from sagline.plot.sheet import sheet
from tests.abuse.commands import COMMANDS, Written, ended, prepare, tree
from tests.files.plans import a_plan
from tests.tiers import extended, wide

LONGEST = 300  # characters of a line
MOST = 2_000_000  # bytes: more than the size of each file


@contextmanager
def limited_file_size(size: int) -> Iterator[None]:
    """Limit the size of all files, in bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def together(folder: Path) -> None:
    with atomic_files(folder, ["page.html", "page.json"]) as (page, data):
        page.write_bytes(b"x" * 300_000)
        data.write_bytes(b"y" * 3_000)


def drawn(file: Path) -> None:
    figure = sheet(2.0)  # a new figure each time: a second drawing of a figure moves it slightly
    figure.add_subplot().plot([1.0, 2.0])
    sl.plot.save(figure, file)


@pytest.fixture(scope="module")
def writers() -> dict[str, Callable[[Path], None]]:
    plan = a_plan()
    return {
        "plan": lambda folder: plan.save(folder / "run.nc"),
        "png": lambda folder: drawn(folder / "path.png"),
        "svg": lambda folder: drawn(folder / "path.svg"),
        "eps": lambda folder: drawn(folder / "path.ps"),
        "pdf": lambda folder: drawn(folder / "path.pdf"),
        "text": lambda folder: write_text(folder / "text.txt", "line\n" * 40_000),
        "together": together,
    }


@pytest.mark.parametrize("count", [6, pytest.param(300, marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", wide(["text", "plan", "together", "png", "svg", "eps", "pdf"], first=2))
def test_a_file_is_whole_or_unchanged(
    tmp_path: Path,
    writers: dict[str, Callable[[Path], None]],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    count: int,
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")  # matplotlib writes the creation time into PDF and PostScript
    writers[name](tmp_path)
    whole = tree(tmp_path)
    rng = np.random.default_rng(5)
    limits = [0, *map(int, np.geomspace(1.0, MOST, count) * rng.uniform(0.7, 1.4, count)), MOST]
    refused = [written_or_refused(tmp_path, writers[name], whole, limit, rng) for limit in limits]
    assert (refused[0], refused[-1]) == (True, False)


def written_or_refused(
    folder: Path, write: Callable[[Path], None], whole: dict[str, str], limit: int, rng: np.random.Generator
) -> bool:
    """True if the full disk is reported. Then the folder is unchanged; otherwise it contains the whole file."""
    for file in whole:
        (folder / file).unlink(missing_ok=True)
        if rng.random() < 0.5:
            (folder / file).write_text("before")
    before = tree(folder)
    try:
        with limited_file_size(limit):
            write(folder)
    except sl.SaglineError as error:
        line = str(error).replace(str(folder), "")
        assert "written" in line
        assert len(line) < LONGEST
        assert tree(folder) == before, limit
        return True
    assert tree(folder) == whole, limit
    return False


@extended
@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", ["track", "article", "convert"])
def test_a_command_names_its_finished_files_and_removes_the_others(
    tmp_path: Path, written: Written, monkeypatch: pytest.MonkeyPatch, name: str, every: bool
) -> None:
    whole = written(name)
    monkeypatch.chdir(tmp_path)
    prepare(tmp_path)
    inputs = tree(tmp_path)
    sizes = {int(what.split()[0]) for what in whole.values()}
    for size in sizes if every else {max(sizes)}:
        for file in whole:
            Path(file).unlink(missing_ok=True)
        with limited_file_size(size - 1):
            result = ended(*COMMANDS[name])
        there = {path: what for path, what in tree(tmp_path).items() if path not in inputs}
        assert result.exit_code == 2, result.output
        assert there.items() < whole.items()
        first, *more = result.stderr.splitlines()
        assert first.startswith("Error: "), result.output
        assert "written" in first, result.output
        assert len(first) < LONGEST
        head, text = "Complete files before the error: ", more[0] if more else ""
        named = text.removeprefix(head).removesuffix(" in out").split(", ") if text else []
        assert sorted(named) == sorted(Path(path).name for path in there)
