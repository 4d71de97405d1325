"""Each output file of each command with its name taken by a folder, link, pipe or device: one line, no change."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.abuse.commands import COMMANDS, Written, ended, prepare, tree
from tests.tiers import wide

LONGEST = 300  # characters of a line


def folder(place: Path) -> None:
    place.mkdir()


def full_folder(place: Path) -> None:
    place.mkdir()
    (place / "data").write_text("data")


def pipe(place: Path) -> None:
    os.mkfifo(place)


def link_to_file(place: Path) -> None:
    (place.parent.parent / "data").write_text("data")
    place.symlink_to("../data")


def link_to_nothing(place: Path) -> None:
    place.symlink_to("nothing")


def link_to_folder(place: Path) -> None:
    place.symlink_to(".")


def link_to_itself(place: Path) -> None:
    place.symlink_to(place.name)


def link_to_device(place: Path) -> None:
    place.symlink_to(os.devnull)


def device(place: Path) -> None:
    os.mknod(place, 0o20666, os.makedev(1, 3))  # a device such as /dev/null; only the superuser can create it


KINDS = [folder, full_folder, pipe, link_to_file, link_to_nothing, link_to_folder, link_to_itself, link_to_device]
if hasattr(os, "getuid") and os.getuid() == 0:
    KINDS.append(device)


@pytest.mark.parametrize("kinds", [1, pytest.param(len(KINDS), marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", wide(reversed(COMMANDS)))
def test_a_taken_name_is_reported_and_the_folder_is_unchanged(
    tmp_path: Path, written: Written, monkeypatch: pytest.MonkeyPatch, name: str, kinds: int
) -> None:
    rng = np.random.default_rng(7)
    for file in written(name):
        for kind in rng.permutation(len(KINDS))[:kinds]:
            assert_reported(tmp_path / f"{Path(file).name}-{kind}", file, KINDS[kind], COMMANDS[name], monkeypatch)


def assert_reported(
    place: Path, file: str, take: Callable[[Path], None], words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    place.mkdir()
    monkeypatch.chdir(place)
    prepare(place)
    take(place / file)
    before = tree(place)
    result = ended(*words)
    case = f"{words}: {file} is a {take.__name__}: {result.output}"
    assert result.exit_code == 2, case
    line = result.stderr.removesuffix("\n")
    assert line.startswith("Error: "), case
    assert file in line, case
    assert "\n" not in line, case
    assert len(line) < LONGEST, case
    assert result.stdout == "", case
    assert tree(place) == before, case
