"""A link to what is shown, and back: everything in it is checked before anything is changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.files.typed import STRONGEST, pose_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.by_hand import ByHand
from sagline.viewer.framing import Framing
from sagline.viewer.linked_controls import LinkedControls
from sagline.viewer.player import Player
from sagline.viewer.source import Source
from sagline.viewer.state_link import STEP, check_robot, link_text, listed, name_of, numbers_of, parts_of, pose_part
from sagline.viewer.view import View

MASS, SHARING, HAND = "platform-load", "tensions", "by-hand"  # names of controls, and of what one of them stands for


class Levers(NamedTuple):
    """What a link moves beside the controls.

    Attributes:
        check: Refuses a pose that is out of reach.
        go: Puts the platform to a pose.
        pull: Puts a wrench on it.
        choose: Chooses tensions by hand.
        refresh: Shows all that anew.
    """

    check: Callable[[Pose], None]
    go: Callable[[Pose], None]
    pull: Callable[[Array | None], None]
    choose: Callable[[ByHand], None]
    refresh: Callable[[], None]


class Linking:
    """Makes links and follows them; all of it belongs to the thread that serves."""

    def __init__(
        self, robot: Robot, source: Source, controls: LinkedControls, framing: Framing, player: Player, levers: Levers
    ) -> None:
        """Begin.

        Args:
            robot: The robot that the page was opened with.
            source: Where it came from.
            controls: Of the page.
            framing: Knows where each client's camera is.
            player: What is played.
            levers: What else a link moves.
        """
        self._robot, self._controls, self._framing, self._player = robot, controls, framing, player
        self._loaded, self._levers = source.mass is not None, levers

    def told(self, view: View, client: int) -> str:
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
        controls = self._controls.told()
        if MASS in controls or self._loaded:
            controls[MASS] = repr(view.settings.mass).removesuffix(".0")
        if isinstance(view.settings.tension, ByHand):
            controls.pop(SHARING, None)
            parts[HAND] = listed(np.asarray(view.settings.tension.target))
        return link_text({**parts, **controls})

    def follow(self, text: str, client: int) -> None:
        """Bring the page, and the camera of a client, to what a link tells.

        Raises:
            SaglineError: If it is no such link, of another robot, or tells what cannot be; nothing has changed then.
        """
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
        self._levers.pull(wrench)
        if method is not None:
            self._levers.choose(method)
        place()
        if camera is not None:
            self._framing.look(client, camera)
        self._levers.refresh()

    def _place(self, parts: dict[str, str]) -> Callable[[], None]:
        """Where to go to, or to which time."""
        time, pose = parts.pop("time", None), parts.pop("pose", None)
        if (time is None) == (pose is None):
            raise InvalidValueError("the link", "with both or none", "a pose or a time", STEP)
        if pose is not None:
            wanted = pose_of(pose, "the pose of the link", STEP)
            self._levers.check(wanted)
            return lambda: self._levers.go(wanted)
        if self._player.played is None:
            step = "Open it beside the same run: sagline view ROBOT RUN."
            raise InvalidValueError("the link", "of a moment of a run", "a pose, where nothing is played", step)
        moment = float(numbers_of(time or "", "the time of the link", "s", 1, self._player.clock.duration)[0])
        return lambda: self._player.scrub_to(max(moment, 0.0))


def _six(text: str | None, item: str, unit: str, largest: float) -> Array | None:
    return None if text is None else numbers_of(text, f"the {item} of the link", unit, 6, largest)
