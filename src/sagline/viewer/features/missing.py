"""Explanation of an infeasible pose."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any, Final

import numpy as np
import viser

from sagline.core.errors import SaglineError
from sagline.core.numbers import n
from sagline.kinematics.status import PoseStatus
from sagline.robot.robot import Robot
from sagline.tension.singular import unresisted_motion
from sagline.viewer import lines, solids
from sagline.viewer.channel import chosen_by
from sagline.viewer.feature import Aside, Feature, Reading, View
from sagline.viewer.features.tensions import SHARING
from sagline.viewer.missing import Missing, NearestHeld, missing_of, nearest_held
from sagline.viewer.page import Page
from sagline.viewer.readout import block
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import INFEASIBLE
from sagline.viewer.tension_scale import TensionScale, force_unit
from sagline.viewer.wording import ForceUnit, method_name, number

GO: Final = "go-there"  # topic of the button that puts the platform to the nearest pose
TURNS_LITTLE: Final = 1e-9  # of a force at an arm of a meter: no moment
OTHERWISE: Final = "AnalyticCenter"  # finds tensions wherever there are any


def explanation(snapshot: Snapshot, missing: Missing | None, nearest: NearestHeld | None, *, looking: bool) -> str:
    """HTML: the missing force, the limits that cables stand at, and the nearest pose that is held, to go to."""
    rows = _missing_rows(snapshot, missing) if missing is not None else _other_rows(snapshot)
    if nearest is not None:
        place = ", ".join(number(x, ".3f") for x in nearest.pose.position)
        button = f"<button {chosen_by(GO, '')}>Go there</button>"
        level = ", the platform level" if nearest.turned else ""
        rows.append(("Held nearest", f"{distance_of(nearest)} away at {place} m{level}. {button}"))
    elif looking:
        rows.append(("Held nearest", "looked for …"))
    elif snapshot.status not in (PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED):
        rows.append(("Held nearest", "nowhere within the robot, turned like this or level"))
    return block('<dl class="missing">' + "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in rows) + "</dl>")


def distance_of(nearest: NearestHeld) -> str:
    """How far it is."""
    return n(nearest.distance, ".3g", "m")


def missing_label(missing: Missing, unit: ForceUnit) -> str:
    """What is written at the arrow."""
    text = f"{unit.written(float(np.linalg.norm(missing.force)))} missing"
    return text + (f", and {_moment(missing)}" if _turns(missing) else "")


def _missing_rows(snapshot: Snapshot, missing: Missing) -> list[tuple[str, str]]:
    unit = force_unit(snapshot.robot)
    parts = ", ".join(unit.bare(part) for part in missing.force)
    size = unit.written(float(np.linalg.norm(missing.force)))
    rows = [("Missing force", f"{size}: x, y, z {parts} {unit.name}")]
    if _turns(missing):
        turning = ", ".join(number(part, ".4g") for part in missing.moment)
        rows = [
            ("Missing force", f"{size}, which alone would not do: x, y, z {parts} {unit.name}"),
            ("and moment", f"{_moment(missing)}: {turning} N m about x, y, z through the center of mass"),
        ]
    for lower in (True, False):
        cables = [str(each.cable) for each in missing.limits if each.lower is lower]
        if cables:
            rows.append(
                (f"At {'lower' if lower else 'upper'} limit", f"cable{'s'[: len(cables) - 1]} {', '.join(cables)}")
            )
    return rows


def _other_rows(snapshot: Snapshot) -> list[tuple[str, str]]:
    """Where no force is missing, or none that is known."""
    status = snapshot.status
    if status in (PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED) and snapshot.plan is not None:
        other = OTHERWISE if status is PoseStatus.NOT_COVERED else "MinimumNorm"
        here = escape(method_name(snapshot.plan.tension))
        return [("Shared by", f"{here}, which has no answer. <button {chosen_by(SHARING, other)}>{other}</button>")]
    if status is PoseStatus.SINGULAR:
        try:
            return [("No cable resists", escape(unresisted_motion(snapshot.robot, snapshot.pose).text))]
        except SaglineError:
            return []
    return []


def _turns(missing: Missing) -> bool:
    return bool(np.linalg.norm(missing.moment) > TURNS_LITTLE * np.linalg.norm(missing.force))


def _moment(missing: Missing) -> str:
    return n(float(np.linalg.norm(missing.moment)), ".4g", "N m")


HELD: Final = (28, 140, 92)  # the platform where it would be held
WIDTH, WAY_WIDTH = 5.0, 2.0  # px
SMALL: Final = 0.8  # of the size of other names
LONG: Final = 0.2  # of the robot's size: the arrow, its head and its thickness
HEAD, HEAD_RADIUS, SHAFT_RADIUS = 0.04, 0.014, 0.006
ALONG: Final = (0.32, 0.44, 0.56)  # of a cable from its anchor, where names stand: neighbors do not meet


class MissingStage:
    """Draws it; nothing is there before it is needed."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, scale: TensionScale) -> None:
        """Draw nothing yet."""
        self._scene, self._scale = scene, scale
        self._size, self._body = solids.size_of(robot), solids.platform(robot)
        self._arrow: tuple[Any, ...] = ()
        self._marks: Any = None
        self._names: dict[int, Any] = {}
        self._ghost: list[Any] = []

    def show(self, snapshot: Snapshot, missing: Missing | None) -> None:
        """Draw the missing force at the center of mass, and cables at limits, in the colors of these tensions."""
        self._show_force(snapshot, missing)
        limits = () if missing is None else missing.limits
        for cable, name in self._names.items():
            name.visible = any(each.cable == cable for each in limits)
        if self._marks is not None:
            self._marks.visible = bool(limits)
        if not limits:
            return
        courses = snapshot.courses(1.0)[[each.cable for each in limits]]
        ends = np.array([self._scale.low if each.lower else self._scale.high for each in limits])
        pieces = lines.segments(courses, dashed=False).astype(np.float32)
        colors = np.repeat(self._scale.linear_colors(ends), 2 * (courses.shape[1] - 1), axis=0).reshape(-1, 2, 3)
        if self._marks is None or len(self._marks.points) != len(pieces):
            if self._marks is not None:
                self._marks.remove()
            self._marks = self._scene.add_line_segments(
                "/limits", pieces, colors, thickness=WIDTH, thickness_units="screen"
            )
        self._marks.points, self._marks.colors, self._marks.visible = pieces, colors, True
        for each, course in zip(limits, courses, strict=True):
            self._name(each.cable, each.name, course)

    def show_nearest(self, snapshot: Snapshot, nearest: NearestHeld | None) -> None:
        """Draw the platform where it would be held, and the way there."""
        if nearest is not None and not self._ghost:
            frame = self._scene.add_frame("/nearest", show_axes=False)
            body = self._scene.add_mesh_simple(
                "/nearest/body", self._body.vertices, self._body.faces, color=HELD, opacity=0.5
            )
            name = self._scene.add_label("/nearest/name", "", anchor="top-center", font_screen_scale=SMALL)
            way = self._scene.add_line_segments(
                "/nearest_way", np.zeros((lines.POINTS - 1, 2, 3), dtype=np.float32), HELD,
                thickness=WAY_WIDTH, thickness_units="screen",
            )  # fmt: skip
            self._ghost = [frame, way, name, body]
        for handle in self._ghost[:2]:
            handle.visible = nearest is not None
        if nearest is None:
            return
        frame, way, name, _ = self._ghost
        pose = nearest.pose
        frame.position, frame.wxyz = pose.position, np.roll(pose.quaternion, 1)
        name.text = f"held here, {distance_of(nearest)} away"
        ends = np.stack((snapshot.pose.position, pose.position))[None]
        way.points = lines.segments(lines.straight(ends), dashed=True).astype(np.float32)

    def clear(self) -> None:
        """Draw nothing."""
        for handle in (*self._names.values(), *self._ghost[:2], *self._arrow):
            handle.visible = False
        if self._marks is not None:
            self._marks.visible = False

    def _show_force(self, snapshot: Snapshot, missing: Missing | None) -> None:
        size = 0.0 if missing is None else float(np.linalg.norm(missing.force))
        for handle in self._arrow:
            handle.visible = size > 0.0
        if missing is None or size == 0.0:
            return
        start = snapshot.pose.transform(snapshot.robot.center_of_mass)
        tip = start + LONG * self._size / size * missing.force
        ends = np.stack((start, tip))[None].astype(np.float32)
        if not self._arrow:
            self._arrow = (
                self._scene.add_arrows(
                    "/missing", ends, INFEASIBLE, shaft_radius=SHAFT_RADIUS * self._size,
                    head_radius=HEAD_RADIUS * self._size, head_length=HEAD * self._size,
                ),
                self._scene.add_label("/missing_name", "", anchor="bottom-center"),
            )  # fmt: skip
        arrow, name = self._arrow
        arrow.points = ends
        name.text, name.position = missing_label(missing, force_unit(snapshot.robot)), tip

    def _name(self, cable: int, text: str, course: np.ndarray) -> None:
        share = ALONG[cable % len(ALONG)]
        place = course[round(share * (len(course) - 1))]
        if cable not in self._names:
            self._names[cable] = self._scene.add_label(f"/limits_names/{cable}", "", font_screen_scale=SMALL)
        name = self._names[cable]
        name.text, name.position, name.visible = text, place, True


