"""`sagline cache`: contents of the folder, damaged files, and removal of files of sagline only."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from sagline.cli.main import app
from sagline.kernels.sources import SUFFIX


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    return tmp_path / "numba" / "kernels"


def sagline(*words: str) -> Any:
    return CliRunner().invoke(app, ["cache", *words])


def fill(folder: Path) -> dict[str, Path]:
    (folder / "one").mkdir(parents=True)
    (folder / "two").mkdir()
    names = {"whole": f"one/a{SUFFIX}", "flipped": f"one/b{SUFFIX}", "empty": f"two/c{SUFFIX}"}
    names |= {"torn": f"two/c{SUFFIX}.1f", "foreign": "two/mine.txt"}
    files = {key: folder / name for key, name in names.items()}
    content = b"machine code"
    good = hashlib.sha256(content).digest() + content
    for key, data in {"whole": good, "flipped": good[:-1] + b"f", "empty": b"", "torn": good, "foreign": b"x"}.items():
        files[key].write_bytes(data)
    return files


def test_an_empty_folder_is_not_created(folder: Path) -> None:
    result = sagline("--json")
    found = json.loads(result.stdout)
    assert (result.exit_code, found["files"], found["bytes"], found["damaged"]) == (0, 0, 0, [])
    assert (found["folder"], found["writable"]) == (str(folder), True)
    assert not folder.parent.exists()


def test_damaged_files_are_named(folder: Path) -> None:
    files = fill(folder)
    result = sagline("--json")
    found = json.loads(result.stdout)
    assert (result.exit_code, found["files"], found["bytes"]) == (1, 4, 3 * (32 + 12))
    assert set(found["damaged"]) == {str(files[key]) for key in ("flipped", "empty", "torn")}
    text = sagline()
    assert text.exit_code == 1
    assert "4 files" in text.stdout
    assert text.stderr.count("Damaged: ") == 3


def test_clear_removes_the_files_of_sagline(folder: Path, tmp_path: Path) -> None:
    files = fill(folder)
    (tmp_path / "elsewhere").mkdir()
    kept = tmp_path / "elsewhere" / f"a{SUFFIX}"
    kept.write_bytes(b"x")
    (folder / "link").symlink_to(tmp_path / "elsewhere")
    assert sagline("--clear").exit_code == 0
    assert sorted(file for file in folder.rglob("*") if file.is_file()) == [files["foreign"]]
    assert not (folder / "one").exists()
    assert kept.exists()
    assert json.loads(sagline("--json").stdout)["files"] == 0
