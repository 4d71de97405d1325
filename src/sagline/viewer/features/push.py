"""Push: a force that somebody applies to the platform, and the response to it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.core.numbers import n
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import solids
from sagline.viewer.camera import Eye, met, place_of
from sagline.viewer.feature import Feature, Reading, View
from sagline.viewer.page import Page
from sagline.viewer.push import Push, Pushed, Reserve, pushed, radii
from sagline.viewer.readout import LATER, box, refused, sentence
from sagline.viewer.solids import THINNEST, ball, readable
from sagline.viewer.tension_scale import TensionScale, force_unit
from sagline.viewer.wording import ForceUnit

COLOR: Final = (200, 60, 130)  # 3 : 1 on both backgrounds, none of those of platforms
GHOST_OPACITY, BALL_OPACITY = 0.5, 0.3
_SHAFT, _HEAD, _LONG = 0.003, 0.009, 0.025  # of an arrow, of the robot's size
_APART: Final = 0.03  # of the robot's size: what is said of the reserve stands this much below the platform's place


class Drawing(NamedTuple):
    """What is drawn of a push.

    Attributes:
        start: Where the force acts [m], shape (3,).
        end: Tip of its arrow [m], shape (3,).
        ghost: The platform where it would go; None for none.
        axes: Half axes of the ellipsoid as drawn, one a column [m], shape (3, 3); None for none.
        tip: What stands at the arrow.
        below: What stands below the place.
    """

    start: Array
    end: Array
    ghost: Pose | None
    axes: Array | None
    tip: str
    below: str


class PushStage:
    """What is drawn of a push; nothing until there is one."""

    def __init__(self, scene: viser.SceneApi, robot: Robot) -> None:
        """Begin with nothing."""
        self._scene, self._size = scene, solids.size_of(robot)
        self.body = solids.platform(robot)
        self._all: list[Any] = []
        self._ghost: Any = None
        self._arrow: Any = None
        self._ball: Any = None
        self._tip: Any = None
        self._below: Any = None

    def show(self, drawing: Drawing) -> None:
        """Draw a push in place of the one before."""
        if self._arrow is None:
            self._build()
        self._arrow.points = np.stack((drawing.start, drawing.end))[None].astype(np.float32)
        self._tip.position, self._tip.text = drawing.end, drawing.tip
        self._below.position = drawing.start - np.array([0.0, 0.0, _APART * self._size])
        self._below.text = drawing.below
        for each in (self._arrow, self._tip, self._below):
            each.visible = True
        self._ghost.visible = drawing.ghost is not None
        if drawing.ghost is not None:
            self._ghost.position, self._ghost.wxyz = drawing.ghost.position, np.roll(drawing.ghost.quaternion, 1)
        self._ball.visible = drawing.axes is not None
        if drawing.axes is not None:
            self._ball.position = drawing.start
            self._ball.wxyz, self._ball.scale = _placed(drawing.axes)

    def hide(self) -> None:
        """Draw nothing."""
        if self._arrow is not None:
            for each in (self._arrow, self._tip, self._below, self._ghost, self._ball):
                each.visible = False

    def _build(self) -> None:
        size, scene, body, sphere = self._size, self._scene, self.body, ball()
        self._arrow = scene.add_arrows(
            "/push", np.zeros((1, 2, 3), dtype=np.float32), COLOR,
            shaft_radius=_SHAFT * size, head_radius=_HEAD * size, head_length=_LONG * size,
        )  # fmt: skip
        self._tip = scene.add_label("/push_tip", "", anchor="bottom-center", depth_test=False)
        self._below = scene.add_label("/push_below", "", anchor="top-center", depth_test=False, font_screen_scale=0.85)
        self._ghost = scene.add_mesh_simple(
            "/pushed", body.vertices, body.faces, color=COLOR, opacity=GHOST_OPACITY, cast_shadow=False
        )
        self._ball = scene.add_mesh_simple(
            "/gives_way", sphere.vertices, sphere.faces, color=COLOR, opacity=BALL_OPACITY, cast_shadow=False,
            receive_shadow=False,
        )  # fmt: skip


def _placed(axes: Array) -> tuple[Array, tuple[float, float, float]]:
    """How a ball is turned (scalar first) and scaled to have half axes (3, 3); a flat one is still seen."""
    lengths = np.linalg.norm(axes, axis=0)
    directions = axes / np.maximum(lengths, 1e-300)
    if np.linalg.det(directions) < 0.0:
        directions[:, 0] *= -1.0
    scale = np.maximum(lengths, THINNEST * lengths.max())
    turn = Rotation.from_matrix(directions).as_quat()
    return np.roll(turn, 1), (float(scale[0]), float(scale[1]), float(scale[2]))


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
    def pushes(self) -> bool:
        """Whether there is a force."""
        return bool(self._force.value != 0.0)

    @property
    def keeps(self) -> bool:
        """Whether a force stays when the mouse is released."""
        return bool(self._keep.value)

    @property
    def ellipsoid(self) -> bool:
        """Whether the ellipsoid is wanted."""
        return bool(self._ellipsoid.value)

    def push(self) -> Push | None:
        """What is pushed; None for nothing."""
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
    """Finite numbers of a field, which a client may have filled with anything."""
    try:
        found = np.asarray(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise InvalidValueError(f"push: {item}", "no such numbers", allowed, "Type another, or let go.")
    return found


def response_text(pushed: Pushed, drawn_for: float | None) -> str:
    """All of it, as HTML."""
    unit = force_unit(pushed.state.one_robot)
    shared = LATER if pushed.shared is None else f"{left(pushed, pushed.shared, unit)}, the platform kept where it is"
    rows = [
        ("Force", unit.written(pushed.force)),
        ("It moves", moved(pushed)),
        ("Tensions", _tensions(pushed, unit)),
        ("Lengths held", left(pushed, pushed.held, unit)),
        ("Shared anew", shared),
        ("Gives way", _gives_way(pushed, drawn_for)),
    ]
    held = pushed.pushed is not None and pushed.held.force >= pushed.force
    head = "Pushed" if held else "Pushed beyond a limit"
    return box(
        "quiet" if held else "bad", head, "<dl>" + "".join(f"<dt>{a}</dt><dd>{b}</dd>" for a, b in rows) + "</dl>"
    )


def moved(pushed: Pushed) -> str:
    """How far it goes, in millimeters and degrees."""
    if pushed.pushed is None:
        return "no rest was found with this force"
    return f"{n(1e3 * np.linalg.norm(pushed.moved), '.3g', 'mm')}, {turned(pushed)}"


def turned(pushed: Pushed) -> str:
    """How far it turns."""
    return f"{n(np.degrees(np.linalg.norm(pushed.turned)), '.2g', '°')}"


def tip_text(pushed: Pushed) -> str:
    """What stands at the arrow."""
    return f"{force_unit(pushed.state.one_robot).written(pushed.force)}: moves {moved(pushed)}"


def reserve_text(pushed: Pushed) -> str:
    """What stands at the platform."""
    return left(pushed, pushed.held, force_unit(pushed.state.one_robot))


def left(pushed: Pushed, reserve: Reserve, unit: ForceUnit) -> str:
    """How much more force until a limit is reached, or how much too much it is."""
    if not np.isfinite(reserve.force):
        return "no limit found"
    more = reserve.force - pushed.force
    which = "" if reserve.cable is None else f" (cable {reserve.cable}, {'upper' if reserve.upper else 'lower'} limit)"
    if more >= 0.0:
        return f"{unit.written(more)} more{which}"
    return f"{unit.written(-more)} too much{which}"


def _tensions(pushed: Pushed, unit: ForceUnit) -> str:
    if pushed.pushed is None:
        return "–"
    tension = pushed.pushed.limited_tension
    return f"{unit.bare(tension.min())} to {unit.written(tension.max())}"


def _gives_way(pushed: Pushed, drawn_for: float | None) -> str:
    if not np.isfinite(pushed.compliance).all():
        return "freely: nothing holds it in some direction"
    least, middle, most = (n(1e3 * r, ".2g", "mm/N") for r in radii(pushed.compliance)[0])
    drawn = "" if drawn_for is None else f"; drawn as for {n(drawn_for, '.3g', 'N')}"
    return f"{least}, {middle} and {most}{drawn}"


TOPIC: Final = "pull"  # that a page tells where its mouse pulls, by browser/hand.js
FAR: Final = 0.25  # of the robot's size: what is pulled so far is pulled as hard as a middling tension pulls
NEAR: Final = 12.0  # px: a hand this near to the platform has it
LARGE: Final = 0.06  # of the robot's size: the longest half axis of the ellipsoid
LONGEST: Final = 0.6  # of the robot's size: of the arrow of a force that is typed


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """What a hand holds.

    Attributes:
        client: Whose it is.
        at: Which place of the platform, in its frame [m], shape (3,).
    """

    client: int
    at: Array


class PushFeature(Feature):
    """Follows a hand or its panel; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Build panel and arrow."""
        server, robot, channel, soon = page.server, page.robot, page.channel, page.later
        self._page, self._server, self._ready = page, server, page.ready
        self._panel = PushPanel(server.gui, robot, page.refresh, lambda: soon(self.let_go))
        self._stage = PushStage(server.scene, robot)
        self._size = solids.size_of(robot)
        scale = TensionScale.of(robot)
        self._stiffness = float(np.sqrt(scale.low * scale.high)) / (FAR * self._size)  # N/m of the pull
        self._hold: Hold | None = None
        self.pushed: Pushed | None = None
        channel.on(TOPIC, self._hear)
        server.on_client_disconnect(lambda client: soon(lambda: self._leave(client.client_id)))

    def depends(self, view: View) -> Hashable:
        """Nothing while nobody pushes."""
        return view if self._panel.pushes else None

    def follow(self, view: View) -> None:
        """Something is shown: answer the push there, if there is one."""
        try:
            self._answer(view)
        except SaglineError as error:
            self._clear()
            self._panel.refuse(str(error))

    def let_go(self) -> None:
        """No force any more."""
        self._hold = None
        self._panel.hold(None)

    def _answer(self, view: View) -> None:
        push = self._panel.push()
        if push is None:
            self._clear()
            return
        if self._page.state is None or not self._ready(Reading.REST) or not self._ready(Reading.FREQUENCIES):
            self._clear()
            late = "A push is answered as soon as forward kinematics and stiffness are compiled."
            self._panel.say(
                sentence("A push is answered where the platform is held at rest." if self._page.state is None else late)
            )
            return
        found = pushed(self._page.state, push, anew=self._ready(Reading.VERDICTS))
        drawn_for = readable(radii(found.compliance)[0], LARGE * self._size) if self._ellipsoid(found) else None
        self._stage.show(self._drawing(found, view.settings.error_scale, drawn_for))
        self._panel.say(response_text(found, drawn_for))
        self.pushed = found

    def _ellipsoid(self, found: Pushed) -> bool:
        return self._panel.ellipsoid and bool(np.isfinite(found.compliance).all())

    def _drawing(self, found: Pushed, error_scale: float, drawn_for: float | None) -> Drawing:
        start, pull = found.state.pose.transform(found.push.at), found.push.force / self._stiffness
        shown = min(1.0, LONGEST * self._size / max(float(np.linalg.norm(pull)), 1e-300))
        axes = None
        if drawn_for is not None:
            lengths, directions = radii(found.compliance)
            axes = drawn_for * lengths * directions
        tip = start + (pull if self._hold is not None else shown * pull)
        return Drawing(start, tip, found.drawn(error_scale), axes, tip_text(found), reserve_text(found))

    def _clear(self) -> None:
        self._stage.hide()
        self._panel.say("")
        self.pushed = None

    def _leave(self, client: int) -> None:
        """A client has gone; what it held it holds no more."""
        if self._hold is not None and self._hold.client == client:
            self.let_go()

    def _hear(self, value: Any, client: int) -> None:
        """A page tells what its hand does: whatever a client has sent."""
        if not isinstance(value, dict):
            return
        phase, at, eye = value.get("phase"), place_of(value.get("at")), self._eye(client)
        if at is None or eye is None:
            return
        if phase == "start":
            self._grab(eye, at, client)
        elif self._hold is None or self._hold.client != client:
            return
        elif phase in ("move", "end") and self._page.state is not None:
            self._panel.hold(
                Push(self._stiffness * self._pulled(eye, at, self._hold.at, self._page.state), self._hold.at)
            )
        if phase == "cancel" or (phase == "end" and not (self._panel.keeps or value.get("keep") is True)):
            self.let_go()
        elif phase == "end":
            self._hold = None

    def _grab(self, eye: Eye, at: tuple[float, float], client: int) -> None:
        """Take hold of the place of the platform that is seen there, if it is there and held."""
        if self._page.state is None:
            return
        back = self._page.state.pose.matrix.T
        start = back @ (eye.place - self._page.state.pose.position)
        direction = back @ eye.ray(at)
        far = met(self._stage.body, start, direction)
        if far is not None:
            self._hold = Hold(client, start + far * direction)
            return
        points = self._stage.body.vertices[self._stage.body.faces].mean(axis=1)  # a thin one is easily missed
        places, deep = eye.seen(self._page.state.pose.transform(points))
        away = np.linalg.norm(places - np.asarray(at) * eye.pixels, axis=1)
        away[~(deep > 0.0)] = np.inf  # behind the eye
        if away.min() <= NEAR:
            self._hold = Hold(client, points[away.argmin()])

    def _pulled(self, eye: Eye, at: tuple[float, float], place: Array, state: Equilibrium) -> Array:
        """From a place of the platform to where the hand is, as far away from the eye [m], shape (3,)."""
        there = state.pose.transform(place)
        depth = float((there - eye.place) @ eye.axes[:, 2])
        return np.asarray(eye.place + depth * eye.ray(at) - there)

    def _eye(self, client: int) -> Eye | None:
        found = self._server.get_clients().get(client)
        return None if found is None else Eye.of(found.camera)