Key = tuple[object, ...]


class MissingFeature(Feature):
    """Explains what is shown; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Build nothing yet."""
        self._panel, self._go, self._ready = page.panel, page.go, page.ready
        self._stage = MissingStage(page.server.scene, page.robot, page.scale)
        self._aside = Aside(page.later)
        self.missing: Missing | None = None  # at the pose that is shown
        self._key: Key = ()  # of the pose that is shown; () while it is feasible
        self._found: tuple[Key, NearestHeld | None] = ((), None)
        self._told: Callable[[], None] = _nothing
        self._look: Callable[[], None] = _nothing
        page.channel.on(GO, self._hear)

    @property
    def waiting(self) -> bool:
        """Whether the nearest pose is still to come."""
        return self._aside.busy

    def follow(self, view: View) -> None:
        """Explain a pose, or say nothing of one that is feasible."""
        snapshot = view.snapshot
        if not isinstance(snapshot, Snapshot) or snapshot.feasible:
            self.missing = None
            if self._key:
                self._clear()
            return
        missing = self.missing = missing_of(snapshot)
        self._stage.show(snapshot, missing)
        robot, pose, plan = snapshot.robot, snapshot.pose, snapshot.plan
        model = view.settings.model if plan is None else plan.state.cables.model
        wrench = view.wrench if plan is None else plan.state.wrench
        load = b"" if wrench is None else wrench.tobytes()
        self._key = (id(robot), type(model), pose.position.tobytes(), pose.quaternion.tobytes(), load)
        key = self._key

        def tell() -> None:
            known = self._found[1] if self._found[0] else None  # of a pose before, until this one's is there
            looking = self._found[0] != key  # or will be, as soon as it can
            self._panel.explain(explanation(snapshot, missing, known, looking=looking))
            self._stage.show_nearest(snapshot, known)

        def look() -> None:
            self._aside.ask(lambda: nearest_held(robot, pose, model, wrench), done, lambda _: done(None))

        def done(found: NearestHeld | None) -> None:
            if self._key:
                self._found = (key, found)
                self._told()
                if self._key != key:
                    self._look()

        self._told, self._look = tell, look
        if self._ready(Reading.WORKSPACE) and not self._aside.busy and self._found[0] != key:
            look()
        tell()

    def _clear(self) -> None:
        self._key, self._found = (), ((), None)
        self._panel.explain("")
        self._stage.clear()

    def _hear(self, _value: Any, _client: int) -> None:
        """Somebody wants to go there."""
        key, nearest = self._found
        if key and key == self._key and nearest is not None:
            self._go(nearest.pose)


def _nothing() -> None:
    """Before there is anything to tell."""
