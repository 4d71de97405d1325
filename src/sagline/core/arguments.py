"""Checks of arguments: instances, words, texts, whole numbers, indices, callbacks, paths, needed memory.

`sagline.core.arrays` checks numbers and arrays of numbers.
"""

from __future__ import annotations

import contextlib
import operator
import os
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from reprlib import Repr
from types import MappingProxyType
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from sagline.core.errors import FileError, InvalidValueError, NoBatchError, NoSuchEntryError, did_you_mean, printable

T = TypeVar("T")

# type name: sentence about the creation of an object of this type, the next step of messages about wrong types
HOW_TO_GET: Final = MappingProxyType(
    {
        "AnchorErrors": "Give AnchorErrors(deviation), for instance 0.01 m, or None.",
        "Axes": "Create them with matplotlib, or omit ax.",
        "Axes3D": 'Create them with add_subplot(projection="3d"), or omit ax.',
        "Box": "Give Box(size, center), in meters.",
        "Cable": "Give Cable(linear_density, axial_stiffness).",
        "CableModel": "Give a cable model, for instance Catenary().",
        "CableState": "Create one with a cable model: Catenary().from_tension(...).",
        "Calibration": "Create one: calibrate(robot, log).",
        "Confirmation": "Create one from a plan: confirm(plan).",
        "Creep": "Give Creep(axial_stiffness, time), or None.",
        "Criterion": "Give a criterion, for instance MaximumSag(0.05).",
        "Damping": "Give Damping(loss_time, air_damping, modal_damping), or None.",
        "Equilibrium": "Give the state of a plan, plan.state, or a robot and a pose.",
        "Front": 'Create one: design(robot, free, ["workspace_share"]).',
        "FrequencyMap": "Create one: frequency_map(robot, poses, up_to=20.0).",
        "Goal": 'Give a goal, for instance Goal("workspace_share").',
        "MeasuredTension": "Give MeasuredTension(frame_end_tension, tension_deviation, length_deviation).",
        "Path": "Create one, for instance with quintic_path(waypoints, speed=1.0).",
        "Plan": "Create one: inverse(robot, motion).",
        "Pose": "Give Pose(x, y, z), or a position [m] of three numbers.",
        "PoseBox": "Give PoseBox(low, high, tilt).",
        "Provenance": "Use robot.calibration of a calibrated robot, or None.",
        "Robot": 'Load one by name or file: load_robot("cogiro").',
        "Simulation": "Create one: simulate(plan).",
        "Sensors": "Give Sensors(length_deviation, tension_deviation), for instance 5e-4 m and 5 N.",
        "Shaper": "Create one for a frequency: ZV(2.0), ZVD(2.0) or EI(2.0).",
        "TensionMethod": "Give a tension method, for instance MinimumNorm().",
        "TensionPolygon": "Create one: tension_polygon(robot, pose).",
        "Vibration": "Create one: vibration(state, up_to=20.0).",
        "Workspace": "Create one: workspace(robot).",
        "WinchLog": 'Read one: load_log("winches.csv").',
        "Winch": "Give Winch(pulley_radius, dead_cable=...), or None.",
    }
)
LONGEST_TITLE: Final = 100  # largest number of characters of a name, because it becomes part of file names
LONGEST_NAME = 255  # largest number of bytes of a file name on common file systems
_PARTS = ("state", "pose", "robot", "plan", "path", "cables", "cable", "model", "tension")


class _Brief(Repr):
    """Converter to short texts for messages; a long text is replaced by the type of the object."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = 60
        self.maxlist = self.maxtuple = self.maxdict = self.maxset = self.maxfrozenset = self.maxdeque = 3
        self.maxlevel = 3

    def repr_instance(self, x: Any, level: int) -> str:
        if isinstance(x, np.ndarray) and x.size > 3:
            return f"an array of {x.dtype} of shape {x.shape}"
        # a result would compute its summary, which may take long
        short = getattr(type(x).__repr__, "__module__", "") == "sagline.core.results"
        if short or (type(x).__module__.startswith("sagline") and len(repr(x)) > self.maxother):
            return f"a {type(x).__name__}"
        return super().repr_instance(x, level)


def brief(value: object) -> str:
    """One-line text of a value for a message; the type of the value if the text is too long or raises an error."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    try:
        return printable(_Brief().repr(value))
    except Exception:  # `repr` of a caller's object may fail
        return f"one of type {type(value).__name__}"


def instance(value: object, kind: type[T], item: str) -> T:
    """Check that `value` has the type `kind`, and return it."""
    if isinstance(value, kind):
        return value
    raise InvalidValueError(item, brief(value), _a(kind.__name__), _step_to(value, kind))


def optional(value: object, kind: type[T], item: str) -> T | None:
    """Check that `value` is None or has the type `kind`, and return it."""
    return None if value is None else instance(value, kind, item)


def choice(value: Any, item: str, allowed: Iterable[str]) -> Any:
    """Check that `value` is one of the words `allowed`, and return it."""
    words = tuple(allowed)
    if isinstance(value, str) and value in words:
        return str(value)  # numpy has its own string type
    step = did_you_mean(value, words, f"Choose one of them as {item}.")
    raise InvalidValueError(item, brief(value), ", ".join(words), step)


