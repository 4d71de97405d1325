"""Push: a force of the user on the platform, and the response to it: displacement, reserve to a limit, compliance."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from sagline.cables.models import Straight
from sagline.core.arrays import Array, Flags, locked
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.core.numbers import n
from sagline.kinematics.forward import forward
from sagline.kinematics.inverse import inverse
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.statics.slopes import motions_of_ends
from sagline.statics.stiffness import stiffness
from sagline.viewer.camera import OUTSIDE, Camera
from sagline.viewer.feature import Feature, View
from sagline.viewer.features.state import FIRST
from sagline.viewer.page import Page
from sagline.viewer.readout import definitions, refused, sentence, verdict_box
from sagline.viewer.robot_scene import MARK, NO_SHADOW, Nodes
from sagline.viewer.server import finite_numbers
from sagline.viewer.shapes import Solid, placed_balls, readable
from sagline.viewer.tension_scale import ForceUnit

FORCES: Final = 24  # trials per iteration, which divides the distance between the bounds of a limit by about 23
ITERATIONS: Final = 4
SMALLEST: Final = 1e-4  # first trial, as a share of the largest force
BEYOND: Final = 1e3  # largest force, relative to weight and tensions, for cables without an upper limit
AT_LIMIT: Final = 1e-9  # a tension counts as at its limit if the excess, relative to the largest tension, is smaller


class Push(NamedTuple):
    """A force on the platform."""

    force: Array  # force in world axes [N], shape (3,)
    at: Array  # point at which it acts, platform frame [m], shape (3,)

    def load(self, robot: Robot, pose: Pose) -> Array:
        """Wrench of the force at a pose [N, N m], shape (6,)."""
        lever = pose.matrix @ (self.at - robot.center_of_mass)
        return np.concatenate((self.force, np.cross(lever, self.force)))

    def wrench(self, state: Equilibrium, factor: Array | float = 1.0) -> Array:
        """Wrench (..., 6) on the platform at the equilibrium `state`, with the force multiplied by `factor`."""
        return np.asarray(state.wrench + np.multiply.outer(factor, self.load(state.one_robot, state.pose)))


class _Reserve(NamedTuple):
    """Largest force in a direction."""

    force: float  # magnitude of the force [N]; infinite if no limit was found
    cable: int | None = None  # index of the cable that reaches its limit first; None if unknown
    upper: bool = False  # True if this is its upper limit


@dataclass(frozen=True, slots=True, eq=False)
class PushResponse:
    """Response of a platform to a force with constant unstrained lengths."""

    push: Push
    state: Equilibrium  # equilibrium without the force
    loaded: Equilibrium | None  # equilibrium with the force; None if none was found
    reserve: _Reserve  # largest force until a tension reaches its limit, at constant lengths
    redistributed: _Reserve  # largest force with feasible tensions at this pose
    compliance: Array  # compliance of the point of application, world axes [m/N], shape (3, 3); NaN if unknown

    @classmethod
    def of(cls, state: Equilibrium, push: Push) -> PushResponse:
        """Response to a force, with the model of the state's cables."""
        robot, model, step = state.one_robot, state.cables.model, "Choose another cable model."
        if isinstance(model, Straight):
            raise InvalidValueError("push: cable model", "straight", "one that stretches", step)
        found = forward(robot, state.unstrained_length, state.pose, model, push.wrench(state))
        lever, weight = push.at - robot.center_of_mass, robot.mass * robot.gravity
        largest = weight + float(robot.tension_max.sum())  # upper bound of the forces that the cables can balance [N]
        if not np.isfinite(largest):
            largest = BEYOND * (weight + float(np.nansum(state.limited_tension)))
        arm = motions_of_ends(state.pose.matrix @ lever)
        loaded, compliance = found.state if bool(found.solved) else None, arm @ stiffness(state).compliance @ arm.T
        unit = Push(push.force / np.linalg.norm(push.force), push.at)
        reserves = _reserve(state, unit, largest), _redistributed(state, unit, largest)
        return cls(push, state, loaded, *reserves, locked(compliance))

    @property
    def force(self) -> float:
        """Magnitude of the force [N]."""
        return float(np.linalg.norm(self.push.force))

    @property
    def displacement(self) -> Array:
        """Displacement of the point of application [m], shape (3,); NaN if unknown."""
        if self.loaded is None:
            return np.full(3, np.nan)
        return np.asarray(self.loaded.pose.transform(self.push.at) - self.state.pose.transform(self.push.at))

    @property
    def rotation(self) -> Array:
        """Rotation vector of the platform [rad], shape (3,); NaN if unknown."""
        if self.loaded is None:
            return np.full(3, np.nan)
        return np.asarray((self.loaded.pose.rotation * self.state.pose.rotation.inv()).as_rotvec())

    @property
    def semi_axes(self) -> tuple[Array, Array]:
        """Semi-axes of the compliance ellipsoid [m/N], ascending, (3,), and their directions as columns, (3, 3)."""
        if not np.isfinite(self.compliance).all():
            return np.full(3, np.nan), np.eye(3)
        axes, values, _ = np.linalg.svd(self.compliance)
        return values[::-1], axes[:, ::-1]

    def scaled_pose(self, factor: float) -> Pose | None:
        """Pose with the force; the motion from the pose without the force is multiplied by a factor."""
        if self.loaded is None:
            return None
        rest, rotation = self.state.pose, Rotation.from_rotvec(factor * self.rotation) * self.state.pose.rotation
        place = rest.transform(self.push.at) + factor * self.displacement
        return Pose(place - rotation.as_matrix() @ self.push.at, rotation)


