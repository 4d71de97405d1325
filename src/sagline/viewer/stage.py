"""The scene in the browser: what is built once, and what follows every snapshot."""

from __future__ import annotations

from typing import Final

import numpy as np
import viser

from sagline.arrays import Array
from sagline.errors import InvalidValueError
from sagline.robot.pattern import ROTATING
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import lines, solids
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale

STEEL, DRUM, FLOOR = (120, 128, 138), (60, 66, 74), (225, 228, 232)
PLATFORM, INFEASIBLE, REST = (95, 165, 225), (230, 50, 45), (240, 165, 20)
WANTED, ACTUAL = (0, 114, 178), (213, 94, 0)
GHOST = (150, 150, 150)
CABLE_WIDTH, GHOST_WIDTH, TRACE_WIDTH = 3.5, 1.5, 2.5  # px
NEAR = 0.03  # of the robot's size: anchors this close share a label
FAR = 5.0  # sizes of the robot from its middle: no gizmo is dragged there, only nonsense comes from there
_HOME_VIEW: Final = np.array([0.42, -0.86, 0.30])  # from the middle of the robot to the camera, of its size


class Stage:
    """The robot's parts on a viser server. Every client sees, and may drag, the same."""

    def __init__(self, server: viser.ViserServer, robot: Robot, home: Pose) -> None:
        """Build the scene with the platform at home."""
        self._scene = server.scene
        self._scene.configure_default_lights(cast_shadow=False)  # a small screen has better things to compute
        self._low, self._high = solids.bounds(robot)
        self._size = solids.size_of(robot)
        self._aim(server)
        self._build_surroundings(robot)
        body = solids.platform(robot)
        self._gizmo = self._build_gizmo(robot, body)
        self._platform = self._scene.add_mesh_simple("/platform/body", body.vertices, body.faces, color=PLATFORM)
        self._rest_frame = self._scene.add_frame("/rest", show_axes=False, visible=False)
        self._scene.add_mesh_simple("/rest/body", body.vertices, body.faces, color=REST, opacity=0.55)
        blank = np.zeros((robot.cable_count * (lines.POINTS - 1), 2, 3))
        self._cables = self._scene.add_line_segments(
            "/cables", blank, GHOST, thickness=CABLE_WIDTH, thickness_units="screen"
        )
        self._cables.colors = np.zeros(blank.shape, dtype=np.uint8)
        self._ghost = self._scene.add_line_segments(
            "/chords", blank[: robot.cable_count], GHOST, thickness=GHOST_WIDTH, thickness_units="screen", visible=False
        )
        self._notice = self._scene.add_label(
            "/platform/notice", "", position=(0.0, 0.0, 0.13 * self._size), visible=False, anchor="bottom-center"
        )
        self.move_gizmo(home)

    @property
    def gizmo(self) -> viser.TransformControlsHandle:
        """What is dragged."""
        return self._gizmo

    def dragged_pose(self) -> Pose:
        """Where the gizmo is.

        Raises:
            InvalidValueError: If a client sent what is no pose, or one far outside of the robot.
        """
        position = np.asarray(self._gizmo.position, dtype=np.float64).reshape(-1)
        wxyz = np.asarray(self._gizmo.wxyz, dtype=np.float64).reshape(-1)
        length = float(np.linalg.norm(wxyz)) if wxyz.size == 4 else 0.0
        far = FAR * self._size
        middle = 0.5 * (self._low + self._high)
        if position.size != 3 or not np.all(np.abs(position - middle) < far) or not 0.5 < length < 2.0:
            raise InvalidValueError(
                "platform", "dragged out of sight", f"within {far:.3g} m of the robot", "Drag it back, or reset it."
            )
        return Pose.from_quaternion(position, np.roll(wxyz, -1) / length)

    def move_gizmo(self, pose: Pose) -> None:
        """Put the gizmo, and with it the platform, at a pose."""
        self._gizmo.position = pose.position
        self._gizmo.wxyz = np.roll(pose.quaternion, 1)

    def show(
        self, snapshot: Snapshot, scale: TensionScale, sag_scale: float, error_scale: float, *, ghost: bool
    ) -> None:
        """Draw a snapshot; the platform itself follows the gizmo."""
        self._cables.points = snapshot.cable_segments(sag_scale).astype(np.float32)
        self._cables.colors = snapshot.cable_colors(scale)
        self._platform.color = PLATFORM if snapshot.feasible else INFEASIBLE
        self._notice.visible = not snapshot.feasible
        if not snapshot.feasible:
            self._notice.text = f"not feasible: {snapshot.reason}"
        self._ghost.visible = ghost
        if ghost:
            self._ghost.points = lines.chords(snapshot.robot, snapshot.pose).astype(np.float32)
        rest = snapshot.drawn_rest(error_scale)
        shown = rest is not None and bool(np.isfinite(rest).all())
        self._rest_frame.visible = shown
        if shown and rest is not None and snapshot.rest is not None:
            self._rest_frame.position = rest
            self._rest_frame.wxyz = np.roll(snapshot.rest.quaternion, 1)

    def show_traces(self, wanted: Array, actual: Array) -> None:
        """Draw the desired and the actual path (n, 3); gaps where they are NaN."""
        for name, points, color in (("/wanted", wanted, WANTED), ("/actual", actual, ACTUAL)):
            pairs = np.stack((points[:-1], points[1:]), axis=1)
            known = pairs[np.isfinite(pairs).all(axis=(1, 2))]
            if len(known):
                self._scene.add_line_segments(name, known, color, thickness=TRACE_WIDTH, thickness_units="screen")

    def _aim(self, server: viser.ViserServer) -> None:
        middle = 0.5 * (self._low + self._high)
        server.initial_camera.look_at = middle
        server.initial_camera.position = middle + self._size * _HOME_VIEW
        server.initial_camera.up = np.array([0.0, 0.0, 1.0])
        server.initial_camera.far = 20.0 * self._size
        server.initial_camera.near = 0.002 * self._size

    def _build_surroundings(self, robot: Robot) -> None:
        frame, drums = solids.frame(robot), solids.winches(robot)
        self._scene.add_mesh_simple("/frame", frame.vertices, frame.faces, color=STEEL)
        self._scene.add_mesh_simple("/winches", drums.vertices, drums.faces, color=DRUM)
        width, depth = 1.5 * (self._high - self._low)[:2]
        cell = 10.0 ** np.floor(np.log10(self._size / 5.0))
        middle = 0.5 * (self._low + self._high)
        self._scene.add_grid(
            "/floor", width, depth, position=(middle[0], middle[1], self._low[2] - 0.005 * self._size),
            cell_size=cell, section_size=5.0 * cell, cell_color=FLOOR, section_color=(200, 204, 210),
        )  # fmt: skip
        for place, names in _neighbors(robot.frame_anchors, NEAR * self._size):
            self._scene.add_label(
                f"/names/{names[0]}",
                ", ".join(map(str, names)),
                position=place + np.array([0.0, 0.0, NEAR * self._size]),
                anchor="bottom-center",
            )

    def _build_gizmo(self, robot: Robot, body: solids.Solid) -> viser.TransformControlsHandle:
        free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5  # world axes along which the platform may move
        reach = max(2.0 * float(np.abs(body.vertices).max()), 0.11 * self._size)
        return self._scene.add_transform_controls(
            "/platform", scale=reach, line_width=3.0, depth_test=False, opacity=0.7,
            active_axes=(bool(free[0]), bool(free[1]), bool(free[2])),
            disable_rotations=robot.motion_pattern not in ROTATING,
        )  # fmt: skip


def _neighbors(points: Array, near: float) -> list[tuple[Array, list[int]]]:
    """Points (m, 3) in groups about as close as `near`: the middle of each group, and who is in it."""
    groups: list[list[int]] = []
    for i, point in enumerate(points):
        home = next((group for group in groups if np.linalg.norm(points[group[0]] - point) < near), None)
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    return [(points[group].mean(axis=0), group) for group in groups]