def word_of(name: str) -> str:
    """Word for the class `name` on the command line: "minimum-norm" for "MinimumNorm"."""
    return re.sub("(?<!^)(?=[A-Z])", "-", name).lower()


def named(value: str | T, kind: type[T], kinds: Mapping[str, type[T]], item: str) -> T:
    """Object of type `kind` from `value`, which is such an object or a name of `kinds`, such as "minimum-norm"."""
    if not isinstance(value, str):
        return instance(value, kind, item)
    words = {word_of(name): kind for name, kind in kinds.items()}
    return words[choice(value, item, words)]()


def text(value: Any, item: str) -> str:
    """Check that `value` is a text, possibly with several lines, that a terminal can display."""
    if not isinstance(value, str):
        raise InvalidValueError(item, brief(value), "a text", f'Put {item} between quotes: "...".')
    if (flat := value.replace("\n", " ").replace("\t", " ")) != printable(flat):
        raise InvalidValueError(item, brief(value), "printable text", f"Remove the unprintable characters of {item}.")
    return str(value)  # numpy has its own string type


def label(value: Any, item: str) -> str:
    """Check that `value` is a name: one line of text for a terminal, a figure or a file name."""
    if isinstance(value, str) and not value.strip():
        raise InvalidValueError(item, "empty" if not value else "blank", "a non-empty text", f"Give a {item}.")
    if not isinstance(value, str) or len(value) > LONGEST_TITLE or value != printable(value):
        allowed = f"one line of printable text, at most {LONGEST_TITLE} letters"
        raise InvalidValueError(item, brief(value), allowed, f"Choose another {item}.")
    return str(value)


def integer(value: Any) -> int | None:
    """Python integer equal to `value`; None if `value` is not an integer, for example a Boolean or an array."""
    if isinstance(value, bool | np.bool_) or (isinstance(value, np.ndarray) and value.ndim):
        return None
    try:
        return operator.index(value)
    except TypeError:
        return None


def whole_number(value: Any, item: str, low: int, high: int = sys.maxsize) -> int:
    """Check that `value` is an integer of Python or numpy from `low` to `high`, and not a Boolean."""
    number = integer(value)
    if number is not None and low <= number <= high:
        return number
    allowed = f"{low} to {high}" if high < sys.maxsize else f">= {low}"
    if number is None:
        allowed = f"a whole number, {allowed}"
    raise InvalidValueError(item, brief(value), allowed, f"Correct {item}.")


