"""Where compiled kernels are kept."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, cast

import numba
import pytest

from sagline.kernels import jit


@pytest.fixture
def copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The kernels' sources once more, as if they were the ones in use."""
    copy = tmp_path / "kernels"
    shutil.copytree(Path(jit.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(jit, "__file__", str(copy / "jit.py"))
    return copy


def test_the_cache_folder_follows_the_sources(copy: Path) -> None:
    """An edited callee in another file must not run stale machine code: its folder has another name."""
    assert jit.cache_folder() == jit.FOLDER
    for nested in ("codes.py", "algebra/hyperbolic.py", "sharing/polygon.py"):
        before = jit.cache_folder()
        with (copy / nested).open("a") as stream:
            stream.write("# edited\n")
        assert jit.cache_folder() != before


def test_the_cache_folder_follows_files_that_come_go_and_move(copy: Path) -> None:
    names = [jit.cache_folder()]
    (copy / "algebra" / "new.py").write_text("# new\n")
    names.append(jit.cache_folder())
    (copy / "algebra" / "new.py").rename(copy / "sharing" / "new.py")
    names.append(jit.cache_folder())
    (copy / "sharing" / "new.py").rename(copy / "sharing" / "other.py")
    names.append(jit.cache_folder())
    assert len(set(names)) == 4
    (copy / "sharing" / "other.py").unlink()
    assert jit.cache_folder() == names[0]
    (copy / "algebra" / "notes.txt").write_text("no source\n")
    assert jit.cache_folder() == names[0]


def test_the_cache_folder_can_be_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert jit.cache_folder().parent == tmp_path


def test_other_users_of_numba_keep_their_cache_folder() -> None:
    assert str(jit.FOLDER) != getattr(numba.config, "CACHE_DIR")  # noqa: B009


def test_an_entry_is_compiled_when_its_own_machine_code_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sagline.kernels.cable.batch import batch_end

    monkeypatch.setattr(jit, "FOLDER", tmp_path)
    (tmp_path / "cable").mkdir()
    (tmp_path / "cable" / "batch.batch_from_length-9.py311.1.nbc").touch()  # another's
    assert not jit.is_compiled(batch_end)
    (tmp_path / "cable" / "batch.batch_end-9.py311.nbi").touch()  # an index without code
    assert not jit.is_compiled(batch_end)
    (tmp_path / "cable" / "batch.batch_end-9.py311.1.nbc").touch()
    assert jit.is_compiled(batch_end)
    assert not jit.is_compiled(batch_end, versions=2)


def test_inner_kernels_have_no_wrapper_for_python_and_entries_have() -> None:
    from sagline.kernels.algebra.cholesky import factor_positive
    from sagline.kernels.cable.batch import batch_end

    inner, entry = (cast("Any", kernel).targetoptions for kernel in (factor_positive, batch_end))
    assert inner["no_cpython_wrapper"]
    assert "no_cpython_wrapper" not in entry
    assert entry["nogil"]
