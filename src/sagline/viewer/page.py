"""Page of a robot. One thread waits for a change, solves and draws; callbacks only wake this thread."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from os import PathLike, fspath
from typing import Any, NamedTuple, TypeVar

import numpy as np
import viser

from sagline.calibration.result import Calibration
from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.kinematics.inverse_rows import Given
from sagline.kinematics.plan import Plan
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import check_reach, is_underconstrained
from sagline.robot.reach import home_pose as home_pose
from sagline.robot.robot import Robot
from sagline.viewer import readout, shapes
from sagline.viewer.camera import Framing
from sagline.viewer.feature import Feature, View
from sagline.viewer.panel import ControlPanel
from sagline.viewer.player import Beside, InMotion, Played, Player
from sagline.viewer.robot_scene import APART, TRACE_POINTS, RobotScene
from sagline.viewer.server import Channel
from sagline.viewer.snapshot import MissingWrench, Settings, Snapshot, depends_on_history, snapshot_at
from sagline.viewer.tension_scale import TensionScale

FRAME_TIME = 1.0 / 60.0  # shortest time between updates [s]
SOON = 0.05  # longest wait for the result of a background task, and of the readings during a drag [s]
IDLE = 0.5  # longest wait [s], which also is the longest delay of Ctrl-C on systems that cannot interrupt a wait

F = TypeVar("F", bound=Feature)


class Source(NamedTuple):
    """Python expressions that make the objects with which a page was opened."""

    robot: str = ""  # robot; "" if unknown
    mass: float | None = None  # mass of the platform with a payload [kg]; None for the robot's own mass
    played: str = ""  # plan, simulation or execution; "" if there is none

    @classmethod
    def of_robot(cls, name_or_path: str | PathLike[str], mass: float | None = None) -> Source:
        """Expression of a robot from its name or its file, with another `mass` [kg] if `mass` is given."""
        return cls(f"sl.load_robot({fspath(name_or_path)!r})", mass)

    @classmethod
    def of_file(cls, kind: str, file: PathLike[str]) -> Source:
        """Expression of a plan, simulation, execution or calibration that is loaded from a file."""
        loaded = f"sl.load_{kind}({fspath(file)!r})"
        robot = f"{loaded}.state.one_robot" if kind == "plan" else f"{loaded}.robot"
        return cls(robot, None, "" if kind == "calibration" else loaded)


class Page:
    """Page of a robot, optionally with a run or simulation. The caller starts and stops the server."""

    # Only the thread of `serve` uses the state of the page. Other threads call `later`, `refresh`, `extend` and `stop`.

    def __init__(
        self,
        server: viser.ViserServer,
        features: Sequence[Callable[[Page], Feature | None]],
        robot: Robot,
        played: Played | None = None,
        wrench: Array | None = None,
        pose: Pose | None = None,
        mode: str = "",
        found: Calibration | None = None,
        source: Source | None = None,
        beside: Beside | None = None,
        given: tuple[Given, ...] | None = None,
        stopping: threading.Event | None = None,
    ) -> None:
        """Build the page of a running `server` without contents."""
        # robot: if a motion is played, its robot
        # wrench: external wrench on the platform while it is dragged, shape (6,), as in `inverse`; None for zero
        # mode: name of the initially animated mode, "1" or "massless 1"; "" for none
        # found: a calibration of the robot to show
        # source: expressions for the objects with which the page was opened
        # beside: a second run of the robot with the same clock
        # given: given values of an underconstrained platform, as in `inverse`
        # stopping: event that ends `serve`
        self.server, self.robot, self.wrench = server, robot, wrench
        self.mode, self.found, self.source = mode, found, source or Source()
        self._wake, self._stopping = threading.Event(), stopping or threading.Event()
        self._tasks: deque[Callable[[], None]] = deque()  # any thread may append
        self.scale, self.size = TensionScale.of(robot), shapes.size_of(robot)
        self.channel = Channel(server.gui, self.later)
        server.on_client_connect(self.channel.connect)
        server.on_client_disconnect(self.channel.disconnect)
        home = home_pose(robot) if played is None else played.at(0.0).pose
        self.home = home if pose is None else pose  # initial pose of the platform
        self.panel = ControlPanel(server, robot, self.scale, self.refresh, partial(self.later, self._forget), given)
        self.scene = RobotScene(server.scene, robot, self.home)
        self.extent = self.scene.extent(self.home)  # lowest and highest corner of everything that is drawn [m]
        self.framing = Framing(server, *self.extent)
        self.view: View | None = None  # the shown view, which is replaced after all features have followed the new view
        self.updates = 0  # number of views that were shown
        self.dragging: set[int | None] = set()  # clients that drag the platform
        self.previous: Plan | None = None  # plan of the previous pose, for a method that depends on history
        self.features: tuple[Feature, ...] = ()  # in the order of their updates
        self.player = Player(played, self._put_on, beside)
        self.features = tuple(feature for make in features if (feature := make(self)) is not None)
        self._build_gizmo()
        self._depended: dict[Feature, Hashable] = {}  # key of each feature at its last update
        self._live: tuple[Feature, ...] = ()  # features that follow every view at present
        self._drawn: View | None = None  # the view in the scene, which readings and features follow later
        self._whole, self._followed = True, 0.0  # True after a change other than a drag; time of the last `_follow` [s]
        self._traced: tuple[Played | None, float] = (None, 0.0)  # motion and scale of the drawn traces
        self._changed: tuple[tuple[float, float, float], Robot] | None = None  # settings, and the robot with these

    def serve(self) -> None:
        """React to clients until `stop`; the calling thread does all the work."""
        self._update()
        last = time.monotonic()
        while not self._stopping.is_set():
            pace = self._pace
            self._wake.wait(timeout=pace)
            rest = FRAME_TIME - (time.monotonic() - last)
            if rest > 0.0:
                time.sleep(rest)
            now = time.monotonic()
            changed = self._wake.is_set() or self.player.playing or bool(self._tasks)
            whole = pace == FRAME_TIME or now - self._followed >= SOON
            if changed:
                self._wake.clear()
                whole, self._whole = whole or self._whole, False
                self.player.advance(now - last)
                self._draw()
            if whole:
                self._follow()
            self.updates += changed
            last = now

    def later(self, task: Callable[[], None]) -> None:
        """Make the serving thread call a function; any thread may call this method."""
        self._tasks.append(task)
        self.refresh()

    def refresh(self) -> None:
        """Solve and draw the page again; any thread may call this method."""
        self._whole = True
        self._wake.set()

    def extend(self, played: Played) -> None:
        """Replace the played motion by a longer version of it; any thread may call this method."""
        # a clock at its end moves to the new end; a clock at an earlier time stays there
        self.later(lambda: self.player.extend(played))

    def stop(self) -> None:
        """Make `serve` return; any thread may call this method."""
        self._stopping.set()
        self._wake.set()

    def refresh_on(self, *handles: Any) -> None:
        """Refresh when one of these controls changes."""
        for handle in handles:
            handle.on_update(lambda _: self.refresh())

    @property
    def state(self) -> Equilibrium | None:
        """The shown equilibrium; None during a motion, and if the pose is not feasible."""
        return None if self.view is None else self.view.state

    def feature(self, kind: type[F]) -> F:
        """The feature of the type `kind`."""
        return next(each for each in self.features if isinstance(each, kind))

    def go(self, pose: Pose) -> None:
        """Move the platform to a pose. Cameras that would lose sight of the platform follow it."""
        self.player.leave()
        self.framing.pan(np.asarray(self.scene.gizmo.position), pose.position)
        self.scene.place(pose)
        self.refresh()

    def go_home(self) -> None:
        """Move the platform home."""
        self.go(self.home)

    def go_near(self, pose: Pose) -> None:
        """Move the platform to a pose, unless it is out of reach."""
        self.check_near(pose)
        self.go(pose)

    def check_near(self, pose: Pose) -> None:
        """Reject a pose that is out of reach."""
        self.scene.check_near(pose.position)
        both = np.stack((self.home.position, pose.position)), np.stack((self.home.quaternion, pose.quaternion))
        check_reach(self.robot, Pose.from_quaternion(*both), "pose")

    @property
    def _pace(self) -> float:
        """Longest wait until the next update [s]."""
        if self._drawn is not self.view:
            return SOON
        if self.player.playing or any(feature.moving for feature in self.features):
            return FRAME_TIME
        return SOON if any(feature.waiting for feature in self.features) else IDLE

    def _put_on(self, played: Played | None) -> None:
        self._traced = None, 0.0
        if played is None:
            self.scene.show_traces(np.empty((0, 3)), np.empty((0, 3)))
        for feature in self.features:
            feature.put_on(played)

    def _build_gizmo(self) -> None:
        @self.scene.gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == "start":
                self.dragging.add(event.client_id)
                self.later(self.player.leave)
            elif event.phase == "end":
                self.dragging.discard(event.client_id)
                self.refresh()
            self._wake.set()

        self.server.on_client_disconnect(lambda client: self.dragging.discard(client.client_id))
        home = self.server.gui.add_button("Platform back home", icon=viser.Icon.HOME)
        home.on_click(lambda _: self.later(self.go_home))

    def _forget(self) -> None:
        self.previous = None

    def _update(self) -> None:
        self._draw()
        self._follow()

    def _draw(self) -> None:
        """Do the tasks of other threads, then solve and draw. Readings and most features follow later."""
        player, panel = self.player, self.panel
        while self._tasks:
            self._tasks.popleft()()
        try:
            settings = panel.settings()
            snapshot = player.now() if player.following else self._from_gizmo(settings)
        except SaglineError as error:
            panel.verdict.content = readout.refused(str(error))
            self._drawn = self.view  # the verdict stays until the next drawing
            return
        played = player.played if player.following else None
        scale, ghost = panel.color_scale(snapshot.tension), bool(panel.ghost.value)
        missing = None if isinstance(snapshot, InMotion) or snapshot.feasible else MissingWrench.of(snapshot)
        view = View(snapshot, settings, scale, ghost, self.wrench, played, missing, playing=player.playing)
        with self.server.atomic():
            if played is not None:
                self.scene.place(snapshot.pose)
            elif is_underconstrained(self.robot):
                self.scene.turn(snapshot.pose)
            self.scene.show(snapshot, scale, settings.sag_scale, settings.error_scale, ghost=ghost)
            traced = player.played, settings.error_scale
            if player.played is not None and traced != self._traced:
                self._traced = traced
                self.scene.show_traces(*player.played.traces(TRACE_POINTS, settings.error_scale))
        self._drawn = view
        self._inform(view, self._live)

    def _from_gizmo(self, settings: Settings) -> Snapshot:
        if self._changed is None or self._changed[0] != settings.changes:
            self._changed = (settings.changes, settings.applied(self.robot))
        robot, pose = self._changed[1], self.scene.dragged_pose()
        snapshot = snapshot_at(robot, pose, settings, self.previous, self.wrench)
        if not depends_on_history(settings.tension):
            self._forget()  # the tensions of another method are not a history
        elif snapshot.feasible:
            self.previous = snapshot.plan
        return snapshot

    def _follow(self) -> None:
        """Update readings and features for the view in the scene, and do the periodic work of the features."""
        view, self._followed = self._drawn, time.monotonic()
        if view is not None and view is not self.view:
            self.panel.show(view, APART * self.size)
            self._inform(view, self.features)
            self._live = tuple(each for each in self.features if each.live and self._depended[each] is not None)
            self.view = view
        for feature in self.features:
            feature.tick()

    def _inform(self, view: View, features: Sequence[Feature]) -> None:
        """Let features follow a view if what they depend on has changed."""
        for feature in features:
            key = feature.depends(view)
            if feature not in self._depended or self._depended[feature] != key:
                self._depended[feature] = key
                feature.follow(view)
