"""The panel of a push: its force in numbers, for who has no mouse, and what answers it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot
from sagline.viewer.push import Push
from sagline.viewer.readout import refused, sentence
from sagline.viewer.tension_scale import force_unit

FARTHEST: Final = 1e4  # m: a place of the platform that is farther from its frame is a slip
HOW: Final = "Ctrl-drag the platform, or type a force."


class PushPanel:
    """A folder; its fields are the push, whoever has written them."""

    def __init__(
        self, gui: viser.GuiApi, robot: Robot, changed: Callable[[], None], let_go: Callable[[], None]
    ) -> None:
        """Build the folder; `changed` and `let_go` are called, from any thread."""
        self._unit = force_unit(robot)
        center = tuple(float(x) for x in robot.center_of_mass)
        with gui.add_folder("Push", expand_by_default=False):
            self._told = gui.add_html(sentence(HOW))
            # Any: mypy takes the values that viser lets one set for read-only
            self._force: Any = gui.add_number(
                f"Force [{self._unit.name}]", 0.0, min=0.0, step=0.1, hint="On the platform; 0 for none."
            )
            self._direction: Any = gui.add_vector3(
                "Along x, y, z", (0.0, 0.0, -1.0), step=0.01, hint="Direction of the force, of any length."
            )
            self._at: Any = gui.add_vector3(
                "At x, y, z [m]", (center[0], center[1], center[2]), step=0.001,
                hint="Where it acts, in the platform's own frame; at first its center of mass.",
            )  # fmt: skip
            self._keep: Any = gui.add_checkbox(
                "Keep after release", False, hint="Or hold Shift when you release the mouse."
            )
            self._ellipsoid: Any = gui.add_checkbox(
                "Stiffness ellipsoid", True, hint="How far a force of any direction moves that place."
            )
            self._let_go: Any = gui.add_button("Let go", icon=viser.Icon.HAND_STOP, visible=False)
        for handle in (self._force, self._direction, self._at, self._ellipsoid):
            handle.on_update(lambda event: changed() if event.client is not None else None)
        self._let_go.on_click(lambda _: let_go())

    @property
    def keeps(self) -> bool:
        """Whether a force stays when the mouse is released."""
        return bool(self._keep.value)

    @property
    def ellipsoid(self) -> bool:
        """Whether the ellipsoid is wanted."""
        return bool(self._ellipsoid.value)

    def push(self) -> Push | None:
        """What is pushed; None for nothing.

        Raises:
            InvalidValueError: If a client sent what is no force.
        """
        size = self._unit.newtons * float(_numbers(self._force.value, 1, "force", "a number >= 0")[0])
        if size == 0.0:
            return None
        along = _numbers(self._direction.value, 3, "direction of the force", "three numbers, not all 0")
        at = _numbers(self._at.value, 3, "place of the force", f"within {FARTHEST:g} m")
        length = float(np.linalg.norm(along))
        if size < 0.0 or length == 0.0 or np.abs(at).max() > FARTHEST:
            bad = "force" if size < 0.0 else "direction" if length == 0.0 else "place"
            value = {"force": f"{size:g} N", "direction": "0, 0, 0", "place": f"{np.abs(at).max():g} m"}[bad]
            allowed = {"force": ">= 0 N", "direction": "one that leads somewhere", "place": f"within {FARTHEST:g} m"}
            raise InvalidValueError(f"push: {bad}", value, allowed[bad], "Type another, or let go.")
        return Push(size * along / length, at)

    def hold(self, push: Push | None) -> None:
        """Write a push into the fields; None: no force."""
        size = 0.0 if push is None else float(np.linalg.norm(push.force))
        self._force.value = size / self._unit.newtons
        if push is not None and size > 0.0:
            self._direction.value = tuple(float(x) for x in push.force / size)
            self._at.value = tuple(float(x) for x in push.at)

    def say(self, html: str) -> None:
        """Say what answers it; "" for how to push."""
        self._told.content = html or sentence(HOW)
        self._let_go.visible = bool(html)

    def refuse(self, message: str) -> None:
        """Say why there is no answer."""
        self.say(refused(message))


def _numbers(value: Any, count: int, item: str, allowed: str) -> Array:
    """Finite numbers of a field, which a client may have filled with anything.

    Raises:
        InvalidValueError: If they are not.
    """
    try:
        found = np.asarray(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise InvalidValueError(f"push: {item}", "no such numbers", allowed, "Type another, or let go.")
    return found