def _reserve(state: Equilibrium, unit: Push, largest: float) -> _Reserve:
    """Largest multiple of a force of 1 N until a tension reaches a limit, at constant lengths."""
    robot, lengths = state.one_robot, np.tile(state.unstrained_length, (FORCES, 1))
    edge = AT_LIMIT * float(np.nanmax(state.limited_tension))

    def margins(forces: Array) -> tuple[Array, Flags, Flags]:
        found = forward(robot, lengths, state.pose, state.cables.model, unit.wrench(state, forces))
        tension = found.state.limited_tension
        to_lower, to_upper = tension - robot.tension_min, robot.tension_max - tension
        return np.minimum(to_lower, to_upper), to_upper < to_lower, found.solved

    def is_exceeded(forces: Array) -> Flags:
        margin, _, solved = margins(forces)
        return np.asarray(~solved | (margin.min(axis=1) < -edge))

    low, high = _bracket(is_exceeded, largest)
    if not np.isfinite(high):
        return _Reserve(np.inf)
    margin, above, solved = margins(np.full(FORCES, high))
    if not solved[0]:
        return _Reserve(low)
    cable = int(np.argmin(margin[0]))
    return _Reserve(low, cable, bool(above[0, cable]))


def _redistributed(state: Equilibrium, unit: Push, largest: float) -> _Reserve:
    """Largest multiple of a force of 1 N that tensions within the limits can balance at the pose of the state."""
    robot, model = state.one_robot, state.cables.model
    poses = Pose.from_quaternion(np.tile(state.pose.position, (FORCES, 1)), np.tile(state.pose.quaternion, (FORCES, 1)))

    return _Reserve(
        _bracket(lambda forces: ~inverse(robot, poses, model, wrench=unit.wrench(state, forces)).feasible, largest)[0]
    )


def _bracket(is_exceeded: Callable[[Array], Flags], largest: float) -> tuple[float, float]:
    """Bounds of the smallest force that exceeds a limit [N]; infinite if no force exceeds a limit."""
    low, forces = 0.0, np.geomspace(SMALLEST * largest, largest, FORCES)
    high = np.inf
    for _ in range(ITERATIONS):
        exceeded = is_exceeded(forces)
        if not exceeded.any():
            return (low, high) if np.isfinite(high) else (np.inf, np.inf)
        first = int(np.argmax(exceeded))
        low, high = float(forces[first - 1]) if first else low, float(forces[first])
        forces = np.linspace(low, high, FORCES + 1)[1:]
    return low, high


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
    unit, place = ForceUnit.of(robot), "position" if is_underconstrained(robot) else "pose"
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