def flag(value: Any, item: str) -> bool:
    """Check that `value` is a Boolean of Python or numpy."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InvalidValueError(item, brief(value), "True or False", f"Correct {item}.")


def elements(
    value: Any, single: Any, item: str, step: str, allowed: str = "one or several in a list"
) -> tuple[Any, ...]:
    """Elements of the iterable `value`, or `value` itself if its type is `single`; refuses texts and mappings."""
    if isinstance(value, single):
        return (value,)
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable) or getattr(value, "ndim", 1) == 0:
        raise InvalidValueError(item, brief(value), allowed, step)
    return tuple(value)


def listed(value: Any, kind: type[T], item: str) -> tuple[T, ...]:
    """Tuple of the object or objects in `value`, after the check that each has the type `kind`."""
    allowed, step = f"{_a(kind.__name__)}, or several in a list", _step_to(value, kind)
    given = elements(value, kind, item, step, allowed)
    if not given:
        raise InvalidValueError(item, "empty", allowed, step)
    return tuple(instance(one, kind, f"{item}[{k}]") for k, one in enumerate(given))


def callback(value: Any, item: str) -> Any:
    """Check that the callback `value` is a function or None."""
    if value is None or (callable(value) and not isinstance(value, type)):
        return value
    allowed = "a function of two numbers: completed steps and all steps"
    raise InvalidValueError(item, brief(value), allowed, "Give such a function, or None.")


def file_path(file: Any, item: str = "file", *, folder: bool = False) -> Path:
    """Checked path of a file or folder, from a text or a path object."""
    given = os.fspath(file) if isinstance(file, os.PathLike) and not isinstance(file, type) else file
    if not isinstance(given, str):
        raise InvalidValueError(item, brief(file), "the path of a file, a text or a Path", f"Give {item} as a text.")
    if not given.strip():
        raise FileError(".", f"is the current folder, because {item} is empty", "Give the name of a file.")
    path = Path(given)
    if not path.name and not folder:
        raise FileError(path, "is a folder", "Give the name of a file in it.")
    try:
        longest = max(len(os.fsencode(part)) for part in (path.name, *path.parts))
    except UnicodeEncodeError:
        longest = -1
    if "\0" in given or not 0 <= longest <= LONGEST_NAME:
        raise FileError(path, f"is not a valid file name of up to {LONGEST_NAME} bytes", "Correct it.")
    return path


def _a(name: str) -> str:
    if name.startswith("Axes"):
        return f"matplotlib's {name}"
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _step_to(value: object, kind: type) -> str:
    """Next step in a message: sentence about the creation of an object of type `kind`, possibly from `value`."""
    if isinstance(value, type) and issubclass(value, kind):
        return f"Add parentheses to create one: {value.__name__}()."
    if type(value).__module__.startswith("sagline"):
        name = re.findall("[A-Z][a-z]*", type(value).__name__)[-1:] or [type(value).__name__]
        for part in _PARTS:
            if isinstance(getattr(value, part, None), kind):
                return f"Give {name[0].lower()}.{part}."
    return HOW_TO_GET.get(kind.__name__, f"Give {_a(kind.__name__)}.")


def part_of(index: Any, shape: tuple[int, ...], single: str) -> Any:
    """Checked index along the first axis of a batch: an integer, a slice, or an array of integers or booleans."""
    # shape: shape of the batch, () for a single entry; single: name of a single entry in the message.
    if not shape:
        raise NoBatchError("index", brief(index), "none", f"A {single} cannot be indexed; use it directly.")
    if isinstance(index, slice):
        return _sliced(index, shape[0])
    number = integer(index)
    if number is not None:
        if -shape[0] <= number < shape[0]:
            return number
        raise _no_entry(index, shape[0])
    chosen = np.asarray(index) if isinstance(index, list | np.ndarray) else None
    if chosen is None or chosen.ndim != 1 or not _names_entries(chosen, shape[0]):
        raise _no_entry(index, shape[0])
    return chosen if chosen.size else chosen.astype(np.int64)  # numpy converts an empty list to an array of floats


def batch_length(shape: tuple[int, ...], single: str) -> int:
    """Number of entries along the first axis of a batch of shape `shape`; single: name of an entry in the message."""
    if not shape:
        raise NoBatchError("this", f"a {single}", "a batch", f"A {single} has no length; use it directly.")
    return shape[0]


def _sliced(index: slice, size: int) -> slice:
    try:
        index.indices(size)
    except (TypeError, ValueError):
        raise _no_entry(index, size) from None
    return index


def _names_entries(chosen: NDArray[Any], size: int) -> bool:
    if chosen.dtype == np.bool_:
        return len(chosen) == size
    if chosen.size == 0:
        return True
    return bool(chosen.dtype.kind in "iu" and int(chosen.min()) >= -size and int(chosen.max()) < size)


def _no_entry(index: object, size: int) -> NoSuchEntryError:
    allowed = f"{-size} to {size - 1}, a slice, or an array of such numbers or of {size} booleans"
    if size == 0:
        allowed = "a slice, because the batch is empty"
    return NoSuchEntryError("index", brief(index), allowed, f"The batch has {size}; indices start at 0.")


def true_runs(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    """First index and end of each run of True in `flags`, in order, shape (k, 2)."""
    return np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8))).reshape(-1, 2)


def evenly_spaced(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices 0 to `count` - 1, at nearly equal steps, with the first and the last index."""
    places = np.linspace(0, max(count - 1, 0), min(count, most))
    return np.unique(places.round().astype(np.int64))


UNASKED: Final = 1 << 26  # [bytes], smaller allocations are not checked
_POSE_BYTES, _CABLE_BYTES = 400.0, 64.0  # [bytes], measured memory per pose, and per cable and pose
_BEHIND_BYTES = 72.0  # [bytes], measured memory per cable and pose for the routing
_GROUPS: Final = (  # files that contain the memory limit and the used memory of a container
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
)


def check_memory(item: str, size: float, next_step: str) -> None:
    """Refuse an allocation of more than 64 MB that does not fit into memory; size [bytes]; item: its purpose."""
    if size > UNASKED and size > (free := free_memory()):
        # the message needs so many digits that the two numbers differ
        digits = next((k for k in range(3, 17) if f"{size:.{k}g}" != f"{free:.{k}g}"), 17)
        wanted, left = f"{size / 1e9:.{digits}g} GB", f"<= {free / 1e9:.{digits}g} GB, which are free"
        raise InvalidValueError(f"the memory for {item}", wanted, left, next_step)


def check_poses(count: int, cable_count: int, behind: bool) -> None:
    """Refuse kinematics of `count` poses that need too much memory; behind: True with pulleys or dead lengths."""
    cable = _CABLE_BYTES + (_BEHIND_BYTES if behind else 0.0)
    size = count * (_POSE_BYTES + cable * cable_count)
    check_memory(f"a batch of {count:,} poses", size, "Solve the batch in parts.")


def free_memory() -> float:
    """Free memory that computer, container and process limits allow [bytes]; infinite if the system reports none."""
    free = [float("inf")]
    with contextlib.suppress(OSError, ValueError, AttributeError):  # AttributeError: Windows has no sysconf
        free.append(float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        free.append(1024.0 * float(next(line for line in lines if line.startswith("MemAvailable")).split()[1]))
    for limit, used in _GROUPS:
        with contextlib.suppress(OSError, ValueError):  # ValueError: "max", no limit
            free.append(float(Path(limit).read_text()) - float(Path(used).read_text()))
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        limit_of_process = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit_of_process != resource.RLIM_INFINITY:
            taken = float(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            free.append(limit_of_process - taken)
    return max(0.0, min(free))
