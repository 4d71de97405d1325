"""Links that bring another page to the same state."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final
from urllib.parse import parse_qsl, quote, urlencode
from zlib import crc32

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.files.pose_text import STRONGEST, decimal_numbers, pose_of
from sagline.files.quantity import plain_number
from sagline.files.robot_file import dump_robot
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.by_hand import ByHand
from sagline.viewer.channel import NAME
from sagline.viewer.feature import View
from sagline.viewer.page import Page

LONGEST: Final = 4000  # characters
STEP: Final = "Copy the link anew."
_SAFE: Final = ",:.+"  # need no escape after the number sign


def link_text(parts: dict[str, str]) -> str:
    """Parts of a state as a text."""
    return urlencode(parts, safe=_SAFE, quote_via=quote)


def parts_of(text: str) -> dict[str, str]:
    """The parts of such a text."""
    try:
        pairs = parse_qsl(text, keep_blank_values=True, strict_parsing=True, max_num_fields=200, errors="strict")
    except (ValueError, UnicodeError):
        pairs = []
    parts = dict(pairs)
    if len(text) > LONGEST or len(parts) != len(pairs) or "robot" not in parts:
        raise InvalidValueError("the link", repr(text[:60]), "robot=...&pose=... and so on", STEP)
    return parts


def name_of(robot: Robot) -> str:
    """A robot as a link names it: its name, and a number of all that is fixed; the load on its platform is not."""
    fixed = dump_robot(robot.replace(mass=1.0, inertia=np.eye(3)))
    return f"{robot.name}:{crc32(fixed.encode()):08x}"


def check_robot(text: str, robot: Robot) -> None:
    """Refuse a link of another robot."""
    name, own = text.rpartition(":")[0], name_of(robot)
    if text != own:
        what = "another robot of this name" if name == robot.name else repr(name[:60] or text[:60])
        raise InvalidValueError("the link", f"of {what}", robot.name, "Open it with the robot that it is of.")


def pose_part(pose: Pose) -> str:
    """A pose as the command line takes it, to twelve digits."""
    angles = pose.rotation.as_euler("ZYX", degrees=True)
    values = [*pose.position, *angles] if np.any(np.abs(angles) > 1e-12) else pose.position
    return listed(np.asarray(values))


def listed(values: Array) -> str:
    """Numbers between commas."""
    return ",".join(f"{value + 0.0:.12g}" for value in values)


def numbers_of(text: str, item: str, unit: str, count: int, largest: float) -> Array:
    """A number of numbers between commas."""
    parts = text.split(",", maxsplit=count)
    if len(parts) != count:
        raise InvalidValueError(item, repr(text[:60]), f"{count} numbers", STEP)
    return np.array(decimal_numbers(parts, item, unit, largest))


LONGEST_TEXT: Final = 60  # characters of a text
FARTHEST: Final = 1e12  # of a number without limits
STEP_OF_CONTROLS: Final = "Copy the link anew."
_NUMBERS: Final = (viser.GuiSliderHandle, viser.GuiNumberHandle)
_VECTORS: Final = (viser.GuiVector2Handle, viser.GuiVector3Handle)
_KINDS: Final = (*_NUMBERS, *_VECTORS, viser.GuiDropdownHandle, viser.GuiCheckboxHandle, viser.GuiTextHandle)


class LinkedControls:
    """All controls of a page, those to come included."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Take the present values for the usual ones: a link contains those that differ."""
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

    def changes(self) -> dict[str, str]:
        """Values that differ from the usual ones, by the names of the controls."""
        found = {}
        for name, handle in self._handles().items():
            if name not in self._usual or handle.value != self._usual[name]:
                found[name] = _text(handle)
        return found

    def read(self, texts: dict[str, str]) -> Callable[[], None]:
        """Function that sets the controls to the values of a link, and all others to the usual ones."""
        handles = self._handles()
        unknown = next((name for name in texts if name not in handles), None)
        if unknown is not None:
            raise InvalidValueError(
                "the link", f"with {unknown[:LONGEST]!r}", "controls of this page", STEP_OF_CONTROLS
            )
        values = {name: _value(handles[name], name, text) for name, text in texts.items()}

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
    """A control's value from its text."""
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
    if len(text) > LONGEST_TEXT or not text.isprintable():
        raise InvalidValueError(
            name, repr(text[:LONGEST_TEXT]), f"a text of up to {LONGEST} characters", STEP_OF_CONTROLS
        )
    return text


