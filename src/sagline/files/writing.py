"""Atomic file writing, names of files, and JSON text."""

# A new file is written next to its target and then renamed in one step, so that the target is always complete. Folders,
# devices, pipes, sockets and links are refused as targets. The parent folders may be links. The new file has the
# permissions of the replaced file. If the replaced file had other hard links, they keep the old content.

from __future__ import annotations

import json
import math
import os
import re
import shutil
import stat
import sys
import tempfile
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from sagline.core.errors import FileError, is_seen
from sagline.files.reading import check_regular

LONGEST = 120  # longest name [bytes]; with a suffix, it is below the common limit of 255
UNNAMED = "robot"
LOCK = "lock"  # file that is locked while the folder is in use; the system releases the lock when the process ends
TRIES = 100
_finished: ContextVar[list[Path] | None] = ContextVar("finished", default=None)
_OTHERS = re.compile(r"[^\n -~]+")  # neither printable ASCII nor a line feed; json escapes control characters
PREFIX, SUFFIX = ".sagline-", ".part"
_DEVICES = re.compile(r"(con|prn|aux|nul|com[\d¹²³]|lpt[\d¹²³])(\..*)?", re.IGNORECASE)  # reserved names on Windows


def file_stem(name: str, *words: str) -> str:
    """File name for a robot, without a suffix. The name is never empty, hidden, too long, a path, or a device."""
    # Letters and digits of all scripts, dots, hyphens and underscores are kept; spaces become hyphens. If the name has
    # other characters or is too long, eight digits of its digest are added, so that two robots never have the same
    # files.
    plain = unicodedata.normalize("NFC", name)
    # categories: letters, marks, numbers
    spaced = "".join(c if c in "._-" or unicodedata.category(c)[0] in "LMN" else " " for c in plain)
    stem = "-".join(spaced.split()).encode()[:LONGEST].decode(errors="ignore").strip(".-")
    if _DEVICES.fullmatch(stem):
        stem = f"{UNNAMED}-{stem}"
    if not stem or stem != "-".join(plain.split(" ")):
        stem = f"{stem or UNNAMED}-{sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"
    return "-".join((stem, *words))


@contextmanager
def staging(folder: Path) -> Iterator[Path]:
    """Create a temporary folder inside a folder, and remove it at the end of the block."""
    # Folders left by killed processes are removed first
    for left in folder.glob(f"{PREFIX}*{SUFFIX}"):
        _remove_if_left(left)
    place, lock = _new_place(folder)
    try:
        yield place
    finally:
        os.close(lock)
        shutil.rmtree(place, ignore_errors=True)


def _new_place(folder: Path) -> tuple[Path, int]:
    """Create a locked folder. If another process removes the folder before it is locked, create another folder."""
    for _ in range(TRIES):
        place = Path(tempfile.mkdtemp(prefix=PREFIX, suffix=SUFFIX, dir=folder))
        try:
            lock = _open_lock(place)
        except FileNotFoundError:
            continue
        if try_lock(lock, if_unknown=True) and os.fstat(lock).st_nlink:
            return place, lock
        os.close(lock)
    raise TimeoutError(f"other processes remove what is written in {folder}")


def _remove_if_left(place: Path) -> None:
    """Remove a folder if no process uses it. A folder that cannot be removed is ignored."""
    with suppress(OSError):
        if place.is_symlink():
            return
        lock = _open_lock(place)
        if try_lock(lock, if_unknown=False):
            shutil.rmtree(place, ignore_errors=True)
        os.close(lock)


def _open_lock(place: Path) -> int:
    flags = os.O_RDWR | os.O_CREAT
    for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC"):  # protects against a link or a pipe at this path
        flags |= getattr(os, name, 0)
    return os.open(place / LOCK, flags, 0o600)


def try_lock(lock: int, *, if_unknown: bool) -> bool:
    """True if an open file could be locked. On systems without locks, `if_unknown` is returned."""
    if sys.platform == "win32":
        return if_unknown
    import fcntl

    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return if_unknown
    return True


@contextmanager
def atomic_file(file: os.PathLike[str] | str, size: int = 0) -> Iterator[Path]:
    """Provide a temporary file, which replaces `file` when the block ends without an error."""
    # The block writes to a new file in the folder of the target. At its end the new file is flushed to the disk and
    # renamed in one step. If the block fails or is interrupted, the new file is removed and the target is unchanged.
    target = check_file(file)
    with atomic_files(target.parent, [target.name], size) as (partial,):
        yield partial


@contextmanager
def atomic_files(folder: os.PathLike[str] | str, names: Sequence[str], size: int = 0) -> Iterator[tuple[Path, ...]]:
    """Provide temporary files, which together replace files of a folder when the block ends without an error."""
    targets = [check_file(Path(folder) / name) for name in names]
    try:
        with staging(Path(folder)) as place:
            parts = tuple(place / f"{k}{SUFFIX}" for k in range(len(targets)))
            for part in parts:
                part.touch()
            _check_space(place / "room", size)
            yield parts
            for part, target in zip(parts, targets, strict=True):
                _finish(part, target)
            old, new = [str(part) for part in parts], [str(target) for target in targets]
            list(map(os.replace, old, new))  # this loop runs in C: Ctrl-C cannot interrupt it between two names
    except OSError as error:
        target = _target_of(error, targets)
        raise FileError(target, f"cannot be written ({_reason(error)})", _next_step(target)) from error
    finished = _finished.get()
    if finished is not None:
        finished.extend(targets)


