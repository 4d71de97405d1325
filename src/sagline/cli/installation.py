"""`sagline examples` and `sagline cache`: the files of the examples, and the compiled kernels."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from shlex import quote

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output
from sagline.cli.terminal import show_json, show_note, show_text
from sagline.core.numbers import counted, n
from sagline.files.writing import atomic_file, create_folder

KINDS = (".py", ".yaml", ".csv", ".wcrfx")


def examples(folder: Path = opt.out(Path("sagline-examples")), force: bool = opt.FORCE) -> None:
    """Write the files that the examples of the documentation use: a robot, a path, lengths, measurements and scripts.

    For example:

        sagline examples --out DIR
        cd DIR
        sagline track own_robot.yaml own_path.yaml
    """
    sources = _example_files()
    names = [file.name for file in sources]
    Output(opt.data_files(folder, table=False), "", names)  # raises an error if a file cannot be written
    existing = [name for name in names if (folder / name).exists()]
    if existing and not force:
        step = "Choose another folder with --out, or replace it with --force."
        raise sl.FileError(folder / existing[0], "exists", step)
    create_folder(folder)
    for file in sources:
        with atomic_file(folder / file.name) as partial:
            shutil.copyfile(file, partial)
    show_text(f"In {folder.resolve()}: {', '.join(names)}", whole=True)
    show_text(f"Try: cd {quote(str(folder))}; sagline track own_robot.yaml own_path.yaml", whole=True)


def _example_files() -> list[Path]:
    """Example files, which are next to the installed modules, or next to `docs` in the source tree."""
    inside = Path(str(files("sagline"))) / "examples"
    folder = inside if inside.is_dir() else Path(__file__).parents[3] / "examples"
    return sorted(file for file in folder.glob("*") if file.suffix in KINDS)


def cache(clear: bool = opt.flag(False, "Remove the files.", "--clear"), as_json: bool = opt.JSON) -> int:
    """Show and check the folder of the kernels that numba has compiled, or remove the files in this folder.

    The folder is used if SAGLINE_BACKEND is numba, or if the installation has no compiled library. Damaged files are
    never used, and the next run replaces them. Exit code 1 if there are damaged files.

    For example:

        sagline cache
        sagline cache --clear
    """
    from sagline.kernels.sources import SUFFIX, base_folder

    folder = base_folder()
    files = [file for file in sorted(folder.glob(f"*/*{SUFFIX}*")) if file.is_file() and not file.parent.is_symlink()]
    sizes, damaged = [file.stat().st_size for file in files], [file for file in files if not _is_whole(file)]
    if clear:
        _remove(files)
    if as_json:
        found = {"backend": sl.backend(), "folder": folder, "files": len(files), "bytes": sum(sizes)}
        show_json({**found, "damaged": damaged, "writable": _is_writable(folder), "cleared": clear})
    else:
        access = "" if _is_writable(folder) else ", which cannot be written, so each run compiles its kernels"
        show_text(f"Back end of the kernels: {sl.backend()}", whole=True)
        show_text(f"Folder: {folder}{access}", whole=True)
        show_text(f"{counted(len(files), 'file')}, {n(sum(sizes) / 1e6, '.3g', 'MB')}{', removed' * clear}")
        for file in damaged:
            show_note("Damaged: ", str(file), style="bold red")
    return OUTSIDE if damaged and not clear else 0


def _is_whole(file: Path) -> bool:
    """True if the content of `file` agrees with its digest. False for damaged and unfinished files."""
    from sagline.kernels.sources import SUFFIX, is_whole

    try:
        return file.suffix == SUFFIX and is_whole(file.read_bytes())
    except OSError:
        return False


def _is_writable(folder: Path) -> bool:
    """True if files can be written to `folder`, or if `folder` can be created."""
    nearest = next(place for place in (folder, *folder.parents) if place.exists())
    return nearest.is_dir() and os.access(nearest, os.W_OK | os.X_OK)


def _remove(files: list[Path]) -> None:
    """Remove `files`, and their folders if these are then empty."""
    for file in files:
        try:
            file.unlink(missing_ok=True)
        except OSError as error:
            step = "Check the permissions of its folder."
            raise sl.FileError(file, f"cannot be removed ({error.strerror})", step) from None
    for folder in {file.parent for file in files}:
        with suppress(OSError):  # another process has written a file into the folder
            folder.rmdir()
