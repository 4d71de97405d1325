"""Field of the pose, and state of the page as code or as a link that contains the values of the controls."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any, Final
from urllib.parse import parse_qsl, quote, urlencode
from zlib import crc32

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.files.quantity import STRONGEST, decimal_numbers, plain_number, pose_of_text
from sagline.files.robot_file import dump_robot
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.tension.methods import QuadraticProgram
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page, Source
from sagline.viewer.player import InMotion
from sagline.viewer.readout import html_block
from sagline.viewer.server import NAME
from sagline.viewer.snapshot import ByHand, Settings, Snapshot, given_yaw
from sagline.viewer.tension_scale import number_text

LONGEST: Final = 4000  # largest number of characters in a link
LONGEST_TEXT: Final = 60  # largest number of characters in a value, and in a quotation in a message
FARTHEST: Final = 1e12  # limit of numbers without limits of their own
STEP: Final = "Copy the link again."
SAFE: Final = ",:.+"  # characters that do not require an escape in a fragment
_NUMBERS: Final = (viser.GuiSliderHandle, viser.GuiNumberHandle)
_VECTORS: Final = (viser.GuiVector2Handle, viser.GuiVector3Handle)
_KINDS: Final = (*_NUMBERS, *_VECTORS, viser.GuiDropdownHandle, viser.GuiCheckboxHandle, viser.GuiTextHandle)


def _parts_of(text: str) -> dict[str, str]:
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
    fixed = dump_robot(robot.replace(mass=1.0, inertia=np.eye(3))).encode()
    return f"{robot.name}:{crc32(fixed):08x}"


def pose_part(pose: Pose) -> str:
    """Text of a pose in the format of the command line, with twelve digits."""
    angles = pose.rotation.as_euler("ZYX", degrees=True)
    return _listed([*pose.position, *angles] if np.any(np.abs(angles) > 1e-12) else pose.position)


def _listed(values: Any) -> str:
    """Numbers between commas."""
    return ",".join(f"{value + 0.0:.12g}" for value in values)


def _numbers_of(text: str, item: str, unit: str, count: int, largest: float) -> Array:
    """Exactly `count` numbers between commas."""
    return np.array(decimal_numbers(_split(text, item, count), item, unit, largest))


def _shortest(number: float) -> str:
    """A number with the fewest digits that identify it."""
    return repr(number).removesuffix(".0")


def short(label: str) -> str:
    """Name of a control in a link; for example, the name of "Platform + load [kg]" is platform-load."""
    return "-".join(re.findall(r"[a-z0-9]+", re.sub(r"\[.*?\]", "", label.lower())))


class _LinkedControls:
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
        return {name: handle.value for name, handle in self._handles().items()}

    def put(self, values: dict[str, Any]) -> None:
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
        return ",".join(map(_shortest, value))
    return str(value) if isinstance(handle, viser.GuiTextHandle) else _shortest(value)


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


FIRST: Final = -0.9  # order among the controls: above all controls except those of the played motion
EXAMPLE: Final = "1, 0, 1.5 or 1, 0, 1.5, 10, 0, 0"
POSE_STEP: Final = f"Give meters, and degrees about z, y and x: {EXAMPLE}."
HINT: Final = "Position in meters; angles about z, y and x in degrees, if any. Enter moves the platform there."
_CONTENT: Final = html_block(
    '<div class="state"><label for="sagline-pose">x, y, z [m], α, β, γ [°]</label>'
    f'<input id="sagline-pose" type="text" autocomplete="off" spellcheck="false" title="{HINT}"'
    ' aria-describedby="sagline-pose-reply">'
    '<div id="sagline-pose-reply" class="bad" role="alert"></div>'
    '<div class="copies"><button type="button" data-copy="code" title="Lines of Python for this state">'
    "Copy as code</button>"
    '<button type="button" data-copy="link" title="A link that opens this state on another page">Copy link</button>'
    '<button type="button" data-keys class="small" aria-label="Keys" title="List of the keys">?</button></div></div>'
)
LONGEST_NAME: Final = 40  # largest number of characters in the name of a request
MASS, SHARING, HAND = "platform-load", "tensions", "by-hand"  # names of two controls and of tensions by hand
SHOWN: Final = "print(tension)  # [N], cable by cable"


def _pose_text(pose: Pose) -> str:
    """A pose in the format of the field, to 0.1 mm and 0.01 degree; without angles if the platform is level."""
    place = [_short(value, ".4f") for value in pose.position]
    angles = [_short(value, ".2f") for value in pose.rotation.as_euler("ZYX", degrees=True)]
    return ", ".join(place if angles == ["0"] * 3 else place + angles)


def _short(value: float, form: str) -> str:
    return number_text(value, form).rstrip("0").rstrip(".")


class StateFeature(Feature):
    """Field of the pose, and the state as code or as a link."""

    def __init__(self, page: Page) -> None:
        """Build the panel after all other controls, because links contain their values."""
        page.server.gui.add_html(_CONTENT, order=FIRST)
        self._page, self._channel, self._robot = page, page.channel, page.robot
        self.controls = _LinkedControls(page.server.gui)
        self._view: View | None = None
        self._time = 0.0
        self._requests: deque[tuple[Any, int]] = deque()  # requests to copy a text, and their clients
        page.channel.on("copy", lambda value, client: self._requests.append((value, client)))
        for topic, reply in (("pose", self._go), ("link", self._open_link)):
            page.channel.on(topic, partial(self._answer, f"{topic}-reply", reply))

    def follow(self, view: View) -> None:
        """Send the pose."""
        self._view, self._time = view, self._page.player.time
        self._channel.send("pose", _pose_text(view.snapshot.pose))

    def tick(self) -> None:
        """Answer the requests to copy a text; earlier changes are already shown."""
        while self._requests:
            self._answer("copy-reply", self._copy, *self._requests.popleft())

    def _go(self, text: str, _client: int) -> None:
        self._page.go_near(pose_of_text(text, "the pose", POSE_STEP))

    def _answer(self, topic: str, reply: Callable[[str, int], str | None], value: Any, client: int) -> None:
        """Handle `value`, a request [name, text] of a page. The answer {"to": name, ...} is sent to this page alone."""
        if not isinstance(value, list) or len(value) != 2 or not all(isinstance(each, str) for each in value):
            return
        name, text = value
        if len(name) > LONGEST_NAME:
            return
        try:
            found = reply(text, client)
            answer = {} if found is None else {"text": found}
        except SaglineError as error:
            answer = {"refused": str(error)}
        self._channel.send_to(client, topic, {"to": name, **answer})

    def _copy(self, kind: str, client: int) -> str:
        view, source = self._view, self._page.source
        if view is None:
            raise InvalidValueError("the view", "not there yet", "a view that is shown", "Wait until it is shown.")
        if kind == "link":
            return self._link_to(view, client)
        if kind != "code":
            raise InvalidValueError("what to copy", repr(kind), "code or link", "Press one of the buttons.")
        if view.played is not None and not (self._page.player.is_original and source.played):
            step = "Copy the pose at its start, and simulate from there."
            raise InvalidValueError(f"the {view.played.name}", "in no file", "one that was loaded from a file", step)
        return code_of(view, self._robot, source, self._time)

    def _link_to(self, view: View, client: int) -> str:
        parts = {"robot": name_of(self._robot)}
        if view.played is not None:
            parts["time"] = repr(float(self._page.player.time))
        else:
            parts["pose"] = pose_part(view.snapshot.pose)
        if view.wrench is not None:
            parts["wrench"] = _listed(view.wrench)
        camera = self._page.framing.moved(client)
        if camera is not None:
            parts["camera"] = _listed(camera)
        controls = self.controls.changes()
        if MASS in controls or self._page.source.mass is not None:
            controls[MASS] = _shortest(view.settings.mass)
        if isinstance(view.settings.tension, ByHand):
            controls.pop(SHARING, None)
            parts[HAND] = _listed(np.asarray(view.settings.tension.target))
        return urlencode({**parts, **controls}, safe=SAFE, quote_via=quote)

    def _open_link(self, text: str, client: int) -> None:
        """Bring the page and the camera of `client` to the state of a link. An invalid link changes nothing."""
        parts, own = _parts_of(text), self._robot.name
        if (given := parts.pop("robot")) != name_of(self._robot):
            name = given.rpartition(":")[0]
            other = "another robot of this name" if name == own else repr((name or given)[:LONGEST_TEXT])
            raise InvalidValueError("the link", f"of {other}", own, "Open it with its own robot.")
        place, framing = self._place(parts), self._page.framing
        wrench, camera = (
            _numbers_of(parts.pop(name), f"the {name} of the link", unit, 6, largest) if name in parts else None
            for name, unit, largest in (("wrench", "N or N m", STRONGEST), ("camera", "m", framing.farthest))
        )
        if camera is not None and np.array_equal(camera[:3], camera[3:]):
            raise InvalidValueError("the camera of the link", "at its own target", "two different points", STEP)
        hand = parts.pop(HAND, None)
        method = None
        if hand is not None:
            method = ByHand(target=_numbers_of(hand, HAND, "N", self._robot.cable_count, STRONGEST))
        self.controls.read(parts)()
        self._page.wrench = wrench
        if method is not None:
            self._page.panel.choose_by_hand(method)
        place()
        if camera is not None:
            framing.look(client, camera)
        self._page.refresh()

    def _place(self, parts: dict[str, str]) -> Callable[[], None]:
        """Function that goes to the pose or the time of a link."""
        time, pose, player = parts.pop("time", None), parts.pop("pose", None), self._page.player
        if (time is None) == (pose is None):
            raise InvalidValueError("the link", "with both or none", "a pose or a time", STEP)
        if pose is not None:
            target = pose_of_text(pose, "the pose of the link", STEP)
            self._page.check_near(target)
            return lambda: self._page.go(target)
        if player.played is None:
            step = "Open it with the same run: sagline view ROBOT RUN."
            raise InvalidValueError("the link", "with a time of a run", "a pose, because nothing is played", step)
        moment = float(_numbers_of(time or "", "the time of the link", "s", 1, player.duration)[0])
        return lambda: player.scrub_to(max(moment, 0.0))


def code_of(view: View, robot: Robot, source: Source, time: float = 0.0) -> str:
    """Lines of Python that create the shown objects as `robot`, `pose` and `tension`."""
    snapshot = view.snapshot
    if view.played is not None:
        lines = view.played.code(source.played, time)
    else:
        assert not isinstance(snapshot, InMotion)
        lines = [f"robot = {source.robot or f'sl.load_robot({robot.name!r})'}"]
        lines += [] if source.mass is None else [_weighed(source.mass)]
        lines += [*_changes(view.settings, robot), *_planned(snapshot, view)]
    return "\n".join(["import sagline as sl", "", *lines, SHOWN, ""])


def _changes(settings: Settings, robot: Robot) -> list[str]:
    lines = [] if settings.mass == robot.mass else [_weighed(settings.mass)]
    factors = {"linear_density": settings.density, "axial_stiffness": settings.stiffness}
    changed = [f"    {name}=cables.{name} * {factor!r}," for name, factor in factors.items() if factor != 1.0]
    if changed:
        lines += ["cables = robot.cables", "robot = robot.replace(cables=cables.replace(", *changed, "))"]
    return lines


def _weighed(mass: float) -> str:
    return f"robot = robot.replace(mass={mass!r}, inertia=robot.inertia * ({mass!r} / robot.mass))"


def _planned(snapshot: Snapshot, view: View) -> list[str]:
    settings, pose = view.settings, snapshot.pose
    yaw = number_text(given_yaw(pose, settings.given), ".17g")
    made = [f"pose = sl.Pose.from_euler({_plain(pose.position)}, {yaw}, 0, 0)"]
    underconstrained = is_underconstrained(snapshot.robot)  # its rotation is a result
    if np.any(pose.quaternion[:3] != 0.0) and not underconstrained:
        angles = ", ".join(number_text(angle, ".6g") for angle in pose.rotation.as_euler("ZYX", degrees=True))
        made = [
            f"# alpha, beta, gamma = {angles} degrees",
            f"pose = sl.Pose.from_quaternion({_plain(pose.position)}, {_plain(pose.quaternion)})",
        ]
    arguments = [
        f"model={_constructor(settings.model)}",
        *([] if underconstrained else [f"tension={_constructor(settings.tension)}"]),
        *([] if settings.given is None else [f"given={settings.given}"]),
        *([] if view.wrench is None else [f"wrench={_plain(view.wrench)}"]),
        *([] if snapshot.previous is None else [f"previous={_plain(snapshot.previous)}"]),
    ]
    return [
        *(*made, "plan = sl.inverse(", "    robot,", "    pose,"),
        *(f"    {argument}," for argument in arguments),
        *(")", "tension = plan.chord_tension"),
        *([] if snapshot.rest is None else ["rest = sl.confirm(plan).pose  # true equilibrium"]),
    ]


def _constructor(choice: Any) -> str:
    """Call that creates a cable model or a tension distribution method, without default arguments."""
    kind = QuadraticProgram if isinstance(choice, QuadraticProgram) else type(choice)  # or tensions by hand
    default = kind()
    values = {field.name: (getattr(choice, field.name), getattr(default, field.name)) for field in fields(default)}
    arguments = [f"{name}={_plain(value)}" for name, (value, usual) in values.items() if not _same(value, usual)]
    return f"sl.{kind.__name__}({', '.join(arguments)})"


def _same(one: Any, other: Any) -> bool:
    return one is other or (one is not None and other is not None and bool(np.array_equal(one, other)))


def _plain(value: Any) -> str:
    return repr(value.tolist() if isinstance(value, np.ndarray) else value)
