"""Atomic file writing."""

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
from sagline.files.reading import kind_of

LONGEST = 120  # bytes: with the words and the suffix that follow it stays below the 255 of common file systems
UNNAMED = "robot"
_DEVICES = re.compile(r"(con|prn|aux|nul|com[\d¹²³]|lpt[\d¹²³])(\..*)?", re.IGNORECASE)  # in every folder of Windows


def file_stem(name: str, *words: str) -> str:
    """A name for files of a robot, without a suffix: never a path, never empty, hidden, too long or a device.

    Letters and digits of all scripts, dots, hyphens and underscores stay, and spaces become hyphens. Where anything
    else was in the name, or it was too long, eight digits of its digest follow, so that two robots do not share files.

    Args:
        name: What the robot is called; any text.
        *words: What else the file is about, "catenary" or "poses": letters, digits and hyphens.

    Returns:
        The name, its parts joined by hyphens.

    Examples:
        >>> from sagline.files.writing import file_stem
        >>> file_stem("hall camera", "catenary")
        'hall-camera-catenary'
        >>> file_stem("../../evil", "poses")
        'evil-0fbfd372-poses'
    """
    plain = unicodedata.normalize("NFC", name)
    spaced = "".join(c if _stays(c) else " " for c in plain)
    stem = _cut("-".join(spaced.split())).strip(".-")
    if _DEVICES.fullmatch(stem):
        stem = f"{UNNAMED}-{stem}"
    if not stem or stem != "-".join(plain.split(" ")):
        stem = f"{stem or UNNAMED}-{sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"
    return "-".join((stem, *words))


def _stays(character: str) -> bool:
    return character in "._-" or unicodedata.category(character)[0] in "LMN"  # letters, their marks, numbers


def _cut(text: str) -> str:
    return text.encode()[:LONGEST].decode(errors="ignore")


PREFIX, SUFFIX = ".sagline-", ".part"
LOCK = "lock"  # held as long as the folder is in use: the system frees it, however the process ends
TRIES = 100


@contextmanager
def staging(folder: Path) -> Iterator[Path]:
    """A folder of its own inside a folder, to write to; it is gone when the block ends.

    What processes that were killed have left there is removed first.

    Args:
        folder: Where; its file system is that of the files to be, so that a file can be moved in one step.

    Yields:
        The new folder.

    Raises:
        OSError: If it cannot be created.
    """
    for left in folder.glob(f"{PREFIX}*{SUFFIX}"):
        _remove_if_left(left)
    place, lock = _new_place(folder)
    try:
        yield place
    finally:
        os.close(lock)
        shutil.rmtree(place, ignore_errors=True)


def _new_place(folder: Path) -> tuple[Path, int]:
    """A new folder and the lock that says that it is in use; one that another process takes for left is given up."""
    for _ in range(TRIES):
        place = Path(tempfile.mkdtemp(prefix=PREFIX, suffix=SUFFIX, dir=folder))
        try:
            lock = _opened(place)
        except FileNotFoundError:
            continue
        if is_taken(lock, if_unknown=True) and os.fstat(lock).st_nlink:
            return place, lock
        os.close(lock)
    raise TimeoutError(f"other processes remove what is written in {folder}")


def _remove_if_left(place: Path) -> None:
    """Remove a folder that nobody is using any more; one that cannot be removed stays."""
    with suppress(OSError):
        if place.is_symlink():
            return
        lock = _opened(place)
        if is_taken(lock, if_unknown=False):
            shutil.rmtree(place, ignore_errors=True)
        os.close(lock)


def _opened(place: Path) -> int:
    flags = os.O_RDWR | os.O_CREAT
    for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC"):  # neither a link nor a fifo planted there does harm
        flags |= getattr(os, name, 0)
    return os.open(place / LOCK, flags, 0o600)


def is_taken(lock: int, *, if_unknown: bool) -> bool:
    """Whether a lock could be taken: False where another process holds it.

    Args:
        lock: The open file.
        if_unknown: The answer where the file system, or Windows, knows no locks.
    """
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


_finished: ContextVar[list[Path] | None] = ContextVar("finished", default=None)


@contextmanager
def written_whole(file: os.PathLike[str] | str, size: int = 0) -> Iterator[Path]:
    """A place to write to that becomes the file only when the block ends well.

    The block writes to a new file beside the real one. When it ends, that file is flushed to the disk and takes the
    real one's name in one step; when it fails or is interrupted, it is removed and whatever was there before stays.

    Args:
        file: The file to be.
        size: Bytes it will have or more; that they fit is found out before the block begins.

    Yields:
        Path of the file to write; it exists and is empty.

    Raises:
        FileError: If the name is taken by something that is no regular file, the folder is missing or cannot be
            written, or the disk is full.
    """
    target = check_file(file)
    with written_together(target.parent, [target.name], size) as (partial,):
        yield partial


@contextmanager
def written_together(folder: os.PathLike[str] | str, names: Sequence[str], size: int = 0) -> Iterator[tuple[Path, ...]]:
    """Places to write to that become files of one folder together, only when the block ends well.

    Args:
        folder: The folder; it exists.
        names: Names of the files to be.
        size: Bytes that they will have or more.

    Yields:
        Path of each file to write; they exist and are empty.

    Raises:
        FileError: As for `written_whole`; then none of them has been written.
    """
    targets = [check_file(Path(folder) / name) for name in names]
    try:
        with staging(Path(folder)) as place:
            parts = tuple(place / f"{k}{SUFFIX}" for k in range(len(targets)))
            for part in parts:
                part.touch()
            _find_room(place / "room", size)
            yield parts
            for part, target in zip(parts, targets, strict=True):
                _complete(part, target)
            old, new = [str(part) for part in parts], [str(target) for target in targets]
            list(map(os.replace, old, new))  # all of it runs in C: Ctrl-C does not get between two names
    except OSError as error:
        target = _blamed(error, targets)
        raise FileError(target, f"cannot be written ({_reason(error)})", _next_step(target)) from error
    finished = _finished.get()
    if finished is not None:
        finished.extend(targets)


