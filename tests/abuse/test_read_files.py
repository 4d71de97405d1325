"""Special files: folders, pipes, endless, too large or growing files, and impossible file names."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sagline import SaglineError
from tests.abuse.reading import LENGTHS, PATH, READERS, ROBOT, WAYPOINTS, Reader, judged
from tests.tiers import wide

FILES = [reader for reader in READERS if not reader.name.endswith(".txt")]
BY_FILE = pytest.mark.parametrize("reader", wide(FILES), ids=lambda reader: reader.name)


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _endless(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _folder(path: Path) -> None:
    path.mkdir()


def _loop(path: Path) -> None:
    path.symlink_to(path)


def _dangling(path: Path) -> None:
    path.symlink_to(path.parent / "nowhere")


def _holes(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(200_000_000_000)  # a sparse file, which takes no space on the disk


def _zeros(path: Path) -> None:
    path.write_bytes(b"\0" * 400_000)


def _nothing(path: Path) -> None:
    path.write_bytes(b"")


@BY_FILE
@pytest.mark.parametrize("make", [_pipe, _endless, _folder, _loop, _dangling, _holes, _zeros, _nothing])
def test_paths_of_unreadable_files_are_refused(reader: Reader, make: Callable[[Path], None], tmp_path: Path) -> None:
    file = tmp_path / reader.name
    make(file)
    found = judged(lambda: reader.read(file), f"{reader.name}, {make.__name__}")
    assert isinstance(found, SaglineError)


@pytest.mark.parametrize("stem", ["a" * 300, "a\0b", "\ud800", "a\x1b[2J", "a\nb", "名" * 100, "~", "%s"])
@BY_FILE
def test_names_of_files(reader: Reader, stem: str, tmp_path: Path) -> None:
    for path in (tmp_path / (stem + Path(reader.name).suffix), tmp_path / stem):
        found = judged(lambda: reader.read(path), f"{reader.name}, {stem[:20]!r}")  # noqa: B023
        assert isinstance(found, SaglineError)


def lines(head: str, line: str, size: int) -> tuple[str, str, int]:
    return head, line, size // len(line)


@pytest.mark.parametrize(
    ("name", "text"),
    wide(
        [
            ("tour.csv", lines("", ",", 4_000_000)),
            ("robot.yaml", lines(ROBOT, "# nothing but a remark\n", 2_000_000)),
            ("robot.yaml", lines(ROBOT + "x:\n", "- 1\n", 900_000)),
            ("robot.yaml", lines(ROBOT + "x: [", "1,", 900_000)),
            ("robot.yaml", lines("", "k: v\n", 900_000)),
            ("robot.yaml", lines("", " ", 900_000)),
            ("robot.yaml", lines("a: ", "x", 900_000)),
            ("robot.yaml", lines("a: '", "''", 900_000)),
            ("robot.yaml", lines("a: |\n", "  x\n", 900_000)),
            ("robot.yaml", lines("", "&a ", 900_000)),
            ("robot.yaml", lines("", "--- a\n", 900_000)),
            ("robot.yaml", lines("", "%YAML 1.1\n", 900_000)),
            ("robot.yaml", lines("", '"a": {', 900_000)),
            ("robot.yaml", lines("a: &a [x]\n", "b: *a\n", 900_000)),
            ("tour.yaml", lines(WAYPOINTS, "  - {position: [0, 0, 1.5]}\n", 900_000)),
            ("tour.csv", lines(PATH, "x", 1_000_000)),
            ("tour.csv", lines(PATH, '"', 1_000_000)),
            ("tour.csv", lines("time,x,y,z\n", "0,0,0,0\n", 2_000_000)),
            ("lengths.csv", lines("L0,", "L0,", 1_000_000)),
            ("lengths.csv", lines(LENGTHS, "1,2,3\n", 70_000_000)),
            ("shelf.wcrfx", lines("", "<a>", 3_900_000)),
            ("shelf.wcrfx", lines("<a ", "b='c' ", 3_900_000)),
            ("shelf.wcrfx", lines("<models version='0.32'>", "<robot/>", 2_000_000)),
            ("gondola_bodies.xml", lines("<links>", "<link_rigid/>", 2_000_000)),
            ("gondola_cables.xml", lines("<cables>", "<cable_set id='a'/>", 2_000_000)),
            ("gondola_cables.xml", lines("<!DOCTYPE a [", "<!ENTITY b 'c'>", 1_000_000)),
        ]
    ),
)
@pytest.mark.parametrize("share", [0.2, pytest.param(1.0, marks=pytest.mark.soak)])
def test_files_without_end_are_refused(name: str, text: tuple[str, str, int], share: float, tmp_path: Path) -> None:
    reader = next(reader for reader in READERS if reader.name == name)
    head, line, count = text
    tail = f"</{head[1:].split()[0].rstrip('>')}>" if head.endswith(">") else ""
    data = (head + line * int(share * count) + tail).encode()
    found = judged(lambda: reader.read(reader.written(tmp_path, data)), f"{name}: {head[:40]!r} and many {line!r}")
    # files of a few hundred kilobytes of comments or waypoints are read, a file of a megabyte is refused
    assert isinstance(found, SaglineError) or (share < 1.0 and name.endswith(".yaml"))


@contextmanager
def unreadable(path: Path) -> Iterator[None]:
    path.chmod(0)
    yield
    path.chmod(0o600)


@BY_FILE
def test_a_file_without_read_permission_is_refused(reader: Reader, tmp_path: Path) -> None:
    file = reader.written(tmp_path, reader.sample.encode())
    with unreadable(file):
        found = judged(lambda: reader.read(file), reader.name)
    if os.geteuid() != 0:  # the superuser can read all files
        assert isinstance(found, SaglineError)
