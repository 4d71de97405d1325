"""Folders of kernels compiled by numba."""

from __future__ import annotations

import ast
import errno
import os
import shutil
from pathlib import Path
from typing import Any, cast

import numba
import pytest

from sagline.kernels import sources
from sagline.kernels.with_numba import kept


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The kernels' sources once more."""
    copy = tmp_path / "kernels"
    shutil.copytree(sources.SOURCES, copy, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def test_the_cache_folder_follows_all_sources_that_are_compiled(copy: Path) -> None:
    """An edited callee in another file must not run stale machine code: its folder has another name."""
    assert sources.cache_folder("inverse.poses", copy) == sources.cache_folder("inverse.poses")
    for nested in ("codes.py", "jit.py", "algebra/functions.py", "tension/polygon.py", "inverse/poses.py"):
        before = [sources.cache_folder(module, copy) for module in ("inverse.poses", "tests")]
        with (copy / nested).open("a") as stream:
            stream.write("# edited\n")
        after = [sources.cache_folder(module, copy) for module in ("inverse.poses", "tests")]
        assert not set(before) & set(after)


def test_the_cache_folder_stays_where_another_kernel_is_edited(copy: Path) -> None:
    for nested in ("forward/newton.py", "interference/shapes.py"):
        with (copy / nested).open("a") as stream:
            stream.write("# edited\n")
    assert sources.cache_folder("inverse.poses", copy) == sources.cache_folder("inverse.poses")
    assert sources.cache_folder("forward.forward", copy) != sources.cache_folder("forward.forward")


def test_nothing_that_a_kernel_imports_is_overlooked() -> None:
    """By Python's own reading of the sources: every import of a kernel is a `from` at the beginning of a line."""
    for file in set(sources.SOURCES.rglob("*.py")) - sources.BACK_ENDS:
        expected = {file}
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                assert not any(alias.name.startswith("sagline") for alias in node.names), file
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(sources.KERNELS):
                module = (node.module or "").removeprefix(sources.KERNELS).lstrip(".")
                for name in (module, *(f"{module}.{alias.name}".lstrip(".") for alias in node.names)):
                    source = sources.SOURCES.joinpath(*name.split(".")).with_suffix(".py")
                    expected |= {source} - sources.BACK_ENDS if source.is_file() else set()
            assert not (isinstance(node, ast.ImportFrom) and node.level), file
        module = ".".join(file.relative_to(sources.SOURCES).with_suffix("").parts)
        assert expected <= sources.sources_of(module, sources.SOURCES), file


def test_the_cache_folder_can_be_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert sources.base_folder().parent == tmp_path


def test_other_users_of_numba_keep_their_cache_folder() -> None:
    assert not str(getattr(numba.config, "CACHE_DIR")).startswith(str(sources.FOLDER))  # noqa: B009


def doubled(value: float) -> float:
    return 2.0 * value


def cached_in(folder: Path) -> Any:
    """The function above as a new process would have it: compiled, or read from a folder."""
    return kept(numba.njit(doubled), folder)


def test_machine_code_is_read_again_wherever_its_source_lies(tmp_path: Path) -> None:
    assert cached_in(tmp_path)(2.0) == 4.0
    again = cached_in(tmp_path)
    assert again(2.0) == 4.0
    assert sum(again.stats.cache_hits.values()) == 1


@pytest.mark.parametrize("damage", ["flipped", "cut", "empty"])
def test_a_damaged_file_is_noticed_and_replaced(
    tmp_path: Path, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cached_in(tmp_path)(2.0) == 4.0
    (file,) = tmp_path.iterdir()
    content = file.read_bytes()
    middle = len(content) // 2
    flipped = content[:middle] + bytes([content[middle] ^ 16]) + content[middle + 1 :]
    file.write_bytes({"flipped": flipped, "cut": content[:middle], "empty": b""}[damage])
    again = cached_in(tmp_path)
    assert again(2.0) == 4.0
    assert not again.stats.cache_hits
    assert str(file) in capsys.readouterr().err
    assert sum(1 for _ in tmp_path.iterdir()) == 1
    last = cached_in(tmp_path)
    assert last(2.0) == 4.0
    assert last.stats.cache_hits


def test_a_folder_that_cannot_be_written_costs_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    for value in (2.0, 2):  # two versions
        assert cached_in(tmp_path / "file" / "kernels")(value) == 4.0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert str(tmp_path / "file") in lines[0]
    assert "NUMBA_CACHE_DIR" in lines[0]


def test_a_full_disk_costs_one_line_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(file: Path, content: bytes) -> None:
        with file.open("wb") as stream:
            stream.write(content[:100])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    assert cached_in(tmp_path)(2.0) == 4.0
    assert os.strerror(errno.ENOSPC) in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_inner_kernels_have_no_wrapper_for_python_and_entries_have() -> None:
    from sagline.kernels.algebra.factors import factor_positive
    from sagline.kernels.cable.batch import batch_from_length

    inner, entry = (cast("Any", kernel).targetoptions for kernel in (factor_positive, batch_from_length))
    assert inner["no_cpython_wrapper"]
    assert "no_cpython_wrapper" not in entry
    assert entry["nogil"]