def write_text(file: os.PathLike[str] | str, text: str) -> None:
    """Write a text in UTF-8, whole or not at all.

    Args:
        file: The file; one that exists is replaced.
        text: What is to stand in it.

    Raises:
        FileError: If the file cannot be written, or the text holds half a character; what was there before is
            untouched.
    """
    try:
        content = text.encode()
    except UnicodeEncodeError as error:
        found = f"U+{ord(text[error.start]):04X} in {text[max(0, error.start - 20) : error.start]!r}…"
        step = "Correct the name or note it comes from."
        raise FileError(Path(file), f"cannot hold half a character ({found})", step) from None
    with written_whole(file) as partial:
        partial.write_bytes(content)


@contextmanager
def finished_files() -> Iterator[list[Path]]:
    """What gets finished while inside: what there is to name when something after it fails.

    Yields:
        The files written whole so far, in order; it grows.
    """
    files: list[Path] = []
    token = _finished.set(files)
    try:
        yield files
    finally:
        _finished.reset(token)


def check_file(file: os.PathLike[str] | str) -> Path:
    """Refuse a name that a file could not be written to, without touching it.

    Args:
        file: The file to be.

    Returns:
        Its path.

    Raises:
        FileError: If the name is taken by something other than a regular file that may be written, or is no name.
    """
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
    if kind := kind_of(mode):
        raise FileError(target, f"is {kind.text}", kind.next_step)
    if not os.access(target, os.W_OK):
        raise FileError(target, "is write-protected", "Change its permissions, or give another name.")
    return target


def check_files(folder: os.PathLike[str] | str, names: Iterable[str]) -> None:
    """Refuse files that could not be written to a folder, without touching anything.

    Args:
        folder: The folder; it need not exist.
        names: Names of the files to be.

    Raises:
        FileError: If the folder cannot be written to, or a name is taken by something that is no file.
    """
    check_folder(folder)
    for name in names:
        check_file(Path(folder) / name)


def check_folder(folder: os.PathLike[str] | str) -> None:
    """Refuse a folder that files could not be written to, without creating it.

    Args:
        folder: The folder; it need not exist.

    Raises:
        FileError: If it is no folder, or neither it nor the nearest folder above it can be written.
    """
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
        except (OSError, ValueError) as error:  # a name that is too long, or holds a zero byte
            raise FileError(path, f"cannot be created ({_reason(error)})", "Name another folder.") from None


def made_folder(folder: os.PathLike[str] | str) -> Path:
    """The folder, created with everything above it where it is missing.

    Args:
        folder: The folder.

    Returns:
        Its path.

    Raises:
        FileError: If it cannot be created.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise FileError(path, f"cannot be created ({_reason(error)})", "Name another folder.") from None
    return path


def _find_room(file: Path, size: int) -> None:
    """Find out that the disk holds so many bytes: HDF5 crashes on a full one."""
    if size and hasattr(os, "posix_fallocate"):
        with file.open("wb") as handle:
            os.posix_fallocate(handle.fileno(), 0, size)
        file.unlink()


def _complete(part: Path, target: Path) -> None:
    """Give a file the permissions of the one it replaces, and have all of it on the disk."""
    if target.is_file():
        shutil.copymode(target, part)
    with part.open("rb+") as handle:
        os.fsync(handle.fileno())


def _blamed(error: OSError, targets: Sequence[Path]) -> Path:
    """The file that an error is about, by the name of its part; the first if it does not say."""
    name = Path(str(error.filename)).name.removesuffix(SUFFIX)
    return targets[int(name)] if name.isdecimal() and int(name) < len(targets) else targets[0]


def _reason(error: Exception) -> str:
    reason: str = getattr(error, "strerror", None) or str(error)  # HDF5 gives a text and no number
    return next(iter(reason.splitlines()), type(error).__name__)


def _next_step(target: Path) -> str:
    if not target.parent.is_dir():
        return f"Create the folder {target.parent} first, or name another."
    return "Check the permissions of its folder and the space on the disk, or name another folder."


_OTHERS = re.compile(r"[^\n -~]+")  # beside ASCII that prints; json escapes what of it is below the space


def plain(what: Any) -> Any:
    """What JSON knows: arrays as lists, keys and paths as texts, None for numbers that are not finite.

    Args:
        what: Dictionaries, sequences, arrays, numbers, texts and paths, in one another.

    Returns:
        The same in dictionaries, lists, numbers, texts and None; anything else is left for `json` to refuse.
    """
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
    """One JSON document, for `plain` data and all that `plain` makes so; safe for a terminal, whatever texts hold.

    Args:
        what: As for `plain`.

    Returns:
        The document, without a line end.

    Raises:
        TypeError: If something in it has no form in JSON.
    """
    text = json.dumps(plain(what), indent=2, ensure_ascii=False, allow_nan=False)
    return _OTHERS.sub(lambda found: "".join(c if is_seen(c) else json.dumps(c)[1:-1] for c in found[0]), text)
