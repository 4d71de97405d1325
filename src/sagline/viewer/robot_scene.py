"""Robot in the scene, and nodes that features add."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array, Indices
from sagline.core.errors import InvalidValueError
from sagline.robot.batch import on_platform, pulley_radius
from sagline.robot.checks import ROTATING
from sagline.robot.pose import Pose, unit
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.viewer import shapes
from sagline.viewer.player import Configuration, InMotion
from sagline.viewer.readout import headline
from sagline.viewer.shapes import Solid
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import Colors, TensionScale

NO_SHADOW: Final[dict[str, Any]] = {"cast_shadow": False, "receive_shadow": False}


class Nodes:
    """Nodes of a scene by name. A node is created when it is first drawn, and updated afterward."""

    def __init__(self, scene: viser.SceneApi, pixel: float = 0.0) -> None:
        """Begin without nodes; `pixel` is the size of a pixel [m], 0 for line widths in pixels of the screen."""
        self.scene, self._pixel = scene, pixel
        self._made: dict[str, Any] = {}

    def draw(self, name: str, make: Callable[..., Any], *, visible: bool = True, **values: Any) -> Any:
        """Show a node with these values; `make`, a method of the scene, creates it."""
        node = self._made.get(name)
        points = values.get("points")
        if node is not None and points is not None and len(node.points) != len(points):
            node.remove()  # if the number changes, points and colors would not arrive together
            node = None
        if node is None:
            node = self._made[name] = make(name, visible=visible, **values)
            return node
        for key, value in values.items():
            setattr(node, key, value)
        node.visible = visible
        return node

    def lines(self, name: str, segments: Array, color: Any, width: float) -> Any:
        """Draw segments (k, 2, 3) of a width [px], in one color or in the colors of their ends."""
        if not len(segments):
            return self.hide(name)
        units, thickness = ("screen", width) if self._pixel == 0.0 else ("world", width * self._pixel)
        shade = np.asarray(color, dtype=np.uint8)
        looks: dict[str, Any] = {"colors": shade, "thickness": thickness, "thickness_units": units}
        return self.draw(name, self.scene.add_line_segments, points=segments.astype(np.float32), **looks)

    def arrows(self, name: str, ends: Array, color: Any, shaft: float, head: float, length: float) -> None:
        """Draw arrows from `ends` (k, 2, 3); `shaft` and `head`: radii, `length`: length of the head [m]."""
        colors = np.broadcast_to(np.asarray(color, dtype=np.uint8), (len(ends), 3))
        sizes: dict[str, Any] = {"shaft_radius": shaft, "head_radius": head, "head_length": length}
        self.draw(name, self.scene.add_arrows, points=ends.astype(np.float32), colors=colors, **sizes)

    def label(self, name: str, text: str, position: Any, anchor: str = "bottom-center", scale: float = 1.0) -> None:
        """Write a text at a position."""
        looks: dict[str, Any] = {"position": position, "anchor": anchor, "font_screen_scale": scale}
        self.draw(name, self.scene.add_label, visible=bool(text), text=text, **looks)

    def body(self, name: str, solid: Solid, color: Any, opacity: float, pose: Pose, position: Any = None) -> None:
        """Draw a solid at a pose. `position` replaces the position of the pose."""
        place = pose.position if position is None else position
        self.draw(name, self.scene.add_frame, show_axes=False, position=place, wxyz=np.roll(pose.quaternion, 1))
        self.mesh(f"{name}/body", *solid, color, opacity)

    def mesh(self, name: str, vertices: Array, faces: Indices, color: Any, opacity: Any = None, **looks: Any) -> Any:
        """Draw a mesh in one color."""
        looks |= {"vertices": vertices.astype(np.float32), "faces": faces.astype(np.uint32)}
        return self.draw(name, self.scene.add_mesh_simple, color=color, opacity=opacity, **looks)

    def hide(self, *names: str) -> None:
        """Hide nodes, if they exist."""
        for name in names:
            if name in self._made:
                self._made[name].visible = False

    def keep_first(self, name: str, count: int) -> None:
        """Keep the first `count` numbered nodes below `name`, and remove the others."""
        while f"{name}/{count}" in self._made:
            self.remove(f"{name}/{count}")
            count += 1

    def remove(self, *names: str) -> None:
        """Remove nodes and the nodes below them, if they exist."""
        for name in names:
            for found in [each for each in self._made if each == name or each.startswith(f"{name}/")][::-1]:
                self._made.pop(found).remove()


# Colors have a contrast of at least 3 : 1 on the white and on the dark background, except for the floor.
STEEL, DRUM, FLOOR, SECTION = (120, 128, 138), (104, 112, 122), (172, 178, 186), (132, 138, 146)
PLATFORM, INFEASIBLE, REST = (58, 134, 201), (220, 56, 48), (200, 118, 16)
TRUTH, MARK = (150, 90, 190), (200, 60, 130)  # the second one for the user's force and a chosen cable
SKY, GROUND, SKYLIGHT = (255, 255, 255), (130, 130, 130), 3.5  # light from above and below, and its intensity
WANTED, ACTUAL = PLATFORM, REST  # colors of the desired and the actual path
GHOST = (128, 134, 142)
CABLE_WIDTH, GHOST_WIDTH, TRACE_WIDTH, ARM_WIDTH = 3.5, 1.5, 2.5, 3.0  # line widths [px]
TRACE_POINTS = 600
NEAR = 0.03  # anchors closer than this have one label, as a share of the robot's size
FAR = 5.0  # largest valid distance of the platform from the middle of the robot, as a share of the robot's size
ROUNDING: Final = 1e-12  # smaller components of a pose from a browser are rounding errors [m], or of a quaternion
APART = 0.0035  # smallest visible distance between chord and cable, as a share of the robot's size
_ARM = 0.12  # longest arm of the axes, as a share of the robot's size
_BELOW: Final = np.array([0.02, 0.07, 0.03])  # space for the axes and their names, as shares of the robot's size
_ABOVE: Final = np.array([0.02, 0.0, 0.08])  # space for the names of cables, as shares of the robot's size
_GIZMO: Final = (0.09, 0.16)  # smallest and largest reach of the gizmo, as shares of the robot's size


class RobotScene:
    """The robot's parts in a scene, which all clients of a server see and can drag."""

    def __init__(
        self, scene: viser.SceneApi, robot: Robot, home: Pose, *, live: bool = True, pixel: float = 0.0
    ) -> None:
        """Build the scene with the platform at its home pose."""
        self._scene, self._live, self._nodes = scene, live, Nodes(scene, pixel)
        self._build_lights()
        self._low, self._high = shapes.bounds(robot)
        self._size = shapes.size_of(robot)
        self._winches = self._build_winches("", robot, aboard=False)
        self._build_surroundings(robot)
        body = self._body = Solid.platform(robot)
        # transform controls of the platform, which are only a frame in a scene for pictures
        frame: Any = None if live else scene.add_frame("/platform", show_axes=False)
        self.gizmo: viser.TransformControlsHandle = self._build_gizmo(robot, body) if live else frame
        self._platform = self._nodes.mesh("/platform/body", *body, PLATFORM)
        self._build_winches("/platform/body", robot, aboard=True)
        self._over_pulleys = pulley_radius(robot) > 0.0
        self._wheels = self._build_pulleys(robot, home) if self._over_pulleys.any() else None
        above = 0.0, 0.0, 0.13 * self._size
        self._notice = scene.add_label("/platform/notice", "", position=above, visible=False, anchor="bottom-center")
        self.place(home)

    def extent(self, pose: Pose) -> tuple[Array, Array]:
        """Lowest and highest corner of the whole drawing with the platform at a pose, with names and axes [m]."""
        corners = np.vstack((self._low, self._high, pose.transform(self._body.vertices), self._winches.vertices))
        return corners.min(axis=0) - _BELOW * self._size, corners.max(axis=0) + _ABOVE * self._size

    def dragged_pose(self) -> Pose:
        """Pose of the gizmo."""
        position = np.asarray(self.gizmo.position, dtype=np.float64).reshape(-1)
        wxyz = np.asarray(self.gizmo.wxyz, dtype=np.float64).reshape(-1)
        length = float(np.linalg.norm(wxyz)) if wxyz.size == 4 else 0.0
        if position.size != 3 or not 0.5 < length < 2.0:
            position = np.full(3, np.nan)
        self.check_near(position)
        return Pose.from_quaternion(_without_rounding(position), unit(np.roll(_without_rounding(wxyz), -1)))

    def check_near(self, position: Array) -> None:
        """Reject invalid positions and positions far outside the robot."""
        far = FAR * self._size
        if not np.all(np.abs(position - 0.5 * (self._low + self._high)) < far):
            allowed = f"within {far:.3g} m of the robot"
            raise InvalidValueError("platform", "dragged out of sight", allowed, "Drag it back, or reset it.")

    def place(self, pose: Pose) -> None:
        """Move the platform and its gizmo to a pose."""
        self.gizmo.position = pose.position
        self.gizmo.wxyz = np.roll(pose.quaternion, 1)

    def turn(self, pose: Pose) -> None:
        """Give the platform and its gizmo the rotation of a pose."""
        self.gizmo.wxyz = np.roll(pose.quaternion, 1)

    def show(
        self, snapshot: Configuration, scale: TensionScale, sag_scale: float, error_scale: float, *, ghost: bool
    ) -> None:
        """Draw a configuration; the platform itself follows the gizmo."""
        nodes, points = self._nodes, cable_segments(snapshot, sag_scale)
        self._cables = nodes.lines("/cables", points, cable_colors(snapshot, scale), CABLE_WIDTH)
        if self._wheels is not None:
            centers, turns = (each[self._over_pulleys].astype(np.float32) for each in snapshot.wheels())
            self._wheels.batched_positions, self._wheels.batched_wxyzs = centers, turns
        self._platform.color = PLATFORM if snapshot.solved else INFEASIBLE
        self._notice.visible = self._live and not snapshot.solved
        if isinstance(snapshot, Snapshot) and not snapshot.solved:
            self._notice.text = headline(snapshot)
        elif isinstance(snapshot, InMotion):
            self._notice.text = snapshot.notice
            self._show_other("/truth", TRUTH, snapshot.pose, snapshot.truth, error_scale)
        if ghost:
            nodes.lines("/chords", chord_segments(snapshot, sag_scale, APART * self._size), GHOST, GHOST_WIDTH)
        else:
            nodes.hide("/chords")
        self._show_other("/rest", REST, snapshot.pose, snapshot.rest, error_scale)

    def _show_other(self, name: str, color: Any, pose: Pose, other: Pose | None, error_scale: float) -> None:
        """Draw the platform at another pose, with its distance from `pose` scaled; hide it if this pose is unknown."""
        if other is None or not np.isfinite(other.position).all():
            self._nodes.hide(name)
        else:
            self._nodes.body(name, self._body, color, 0.55, other, scaled_position(pose, other, error_scale))

    def swing(self, rest: Pose, pose: Pose, courses: Array) -> None:
        """Draw the displaced platform and cables (m, P, 3), with the gizmo at the pose of rest."""
        back = rest.rotation.inv()
        self._platform.position = back.as_matrix() @ (pose.position - rest.position)
        self._platform.wxyz = np.roll((back * pose.rotation).as_quat(), 1)
        self._cables.points = shapes.segments(courses, dashed=False).astype(np.float32)

    def show_traces(self, wanted: Array, actual: Array) -> None:
        """Draw the desired and the actual path (n, 3) instead of the previous paths; NaN is a gap."""
        for name, points, color in (("/wanted", wanted, WANTED), ("/actual", actual, ACTUAL)):
            pairs = np.stack((points[:-1], points[1:]), axis=1)
            self._nodes.lines(name, pairs[np.isfinite(pairs).all(axis=(1, 2))], color, TRACE_WIDTH)

    def _build_lights(self) -> None:
        """Add light from above and below without shadows and environment map, for computers without a graphics card."""
        # on such computers, the environment map of viser would block the page for five seconds
        self._scene.configure_environment_map(hdri=None)
        self._scene.configure_default_lights(cast_shadow=False)
        self._scene.add_light_hemisphere(
            "/sky", sky_color=SKY, ground_color=GROUND, intensity=SKYLIGHT, position=(0.0, 0.0, 1.0)
        )

    def _build_surroundings(self, robot: Robot) -> None:
        nodes = self._nodes
        nodes.mesh("/frame", *Solid.frame(robot), STEEL)
        width, depth = 1.5 * (self._high - self._low)[:2]
        cell = shapes.round_below(self._size / 10.0)
        middle = 0.5 * (self._low + self._high)
        self._scene.add_grid(
            "/floor", width, depth, position=(middle[0], middle[1], self._low[2] - 0.005 * self._size),
            cell_size=cell, section_size=5.0 * cell, cell_color=FLOOR, section_color=SECTION,
            cell_thickness=0.6, section_thickness=1.0, fade_distance=12.0 * self._size,
        )  # fmt: skip
        self._build_axes()
        anchors = robot.frame_anchors
        for names in shapes.grouped(anchors, NEAR * self._size) if self._live else ():
            above = anchors[names].mean(axis=0) + np.array([0.0, 0.0, NEAR * self._size])
            nodes.label(f"/names/{names[0]}", ", ".join(map(str, names)), above)

    def _build_pulleys(self, robot: Robot, pose: Pose) -> viser.BatchedMeshHandle:
        """Draw pulleys in their real size; they swivel with the platform."""
        wheel, which = Solid.wheel(), self._over_pulleys
        centers, turns = (each[which] for each in shapes.wheels(robot, pose))
        return self._scene.add_batched_meshes_simple(
            "/pulleys", wheel.vertices, wheel.faces, turns, centers,
            batched_scales=pulley_radius(robot)[which], batched_colors=DRUM, flat_shading=True, lod="off",
        )  # fmt: skip

    def _build_winches(self, parent: str, robot: Robot, *, aboard: bool) -> Solid:
        """Draw drums and dead lengths of the frame or of the platform; dead lengths of unknown paths are dashed."""
        drums, (runs, known) = Solid.winches(robot, aboard=aboard), shapes.dead_runs(robot)
        if len(drums.faces):
            self._nodes.mesh(f"{parent}/winches", *drums, DRUM)
        drawn = (on_platform(robot) == aboard) & (runs[:, 0] != runs[:, 1]).any(axis=1)
        for name, which in (("dead", known), ("dead_assumed", ~known)):
            if (shown := runs[which & drawn]).size:
                pieces = shapes.segments(shapes.straight(shown), dashed=name != "dead")
                self._nodes.lines(f"{parent}/{name}", pieces, STEEL, GHOST_WIDTH)
        return drums

    def _build_axes(self) -> None:
        """Draw world axes at a corner of the floor, with a round length as the scale."""
        arm = shapes.round_below(_ARM * self._size)
        corner = self._low - np.array([0.0, 0.06 * self._size, 0.0])
        arms = np.stack((np.zeros((3, 3)), arm * np.eye(3)), axis=1) + corner
        self._nodes.lines("/axes", arms, STEEL, ARM_WIDTH)
        for name, place in zip("xyz", arms[:, 1], strict=True):
            self._nodes.label(f"/axes/{name}", name, place, scale=0.8)
        self._nodes.label("/axes/length", f"{arm:g} m", arms[0].mean(axis=0), "top-center", 0.8)

    def _build_gizmo(self, robot: Robot, body: shapes.Solid) -> viser.TransformControlsHandle:
        free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5  # world axes along which the platform can move
        least, most = (share * self._size for share in _GIZMO)
        return self._scene.add_transform_controls(
            "/platform", scale=float(np.clip(1.6 * np.abs(body.vertices).max(), least, most)), line_width=2.0,
            depth_test=True,  # drawn in front of objects behind the platform
            opacity=0.8,
            active_axes=(bool(free[0]), bool(free[1]), bool(free[2])),
            disable_rotations=robot.motion_pattern not in ROTATING or is_underconstrained(robot),
        )  # fmt: skip


