"""Checks of arguments: instances, words, texts, whole numbers, callbacks, paths.

`sagline.core.arrays` checks numbers and arrays of numbers.
"""

from __future__ import annotations

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

from sagline.core.errors import FileError, InvalidValueError, did_you_mean, printable

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