def _number(text: str, name: str, least: float | None, most: float | None) -> float:
    number = plain_number(text)
    low, high = (-FARTHEST if least is None else least), (FARTHEST if most is None else most)
    if number is None or not low <= number <= high:
        raise InvalidValueError(name, repr(text[:LONGEST_TEXT]), f"{low:g} to {high:g}", STEP_OF_CONTROLS)
    return number


def _vector(handle: Any, name: str, text: str) -> tuple[float, ...]:
    count = len(handle.value)
    parts = text.split(",", maxsplit=count)
    if len(parts) != count:
        raise InvalidValueError(name, repr(text[:LONGEST_TEXT]), f"{count} numbers", STEP_OF_CONTROLS)
    least, most = handle.min or (None,) * count, handle.max or (None,) * count
    return tuple(_number(part, name, low, high) for part, low, high in zip(parts, least, most, strict=True))


def _one_of(text: str, allowed: tuple[str, ...], name: str) -> str:
    if text not in allowed:
        raise InvalidValueError(name, repr(text[:LONGEST_TEXT]), ", ".join(allowed)[:120], STEP_OF_CONTROLS)
    return text


MASS, SHARING, HAND = "platform-load", "tensions", "by-hand"  # names of controls, and of what one of them stands for


class Linking:
    """Makes links to a view, and follows them."""

    def __init__(self, page: Page, controls: LinkedControls) -> None:
        """Begin; `controls` are those of the page."""
        self._page, self._robot, self._controls = page, page.robot, controls
        self._framing, self._player, self._loaded = page.framing, page.player, page.source.mass is not None

    def link_to(self, view: View, client: int) -> str:
        """A link to a view, through the camera of a client."""
        parts = {"robot": name_of(self._robot)}
        if view.played is not None:
            parts["time"] = repr(float(self._player.clock.time))
        else:
            parts["pose"] = pose_part(view.snapshot.pose)
        if view.wrench is not None:
            parts["wrench"] = listed(view.wrench)
        camera = self._framing.moved(client)
        if camera is not None:
            parts["camera"] = listed(camera)
        controls = self._controls.changes()
        if MASS in controls or self._loaded:
            controls[MASS] = repr(view.settings.mass).removesuffix(".0")
        if isinstance(view.settings.tension, ByHand):
            controls.pop(SHARING, None)
            parts[HAND] = listed(np.asarray(view.settings.tension.target))
        return link_text({**parts, **controls})

    def follow(self, text: str, client: int) -> None:
        """Bring the page, and the camera of a client, to the state of a link."""
        parts = parts_of(text)
        check_robot(parts.pop("robot"), self._robot)
        place = self._place(parts)
        wrench = _six(parts.pop("wrench", None), "wrench", "N or N m", STRONGEST)
        camera = _six(parts.pop("camera", None), "camera", "m", self._framing.farthest)
        if camera is not None and np.array_equal(camera[:3], camera[3:]):
            raise InvalidValueError("the camera of the link", "at the place that it looks at", "two places", STEP)
        hand = parts.pop(HAND, None)
        method = None
        if hand is not None:
            method = ByHand(target=numbers_of(hand, HAND, "N", self._robot.cable_count, STRONGEST))
        put = self._controls.read(parts)
        put()
        self._page.wrench = wrench
        if method is not None:
            self._page.panel.choose_by_hand(method)
        place()
        if camera is not None:
            self._framing.look(client, camera)
        self._page.refresh()

    def _place(self, parts: dict[str, str]) -> Callable[[], None]:
        """Function that goes to the pose or the time of a link."""
        time, pose = parts.pop("time", None), parts.pop("pose", None)
        if (time is None) == (pose is None):
            raise InvalidValueError("the link", "with both or none", "a pose or a time", STEP)
        if pose is not None:
            wanted = pose_of(pose, "the pose of the link", STEP)
            self._page.check_near(wanted)
            return lambda: self._page.go(wanted)
        if self._player.played is None:
            step = "Open it beside the same run: sagline view ROBOT RUN."
            raise InvalidValueError("the link", "of a moment of a run", "a pose, where nothing is played", step)
        moment = float(numbers_of(time or "", "the time of the link", "s", 1, self._player.clock.duration)[0])
        return lambda: self._player.scrub_to(max(moment, 0.0))


def _six(text: str | None, item: str, unit: str, largest: float) -> Array | None:
    return None if text is None else numbers_of(text, f"the {item} of the link", unit, 6, largest)