def _without_rounding(values: Array) -> Array:
    """`values`, with 0 instead of a browser's rounding errors, which would tilt a level platform by 1e-48."""
    return np.where(np.abs(values) < ROUNDING, 0.0, values)


def scaled_position(pose: Pose, other: Pose, factor: float) -> Array:
    """Position of another pose with its distance scaled by a factor [m], shape (3,)."""
    return np.asarray(pose.position + factor * (other.position - pose.position))


def cable_segments(drawn: Configuration, sag_scale: float) -> Array:
    """Segments of the cables (m (P - 1), 2, 3), dashed if the pose is not feasible."""
    return shapes.segments(drawn.courses(sag_scale), dashed=not drawn.feasible)


def chord_segments(drawn: Configuration, sag_scale: float, apart: float) -> Array:
    """Segments of the chords, with zero length where the cable is closer to its chord than `apart` [m]."""
    free = drawn.courses(sag_scale)[:, -shapes.POINTS :]
    chords = shapes.straight(free[:, [0, -1]])
    return shapes.segments(chords, dashed=False, shown=np.linalg.norm(free - chords, axis=2) > apart)


def cable_colors(drawn: Configuration, scale: TensionScale) -> Colors:
    """Colors of both ends of every segment in the form for viser, shape (m (P - 1), 2, 3)."""
    ends = 2 * (shapes.points_per_cable(drawn.robot) - 1)
    return np.repeat(scale.linear_colors(drawn.tension), ends, axis=0).reshape(-1, 2, 3)
