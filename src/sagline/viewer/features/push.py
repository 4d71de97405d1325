"""Force of the user on the platform, and the response to it."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.core.numbers import n
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.reach import is_underconstrained
from sagline.viewer import shapes
from sagline.viewer.camera import OUTSIDE, Camera, camera_of, ray_distance
from sagline.viewer.feature import Feature, View
from sagline.viewer.features.state import FIRST
from sagline.viewer.page import Page
from sagline.viewer.push import Push, PushResponse, Reserve, push_response, semi_axes
from sagline.viewer.readout import definitions, refused, sentence, verdict_box
from sagline.viewer.robot_scene import Nodes
from sagline.viewer.server import finite_numbers
from sagline.viewer.shapes import ball, placed_balls, readable
from sagline.viewer.tension_scale import ForceUnit, force_unit

COLOR: Final = (200, 60, 130)  # color with a contrast of 3 : 1 on both backgrounds, different from platforms
GHOST_OPACITY, BALL_OPACITY = 0.5, 0.3
_ARROW: Final = np.array([0.003, 0.009, 0.025])  # radii of shaft and head, length of the head, per size of the robot
_BELOW: Final = 0.03  # distance of the reserve's label below the point, as a share of the robot's size
FARTHEST: Final = 1e4  # largest distance of a point from the platform frame's origin [m]
HELP: Final = sentence("Ctrl-drag the platform, or type a force.")
TOPIC: Final = "pull"  # topics of the messages of browser/hand.js
FAR: Final = 0.25  # length of a drag, as a share of the robot's size, that applies the mean of the tension limits
NEAR: Final = 12.0  # largest distance of a pointer that grabs the platform [px]
LARGE: Final = 0.06  # longest semi-axis of the ellipsoid, as a share of the robot's size
LONGEST: Final = 0.6  # longest arrow of a typed force, as a share of the robot's size


def response_text(response: PushResponse, drawn_for: float | None) -> str:
    """HTML of a response. `drawn_for` is the force of the drawn ellipsoid [N]; None without an ellipsoid."""
    robot = response.state.one_robot
    unit, place = force_unit(robot), "position" if is_underconstrained(robot) else "pose"
    rows = [
        ("Force", unit.written(response.force)),
        ("Displacement", _motion_text(response)),
        ("Tensions", "–" if response.loaded is None else unit.span(response.loaded.limited_tension)),
        ("Fixed lengths", _reserve_text(response, response.reserve, unit)),
        ("Redistributed", f"{_reserve_text(response, response.redistributed, unit)}, at the same {place}"),
        ("Compliance", _compliance_text(response, drawn_for)),
    ]
    within = response.loaded is not None and response.reserve.force >= response.force
    return verdict_box("quiet" if within else "bad", "Pushed" if within else "Pushed beyond a limit", definitions(rows))


def _motion_text(response: PushResponse) -> str:
    if response.loaded is None:
        return "no equilibrium with this force"
    rotation = n(np.degrees(np.linalg.norm(response.rotation)), ".2g", "°")
    return f"{n(1e3 * np.linalg.norm(response.displacement), '.3g', 'mm')}, {rotation}"


def _reserve_text(response: PushResponse, reserve: Reserve, unit: ForceUnit) -> str:
    """Text of the difference between a reserve and the force."""
    if not np.isfinite(reserve.force):
        return "no limit found"
    more = reserve.force - response.force
    limit = "" if reserve.cable is None else f" (cable {reserve.cable}, {'upper' if reserve.upper else 'lower'} limit)"
    return f"{unit.written(more)} more{limit}" if more >= 0.0 else f"{unit.written(-more)} beyond the limit{limit}"


def _compliance_text(response: PushResponse, drawn_for: float | None) -> str:
    if not np.isfinite(response.compliance).all():
        return "unlimited: no cable resists a motion in some direction"
    least, middle, most = (n(1e3 * length, ".2g", "mm/N") for length in semi_axes(response.compliance)[0])
    drawn = "" if drawn_for is None else f"; drawn as for {n(drawn_for, '.3g', 'N')}"
    return f"{least}, {middle} and {most}{drawn}"


class PushFeature(Feature):
    """A folder with the fields of a typed or dragged force, and the response in the scene."""

    live = True

    def __init__(self, page: Page) -> None:
        """Build the folder."""
        self._page, self._size, self._nodes = page, page.size, Nodes(page.server.scene)
        self.body, self._ball = shapes.platform_solid(page.robot), ball()
        scale = page.scale
        self._stiffness = float(np.sqrt(scale.low * scale.high)) / (FAR * self._size)  # [N/m], force of a drag
        self._hold: tuple[int, Array] | None = None  # client, and the point that it drags, platform frame [m]
        self.response: PushResponse | None = None
        self._unit = force_unit(page.robot)
        self._build_folder(page)
        page.channel.on(TOPIC, self._on_drag)
        page.server.on_client_disconnect(lambda client: page.later(lambda: self._leave(client.client_id)))

    def _build_folder(self, page: Page) -> None:
        gui, center = page.server.gui, page.robot.center_of_mass.tolist()
        with gui.add_folder("Push", expand_by_default=False, order=FIRST + 0.02):
            self._text = gui.add_html(HELP)
            self._force: Any = gui.add_number(
                f"Force [{self._unit.name}]", 0.0, min=0.0, step=0.1, hint="On the platform; 0 for none."
            )
            hint = "Direction of the force, of any length."
            self._direction: Any = gui.add_vector3("Along x, y, z", (0.0, 0.0, -1.0), step=0.01, hint=hint)
            hint = "Point of application in the platform frame; at first the center of mass."
            self._at: Any = gui.add_vector3("At x, y, z [m]", tuple(center), step=0.001, hint=hint)
            self._keep: Any = gui.add_checkbox(
                "Keep after release", False, hint="Or hold Shift when you release the mouse."
            )
            hint = "Displacement of that point by a force of any direction."
            self._ellipsoid: Any = gui.add_checkbox("Stiffness ellipsoid", True, hint=hint)
            self._release: Any = gui.add_button("Release", icon=viser.Icon.HAND_STOP, visible=False)
        for handle in (self._force, self._direction, self._at, self._ellipsoid):
            handle.on_update(lambda event: page.refresh() if event.client is not None else None)
        self._release.on_click(lambda _: page.later(self.release))

    def depends(self, view: View) -> Hashable:
        """Key: the view if a force is applied."""
        return view if self._force.value != 0.0 else None

    def follow(self, view: View) -> None:
        """Compute and draw the response."""
        try:
            self._respond(view)
        except SaglineError as error:
            self._show_none(refused(str(error)))

    @property
    def held(self) -> bool:
        """True while a client drags the platform by a force."""
        return self._hold is not None

    def release(self) -> None:
        """Remove the force."""
        self._hold = None
        self._force.value = 0.0

    def _respond(self, view: View) -> None:
        push, state = self.push, view.state
        if push is None:
            self._show_none("")
        elif state is None:
            self._show_none(sentence("The response to a force is computed at a feasible pose at rest."))
        else:
            response = push_response(state, push)
            drawn_for = None
            if self._ellipsoid.value and np.isfinite(response.compliance).all():
                drawn_for = readable(semi_axes(response.compliance)[0], LARGE * self._size)
            self._draw(response, view.settings.error_scale, drawn_for)
            self._show_text(response_text(response, drawn_for))
            self.response = response

    @property
    def push(self) -> Push | None:
        """The force in the fields; None if it is zero."""
        size = self._unit.newtons * float(_numbers(self._force.value, 1, "force", "a number >= 0")[0])
        if size == 0.0:
            return None
        along = _numbers(self._direction.value, 3, "direction of the force", "three numbers, not all 0")
        at = _numbers(self._at.value, 3, "place of the force", f"within {FARTHEST:g} m")
        length, farthest = float(np.linalg.norm(along)), float(np.abs(at).max())
        for bad, item, value, allowed in (
            (size < 0.0, "force", f"{size:g} N", ">= 0 N"),
            (length == 0.0, "direction", "0, 0, 0", "not 0, 0, 0"),
            (farthest > FARTHEST, "place", f"{farthest:g} m", f"within {FARTHEST:g} m"),
        ):
            if bad:
                raise InvalidValueError(f"push: {item}", value, allowed, "Type another, or release the force.")
        return Push(size * along / length, at)

    def _type(self, push: Push) -> None:
        size = float(np.linalg.norm(push.force))
        self._force.value = size / self._unit.newtons
        if size > 0.0:
            self._direction.value = tuple(float(x) for x in push.force / size)
            self._at.value = tuple(float(x) for x in push.at)

    def _show_text(self, html: str) -> None:
        """Write the response; "" shows how to apply a force."""
        self._text.content = html or HELP
        self._release.visible = bool(html)

    def _show_none(self, html: str) -> None:
        """Remove the drawing of the response, and write the reason."""
        self._nodes.hide("/push", "/push_tip", "/push_below", "/pushed", "/gives_way")
        self._show_text(html)
        self.response = None

    def _draw(self, response: PushResponse, error_scale: float, drawn_for: float | None) -> None:
        """Draw the force, the largest force in its direction, the displaced platform and the ellipsoid of stiffness."""
        nodes, size, unit = self._nodes, self._size, force_unit(response.state.one_robot)
        start, arrow = response.state.pose.transform(response.push.at), response.push.force / self._stiffness
        if self._hold is None:
            arrow = arrow * min(1.0, LONGEST * size / max(float(np.linalg.norm(arrow)), 1e-300))
        tip, below = start + arrow, start - np.array([0.0, 0.0, _BELOW * size])
        nodes.arrows("/push", np.stack((start, tip))[None], COLOR, *(_ARROW * size))
        nodes.label("/push_tip", f"{unit.written(response.force)}: moves {_motion_text(response)}", tip)
        nodes.label("/push_below", _reserve_text(response, response.reserve, unit), below, "top-center", 0.85)
        pose = response.scaled_pose(error_scale)
        if pose is None:
            nodes.hide("/pushed")
        else:
            nodes.body("/pushed", self.body, COLOR, GHOST_OPACITY, pose)
        if drawn_for is None:
            nodes.hide("/gives_way")
            return
        lengths, directions = semi_axes(response.compliance)
        (wxyz,), ((x, y, z),) = placed_balls(drawn_for * lengths[None], directions[None])
        looks: dict[str, Any] = {"cast_shadow": False, "receive_shadow": False, "position": start}
        nodes.mesh("/gives_way", *self._ball, COLOR, BALL_OPACITY, wxyz=wxyz, scale=(x, y, z), **looks)

    def _leave(self, client: int) -> None:
        if self._hold is not None and self._hold[0] == client:
            self.release()

    def _on_drag(self, value: Any, client: int) -> None:
        """Apply the force of a drag; `value` is unchecked data of a client."""
        if not isinstance(value, dict):
            return
        phase, at = value.get("phase"), finite_numbers(value.get("at"), 2, OUTSIDE)
        camera, state = camera_of(self._page.server, client), self._page.state
        if at is None or camera is None:
            return
        if phase == "start":
            self._grab(camera, at, client)
        elif self._hold is None or self._hold[0] != client:
            return
        elif phase in ("move", "end") and state is not None:
            drag = _drag(camera, at, state.pose.transform(self._hold[1]))
            self._type(Push(self._stiffness * drag, self._hold[1]))
        if phase == "cancel" or (phase == "end" and not (self._keep.value or value.get("keep") is True)):
            self.release()
        elif phase == "end":
            self._hold = None

    def _grab(self, camera: Camera, at: Array, client: int) -> None:
        """Hold the platform point that is visible at a point of the picture, if there is one."""
        state: Equilibrium | None = self._page.state
        if state is None:
            return
        back = state.pose.matrix.T
        start, direction = back @ (camera.place - state.pose.position), back @ camera.ray(at)
        distance = ray_distance(self.body, start, direction)
        if distance is not None:
            self._hold = client, start + distance * direction
            return
        points = self.body.vertices[self.body.faces].mean(axis=1)  # the ray easily misses a thin platform
        places, depth = camera.project(state.pose.transform(points))
        away = np.linalg.norm(places - at * camera.pixels, axis=1)
        away[~(depth > 0.0)] = np.inf  # behind the camera
        if away.min() <= NEAR:
            self._hold = client, points[away.argmin()]


def _drag(camera: Camera, at: Array, start: Array) -> Array:
    """Vector (3,) [m] from `start`, a point in the world, to the picture point `at` at the same depth."""
    depth = float((start - camera.place) @ camera.axes[:, 2])
    return np.asarray(camera.place + depth * camera.ray(at) - start)


def _numbers(value: Any, count: int, item: str, allowed: str) -> Array:
    """`count` finite numbers from `value`, the value of a field, which viser does not check."""
    try:
        found = np.asarray(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise InvalidValueError(f"push: {item}", "not a number", allowed, "Type another, or release the force.")
    return found