def write_text(file: os.PathLike[str] | str, text: str) -> None:
    """Write a text in UTF-8 atomically."""
    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        found = f"U+{ord(text[error.start]):04X} in {text[max(0, error.start - 20) : error.start]!r}…"
        reason = f"cannot be written: the text has an incomplete character ({found})"
        raise FileError(Path(file), reason, "Correct the name or note that contains it.") from None
    with atomic_file(file) as partial:
        partial.write_bytes(content)


@contextmanager
def finished_files() -> Iterator[list[Path]]:
    """Collect the paths of all files that are completed inside the block, in order."""
    files: list[Path] = []
    token = _finished.set(files)
    try:
        yield files
    finally:
        _finished.reset(token)


def check_file(file: os.PathLike[str] | str) -> Path:
    """Refuse `file` if no file can be written at this path. Nothing is changed."""
    target = Path(file)
    try:
        mode = target.lstat().st_mode
    except FileNotFoundError:
        return target
    except (OSError, ValueError) as error:  # ValueError: a zero byte, half a character
        raise FileError(target, f"cannot be written ({_reason(error)})", _next_step(target)) from None
    if stat.S_ISLNK(mode):
        leads = os.readlink(target)
        raise FileError(target, f"is a link, to {leads}", "Name the file itself, or remove the link.")
    check_regular(target, mode)
    if not os.access(target, os.W_OK):
        raise FileError(target, "is write-protected", "Change its permissions, or give another name.")
    return target


def check_files(folder: os.PathLike[str] | str, names: Iterable[str]) -> None:
    """Refuse `folder` and `names` if one of the files cannot be written there. Nothing is changed."""
    check_folder(folder)
    for name in names:
        check_file(Path(folder) / name)


def check_folder(folder: os.PathLike[str] | str) -> None:
    """Refuse a folder in which no files can be written. A missing folder is not created."""
    path = Path(folder).absolute()
    nearest = next(place for place in (path, *path.parents) if os.path.lexists(place))
    if not nearest.is_dir():
        raise FileError(path, f"cannot be written ({nearest} is a file, not a folder)", "Name another folder.")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise FileError(path, f"cannot be written (no permission in {nearest})", "Name another folder.")
    for part in path.relative_to(nearest).parts:
        try:
            os.lstat(nearest / part)
        except FileNotFoundError:
            pass
        except (OSError, ValueError) as error:  # a name that is too long, or contains a zero byte
            raise FileError(path, f"cannot be created ({_reason(error)})", "Name another folder.") from None


def create_folder(folder: os.PathLike[str] | str, *, parents: bool = True) -> Path:
    """Create the folder if it is missing. Unless `parents` is True, raise an error if parent folders are missing."""
    path = Path(folder)
    try:
        path.mkdir(parents=parents, exist_ok=True)
    except (OSError, ValueError) as error:
        step = "Name another folder." if path.parent.is_dir() or parents else _next_step(path)
        raise FileError(path, f"cannot be created ({_reason(error)})", step) from None
    return path


def _check_space(file: Path, size: int) -> None:
    """Check that `size` bytes are free on the disk, because HDF5 crashes on a full disk."""
    if size and hasattr(os, "posix_fallocate"):
        with file.open("wb") as handle:
            os.posix_fallocate(handle.fileno(), 0, size)
        file.unlink()


def _finish(part: Path, target: Path) -> None:
    """Set the permissions of the replaced file, and flush the new file to the disk."""
    if target.is_file():
        shutil.copymode(target, part)
    with part.open("rb+") as handle:
        os.fsync(handle.fileno())


def _target_of(error: OSError, targets: Sequence[Path]) -> Path:
    """Target to which an error belongs, found from the temporary file in the error; the first target if unknown."""
    name = Path(str(error.filename)).name.removesuffix(SUFFIX)
    return targets[int(name)] if name.isdecimal() and int(name) < len(targets) else targets[0]


def _reason(error: Exception) -> str:
    reason: str = getattr(error, "strerror", None) or str(error)  # errors of HDF5 have only a text, no error number
    return next(iter(reason.splitlines()), type(error).__name__)


def _next_step(target: Path) -> str:
    if not target.parent.is_dir():
        return f"Create the folder {target.parent} first, or name another."
    return "Check the permissions of its folder and the space on the disk, or name another folder."


def plain(what: Any) -> Any:
    """Convert data for JSON: arrays to lists, keys and paths to texts, numbers that are not finite to None."""
    match what:
        case dict():
            return {str(key): plain(value) for key, value in what.items()}
        case list() | tuple():
            return [plain(value) for value in what]
        case np.ndarray() | np.generic():
            return plain(what.tolist())
        case float():
            return what if math.isfinite(what) else None
        case PurePath():
            return str(what)
        case _:
            return what


def json_text(what: Any) -> str:
    """JSON document of data that `plain` accepts. Control characters are escaped, because a terminal may obey them."""
    text = json.dumps(plain(what), indent=2, ensure_ascii=False, allow_nan=False)
    return _OTHERS.sub(lambda found: "".join(c if is_seen(c) else json.dumps(c)[1:-1] for c in found[0]), text)
