"""Text of a link that contains the values of the controls."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final
from urllib.parse import parse_qsl
from zlib import crc32

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.files.quantity import decimal_numbers, plain_number
from sagline.files.robot_file import dump_robot
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.server import NAME

LONGEST: Final = 4000  # largest number of characters in a link
LONGEST_TEXT: Final = 60  # largest number of characters in a value, and in a quotation in a message
FARTHEST: Final = 1e12  # limit of numbers without limits of their own
STEP: Final = "Copy the link again."
SAFE: Final = ",:.+"  # characters that do not require an escape in a fragment
_NUMBERS: Final = (viser.GuiSliderHandle, viser.GuiNumberHandle)
_VECTORS: Final = (viser.GuiVector2Handle, viser.GuiVector3Handle)
_KINDS: Final = (*_NUMBERS, *_VECTORS, viser.GuiDropdownHandle, viser.GuiCheckboxHandle, viser.GuiTextHandle)


def parts_of(text: str) -> dict[str, str]:
    """Read the parts of a state from its text."""
    try:
        pairs = parse_qsl(text, keep_blank_values=True, strict_parsing=True, max_num_fields=200, errors="strict")
    except (ValueError, UnicodeError):
        pairs = []
    parts = dict(pairs)
    if len(text) > LONGEST or len(parts) != len(pairs) or "robot" not in parts:
        raise _refused("the link", text, "robot=...&pose=... and so on")
    return parts


def name_of(robot: Robot) -> str:
    """Name and checksum of a robot in a link; the checksum excludes the load on the platform."""
    fixed = dump_robot(robot.replace(mass=1.0, inertia=np.eye(3)))
    return f"{robot.name}:{crc32(fixed.encode()):08x}"


def check_robot(text: str, robot: Robot) -> None:
    """Reject a link of another robot."""
    name, own = text.rpartition(":")[0], name_of(robot)
    if text != own:
        other = "another robot of this name" if name == robot.name else repr((name or text)[:LONGEST_TEXT])
        raise InvalidValueError("the link", f"of {other}", robot.name, "Open it with its own robot.")


def pose_part(pose: Pose) -> str:
    """Text of a pose in the format of the command line, with twelve digits."""
    angles = pose.rotation.as_euler("ZYX", degrees=True)
    return listed([*pose.position, *angles] if np.any(np.abs(angles) > 1e-12) else pose.position)


def listed(values: Any) -> str:
    """Numbers between commas."""
    return ",".join(f"{value + 0.0:.12g}" for value in values)


def numbers_of(text: str, item: str, unit: str, count: int, largest: float) -> Array:
    """Exactly `count` numbers between commas."""
    return np.array(decimal_numbers(_split(text, item, count), item, unit, largest))


def shortest(number: float) -> str:
    """A number with the fewest digits that identify it."""
    return repr(number).removesuffix(".0")


def short(label: str) -> str:
    """Name of a control in a link; for example, the name of "Platform + load [kg]" is platform-load."""
    return "-".join(re.findall(r"[a-z0-9]+", re.sub(r"\[.*?\]", "", label.lower())))


class LinkedControls:
    """All controls of a page; later controls are included."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Store the present values as defaults. Links contain only values that differ from the defaults."""
        self._gui = gui
        self._defaults = self.values()

    def _handles(self) -> dict[str, Any]:
        """Controls by their names; viser has no public list of them."""
        handles: dict[str, Any] = {}
        for handle in tuple(self._gui._gui_input_handle_from_uuid.values()):
            if isinstance(handle, _KINDS) and handle.label != NAME and short(handle.label):
                name = short(handle.label)
                others = sum(short(other.label) == name for other in handles.values())
                handles[f"{name}-{others + 1}" if others else name] = handle  # repeated names: force, force-2 and so on
        return handles

    def changes(self) -> dict[str, str]:
        """Texts of the values that differ from the defaults, by the names of the controls."""
        known, defaults = self._handles().items(), self._defaults
        return {name: _text(each) for name, each in known if name not in defaults or defaults[name] != each.value}

    def read(self, texts: dict[str, str]) -> Callable[[], None]:
        """Function that sets controls to the values `texts` of a link, and all other controls to their defaults."""
        handles = self._handles()
        unknown = next((name for name in texts if name not in handles), None)
        if unknown is not None:
            raise InvalidValueError("the link", f"with {unknown[:LONGEST]!r}", "controls of this page", STEP)
        values = self._defaults | {name: _value(handles[name], name, text) for name, text in texts.items()}
        return lambda: self.put(values)

    def values(self) -> dict[str, Any]:
        """Values of all controls by their names."""
        return {name: handle.value for name, handle in self._handles().items()}

    def put(self, values: dict[str, Any]) -> None:
        """Set the named controls."""
        for name, handle in self._handles().items():
            if name in values:
                handle.value = values[name]


def _text(handle: Any) -> str:
    value = handle.value
    if isinstance(handle, viser.GuiCheckboxHandle):
        return str(int(value))
    if isinstance(handle, viser.GuiDropdownHandle):
        return short(value) or str(value)
    if isinstance(handle, _VECTORS):
        return ",".join(map(shortest, value))
    return str(value) if isinstance(handle, viser.GuiTextHandle) else shortest(value)


def _value(handle: Any, name: str, text: str) -> Any:
    if isinstance(handle, _NUMBERS):
        number = _number(text, name, handle.min, handle.max)
        return int(number) if isinstance(handle.value, int) else number
    if isinstance(handle, _VECTORS):
        count = len(handle.value)
        ends = handle.min or (None,) * count, handle.max or (None,) * count
        rows = zip(_split(text, name, count), *ends, strict=True)
        return tuple(_number(part, name, low, high) for part, low, high in rows)
    if isinstance(handle, viser.GuiTextHandle):
        if len(text) > LONGEST_TEXT or not text.isprintable():
            raise _refused(name, text, f"a text of up to {LONGEST_TEXT} characters")
        return text
    options: dict[str, Any] = {"0": False, "1": True}
    if isinstance(handle, viser.GuiDropdownHandle):
        options = {short(option) or option: option for option in handle.options}
    if text not in options:
        raise _refused(name, text, ", ".join(options)[:120])
    return options[text]


def _number(text: str, name: str, least: float | None, most: float | None) -> float:
    number = plain_number(text)
    low, high = (-FARTHEST if least is None else least), (FARTHEST if most is None else most)
    if number is None or not low <= number <= high:
        raise _refused(name, text, f"{low:g} to {high:g}")
    return number


def _split(text: str, item: str, count: int) -> list[str]:
    """Exactly `count` parts between commas."""
    parts = text.split(",", maxsplit=count)
    if len(parts) != count:
        raise _refused(item, text, f"{count} numbers")
    return parts


def _refused(item: str, text: str, allowed: str) -> InvalidValueError:
    return InvalidValueError(item, repr(text[:LONGEST_TEXT]), allowed, STEP)
