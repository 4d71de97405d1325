"""`sagline cache`: the folder with the kernels that numba has compiled."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Annotated

from sagline.cli.ending import OUTSIDE
from sagline.cli.options import JsonOption, flag
from sagline.cli.terminal import show_json, show_note, show_text
from sagline.core.errors import FileError
from sagline.core.numbers import counted, n


def cache(
    clear: Annotated[bool, flag("Remove the files.", "--clear")] = False,
    as_json: JsonOption = False,
) -> int:
    """Show and check the folder with the kernels that numba has compiled, or remove its files.

    The folder is used if SAGLINE_BACKEND is numba, or if the installation has no compiled library. Damaged files are
    never used, and the next run replaces them. Exit code 1 if there are damaged files.

    For example:

        sagline cache
        sagline cache --clear
    """
    from sagline.kernels.jit import backend
    from sagline.kernels.sources import SUFFIX, base_folder

    folder = base_folder()
    files = [file for file in sorted(folder.glob(f"*/*{SUFFIX}*")) if file.is_file() and not file.parent.is_symlink()]
    sizes, damaged = [file.stat().st_size for file in files], [file for file in files if not _is_whole(file)]
    if clear:
        _remove(files)
    if as_json:
        found = {"backend": backend(), "folder": folder, "files": len(files), "bytes": sum(sizes)}
        show_json({**found, "damaged": damaged, "writable": _is_writable(folder), "cleared": clear})
    else:
        access = "" if _is_writable(folder) else ", which cannot be written, so each run compiles its kernels"
        show_text(f"Back end of the kernels: {backend()}", whole=True)
        show_text(f"Folder: {folder}{access}", whole=True)
        show_text(f"{counted(len(files), 'file')}, {n(sum(sizes) / 1e6, '.3g', 'MB')}{', removed' * clear}")
        for file in damaged:
            show_note("Damaged: ", str(file), style="bold red")
    return OUTSIDE if damaged and not clear else 0


def _is_whole(file: Path) -> bool:
    """True if a file's content agrees with its digest; False for damaged and for unfinished files."""
    from sagline.kernels.sources import SUFFIX, is_whole

    try:
        return file.suffix == SUFFIX and is_whole(file.read_bytes())
    except OSError:
        return False


def _is_writable(folder: Path) -> bool:
    """True if files can be written to a folder, or if the folder can be created."""
    nearest = next(place for place in (folder, *folder.parents) if place.exists())
    return nearest.is_dir() and os.access(nearest, os.W_OK | os.X_OK)


def _remove(files: list[Path]) -> None:
    """Remove files, and the folders that are empty afterwards."""
    for file in files:
        try:
            file.unlink(missing_ok=True)
        except OSError as error:
            raise FileError(
                file, f"cannot be removed ({error.strerror})", "Check the permissions of its folder."
            ) from None
    for folder in {file.parent for file in files}:
        with suppress(OSError):  # another process has written a file into the folder
            folder.rmdir()
