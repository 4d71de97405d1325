"""Controls of the page as a link tells them: by short names of their labels, within the ranges that they have.

Whoever adds a slider, a number, a choice, a text or a check mark to the page has it in the link.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final

import viser

from sagline.core.errors import InvalidValueError
from sagline.files.quantity import plain_number
from sagline.viewer.channel import NAME

LONGEST: Final = 60  # characters of a text
FARTHEST: Final = 1e12  # of a number without limits
STEP: Final = "Copy the link anew."
_NUMBERS: Final = (viser.GuiSliderHandle, viser.GuiNumberHandle)
_VECTORS: Final = (viser.GuiVector2Handle, viser.GuiVector3Handle)
_KINDS: Final = (*_NUMBERS, *_VECTORS, viser.GuiDropdownHandle, viser.GuiCheckboxHandle, viser.GuiTextHandle)


class LinkedControls:
    """All controls of a page, those to come included."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Take what stands there now for usual: a link tells what is other."""
        self._gui = gui
        self._usual = {name: handle.value for name, handle in self._handles().items()}

    def _handles(self) -> dict[str, Any]:
        """The controls by their names; viser has no list of its own of them that is public."""
        handles: dict[str, Any] = {}
        for handle in tuple(self._gui._gui_input_handle_from_uuid.values()):
            if isinstance(handle, _KINDS) and handle.label != NAME and short(handle.label):
                name = short(handle.label)
                others = sum(short(other.label) == name for other in handles.values())
                handles[f"{name}-{others + 1}" if others else name] = handle  # force, force-2 and so on
        return handles

    def told(self) -> dict[str, str]:
        """What is other than usual, by the names of the controls."""
        found = {}
        for name, handle in self._handles().items():
            if name not in self._usual or handle.value != self._usual[name]:
                found[name] = _text(handle)
        return found

    def read(self, told: dict[str, str]) -> Callable[[], None]:
        """What sets the controls as a link tells, and all others to what is usual.

        Args:
            told: What is other than usual.

        Raises:
            InvalidValueError: If there is no such control, or it has no such value.
        """
        handles = self._handles()
        unknown = next((name for name in told if name not in handles), None)
        if unknown is not None:
            raise InvalidValueError("the link", f"with {unknown[:LONGEST]!r}", "controls of this page", STEP)
        values = {name: _value(handles[name], name, text) for name, text in told.items()}

        def put() -> None:
            for name, handle in handles.items():
                if name in values or name in self._usual:
                    handle.value = values.get(name, self._usual.get(name))

        return put


def short(label: str) -> str:
    """A label as a link has it: "Platform + load [kg]" is platform-load."""
    return "-".join(re.findall(r"[a-z0-9]+", re.sub(r"\[.*?\]", "", label.lower())))


def _text(handle: Any) -> str:
    value = handle.value
    if isinstance(handle, viser.GuiCheckboxHandle):
        return str(int(value))
    if isinstance(handle, viser.GuiDropdownHandle):
        return _option(value)
    if isinstance(handle, _VECTORS):
        return ",".join(map(_written, value))
    return str(value) if isinstance(handle, viser.GuiTextHandle) else _written(value)


def _written(number: float) -> str:
    return repr(number).removesuffix(".0")


def _option(option: str) -> str:
    return short(option) or option


def _value(handle: Any, name: str, text: str) -> Any:
    """A control's value from its text.

    Raises:
        InvalidValueError: If it is none of the control's.
    """
    if isinstance(handle, _NUMBERS):
        number = _number(text, name, handle.min, handle.max)
        return int(number) if isinstance(handle.value, int) else number
    if isinstance(handle, _VECTORS):
        return _vector(handle, name, text)
    if isinstance(handle, viser.GuiCheckboxHandle):
        return {"0": False, "1": True}[_one_of(text, ("0", "1"), name)]
    if isinstance(handle, viser.GuiDropdownHandle):
        options = {_option(option): option for option in handle.options}
        return options[_one_of(text, tuple(options), name)]
    if len(text) > LONGEST or not text.isprintable():
        raise InvalidValueError(name, repr(text[:LONGEST]), f"a text of up to {LONGEST} characters", STEP)
    return text


def _number(text: str, name: str, least: float | None, most: float | None) -> float:
    number = plain_number(text)
    low, high = (-FARTHEST if least is None else least), (FARTHEST if most is None else most)
    if number is None or not low <= number <= high:
        raise InvalidValueError(name, repr(text[:LONGEST]), f"{low:g} to {high:g}", STEP)
    return number


def _vector(handle: Any, name: str, text: str) -> tuple[float, ...]:
    count = len(handle.value)
    parts = text.split(",", maxsplit=count)
    if len(parts) != count:
        raise InvalidValueError(name, repr(text[:LONGEST]), f"{count} numbers", STEP)
    least, most = handle.min or (None,) * count, handle.max or (None,) * count
    return tuple(_number(part, name, low, high) for part, low, high in zip(parts, least, most, strict=True))


def _one_of(text: str, allowed: tuple[str, ...], name: str) -> str:
    if text not in allowed:
        raise InvalidValueError(name, repr(text[:LONGEST]), ", ".join(allowed)[:120], STEP)
    return text