def _reserve_text(response: PushResponse, reserve: _Reserve, unit: ForceUnit) -> str:
    """Text of the difference between a reserve and the force."""
    if not np.isfinite(reserve.force):
        return "no limit found"
    more = reserve.force - response.force
    limit = "" if reserve.cable is None else f" (cable {reserve.cable}, {'upper' if reserve.upper else 'lower'} limit)"
    return f"{unit.written(more)} more{limit}" if more >= 0.0 else f"{unit.written(-more)} beyond the limit{limit}"


def _compliance_text(response: PushResponse, drawn_for: float | None) -> str:
    if not np.isfinite(response.compliance).all():
        return "unlimited: no cable resists a motion in some direction"
    least, middle, most = (n(1e3 * length, ".2g", "mm/N") for length in response.semi_axes[0])
    drawn = "" if drawn_for is None else f"; drawn as for {n(drawn_for, '.3g', 'N')}"
    return f"{least}, {middle} and {most}{drawn}"


class PushFeature(Feature):
    """A folder with the fields of a typed or dragged force, and the response in the scene."""

    live = True

    def __init__(self, page: Page) -> None:
        """Build the folder."""
        self._page, self._size, self._nodes = page, page.size, Nodes(page.server.scene)
        self.body, self._ball = Solid.platform(page.robot), Solid.ball()
        mean = float(np.sqrt(page.scale.low * page.scale.high))
        self._stiffness = mean / (FAR * self._size)  # [N/m], force of a drag
        self.hold: tuple[int, Array] | None = None  # client, and the point that it drags, platform frame [m]
        self.response: PushResponse | None = None
        self._unit = ForceUnit.of(page.robot)
        page.channel.on(TOPIC, self._on_drag)
        page.server.on_client_disconnect(lambda client: page.later(lambda: self._leave(client.client_id)))
        gui, center = page.server.gui, page.robot.center_of_mass.tolist()
        with gui.add_folder("Push", expand_by_default=False, order=FIRST + 0.02):
            self._text = gui.add_html(HELP)
            hint = "On the platform; 0 for none."
            self._force: Any = gui.add_number(f"Force [{self._unit.name}]", 0.0, min=0.0, step=0.1, hint=hint)
            hint = "Direction of the force, of any length."
            self._direction: Any = gui.add_vector3("Along x, y, z", (0.0, 0.0, -1.0), step=0.01, hint=hint)
            hint = "Point of application in the platform frame; at first the center of mass."
            self._at: Any = gui.add_vector3("At x, y, z [m]", tuple(center), step=0.001, hint=hint)
            hint = "Or hold Shift when you release the mouse."
            self._keep: Any = gui.add_checkbox("Keep after release", False, hint=hint)
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
            push, state = self.push, view.state
            if push is None:
                self._show_none("")
            elif state is None:
                self._show_none(sentence("The response to a force is computed at a feasible pose at rest."))
            else:
                self._show(PushResponse.of(state, push), view.settings.error_scale)
        except SaglineError as error:
            self._show_none(refused(str(error)))

    def release(self) -> None:
        """Remove the force."""
        self.hold = None
        self._force.value = 0.0

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
            self._direction.value, self._at.value = tuple((push.force / size).tolist()), tuple(push.at.tolist())

    def _show_none(self, html: str) -> None:
        """Remove the drawing of the response, and write the reason; "" shows how to apply a force."""
        self._nodes.hide("/push", "/push_tip", "/push_below", "/pushed", "/gives_way")
        self._text.content, self._release.visible = html or HELP, bool(html)
        self.response = None

    def _show(self, response: PushResponse, error_scale: float) -> None:
        """Draw the force, the largest force in its direction, the displaced platform and the ellipsoid of stiffness."""
        nodes, size, unit, drawn_for = self._nodes, self._size, ForceUnit.of(response.state.one_robot), None
        lengths, directions = response.semi_axes
        if self._ellipsoid.value and np.isfinite(lengths).all():
            drawn_for = readable(lengths, LARGE * size)
        start, arrow = response.state.pose.transform(response.push.at), response.push.force / self._stiffness
        if self.hold is None:
            arrow = arrow * min(1.0, LONGEST * size / max(float(np.linalg.norm(arrow)), 1e-300))
        tip, below = start + arrow, start - np.array([0.0, 0.0, _BELOW * size])
        nodes.arrows("/push", np.stack((start, tip))[None], MARK, *(_ARROW * size))
        nodes.label("/push_tip", f"{unit.written(response.force)}: moves {_motion_text(response)}", tip)
        nodes.label("/push_below", _reserve_text(response, response.reserve, unit), below, "top-center", 0.85)
        pose = response.scaled_pose(error_scale)
        if pose is None:
            nodes.hide("/pushed")
        else:
            nodes.body("/pushed", self.body, MARK, GHOST_OPACITY, pose)
        if drawn_for is None:
            nodes.hide("/gives_way")
        else:
            (wxyz,), ((x, y, z),) = placed_balls(drawn_for * lengths[None], directions[None])
            looks: dict[str, Any] = {"wxyz": wxyz, "scale": (x, y, z), "position": start, **NO_SHADOW}
            nodes.mesh("/gives_way", *self._ball, MARK, BALL_OPACITY, **looks)
        self._text.content, self._release.visible = response_text(response, drawn_for), True
        self.response = response

    def _leave(self, client: int) -> None:
        if self.hold is not None and self.hold[0] == client:
            self.release()

    def _on_drag(self, value: Any, client: int) -> None:
        """Apply the force of a drag; `value` is unchecked data of a client."""
        if not isinstance(value, dict):
            return
        phase, at = value.get("phase"), finite_numbers(value.get("at"), 2, OUTSIDE)
        camera, state = Camera.of_client(self._page.server, client), self._page.state
        if at is None or camera is None:
            return
        if phase == "start":
            self._grab(camera, at, client)
        elif self.hold is None or self.hold[0] != client:
            return
        elif phase in ("move", "end") and state is not None:
            start = state.pose.transform(self.hold[1])
            depth = float((start - camera.place) @ camera.axes[:, 2])  # the drag ends at the same depth
            self._type(Push(self._stiffness * (camera.place + depth * camera.ray(at) - start), self.hold[1]))
        if phase == "cancel" or (phase == "end" and not (self._keep.value or value.get("keep") is True)):
            self.release()
        elif phase == "end":
            self.hold = None

    def _grab(self, camera: Camera, at: Array, client: int) -> None:
        """Hold the platform point that is visible at a point of the picture, if there is one."""
        if (state := self._page.state) is None:
            return
        back = state.pose.matrix.T
        start, direction = back @ (camera.place - state.pose.position), back @ camera.ray(at)
        distance = self.body.ray_distance(start, direction)
        if distance is not None:
            self.hold = client, start + distance * direction
            return
        points = self.body.vertices[self.body.faces].mean(axis=1)  # the ray easily misses a thin platform
        places, depth = camera.project(state.pose.transform(points))
        away = np.linalg.norm(places - at * camera.pixels, axis=1)
        away[~(depth > 0.0)] = np.inf  # behind the camera
        if away.min() <= NEAR:
            self.hold = client, points[away.argmin()]


def _numbers(value: Any, count: int, item: str, allowed: str) -> Array:
    """`count` finite numbers from `value`, the value of a field, which viser does not check."""
    try:
        found = np.asarray(value, dtype=np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise InvalidValueError(f"push: {item}", "not a number", allowed, "Type another, or release the force.")
    return found
