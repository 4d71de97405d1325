"""Where compiled kernels are kept."""

from __future__ import annotations

import shutil
from pathlib import Path

import numba
import pytest

from sagline.kernels import jit


def test_the_cache_folder_follows_the_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An edited callee in another file must not run stale machine code: its folder has another name."""
    sources = Path(jit.__file__).parent
    copy = tmp_path / "kernels"
    shutil.copytree(sources, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(jit, "__file__", str(copy / "jit.py"))
    assert jit.cache_folder() == jit.FOLDER
    with (copy / "hyperbolic.py").open("a") as stream:
        stream.write("# edited\n")
    assert jit.cache_folder() != jit.FOLDER


def test_the_cache_folder_can_be_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert jit.cache_folder().parent == tmp_path


def test_other_users_of_numba_keep_their_cache_folder() -> None:
    assert str(jit.FOLDER) != getattr(numba.config, "CACHE_DIR")  # noqa: B009
