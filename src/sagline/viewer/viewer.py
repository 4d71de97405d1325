"""The viewer itself: one thread that waits for a change, solves, and shows; callbacks only wake it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np
import viser

from sagline.calibration.result import Calibration
from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.kinematics.plan import Plan
from sagline.robot.bounds import home_pose as home_pose
from sagline.robot.pose import Pose
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.statics.stiffness import modes
from sagline.viewer import playback, readout, session, solids, swing
from sagline.viewer.camera import Framing
from sagline.viewer.channel import Channel
from sagline.viewer.drawn import Drawn
from sagline.viewer.feature import Aside, Reading, Show, View
from sagline.viewer.features.calibration import CalibrationShow
from sagline.viewer.features.cut import CutPanel, CutShow
from sagline.viewer.features.export import ExportPanel
from sagline.viewer.features.keyboard import KeysShow
from sagline.viewer.features.missing import MissingShow, MissingStage
from sagline.viewer.features.modes import ModeShow, ModesPanel
from sagline.viewer.features.proof import ForcePolygonShow
from sagline.viewer.features.push import PushShow
from sagline.viewer.features.region import SpaceShow, SpaceStage, planes_of
from sagline.viewer.features.state import StateShow, add_state_panel
from sagline.viewer.features.tensions import DotShow
from sagline.viewer.features.timeline import TimelineShow, TimelineStage
from sagline.viewer.free_travel import SpacePanel
from sagline.viewer.hull import hull_of
from sagline.viewer.link import Levers, LinkedControls, Linking
from sagline.viewer.panel import Panel
from sagline.viewer.playback import Moment
from sagline.viewer.player import Beside, Played, Player
from sagline.viewer.session import SessionMoment
from sagline.viewer.snapshot import Settings, Snapshot, taken_at
from sagline.viewer.stage import TRACE_POINTS, Stage
from sagline.viewer.state_code import Source
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.wording import remembers

FRAME_TIME = 1.0 / 60.0  # s: no update comes sooner after the one before
SOON = 0.05  # s: how long what is worked out beside the page may wait until it is shown
IDLE = 0.5  # s: how long Ctrl-C may go unheard where waiting cannot be interrupted


class Viewer:
    """A robot, perhaps with a run or a simulation, on a server that the caller has started and will stop.

    All its state belongs to the thread in `serve`; other threads only leave messages.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        played: Played | None = None,
        ready: Callable[[Reading], bool] = lambda _: True,
        wrench: Array | None = None,
        pose: Pose | None = None,
        mode: str = "",
        found: Calibration | None = None,
        source: Source | None = None,
        beside: Beside | None = None,
    ) -> None:
        """Build the page.

        Args:
            server: A running server with nothing on it.
            robot: The robot; that of what is played, if anything is.
            played: A run or a simulation, to play.
            ready: Whether a reading can be had without waiting; until then the page says that it comes. `refresh`
                when one has become ready.
            wrench: External wrench on the platform that is dragged, shape (6,), as `inverse` takes it; None for none.
            pose: Where the platform is at first; None for its home.
            mode: Name of the mode that moves at first, "1" or "massless 1"; "" for none.
            found: A calibration of the robot, to be shown with it; None for none.
            source: Where all this came from; None if nobody knows.
            beside: A second run of the robot, with the same clock; None for none.
        """
        self._ready = ready
        self._wrench = wrench
        self._server = server
        self._robot = robot
        self._wake = threading.Event()
        self._stopping = threading.Event()
        self._tasks: deque[Callable[[], None]] = deque()  # appended to by any thread
        self._scale = TensionScale.of(robot)
        self._channel = Channel(server.gui, self._soon)
        server.on_client_connect(self._channel.welcome)
        server.on_client_disconnect(self._channel.part)
        home = home_pose(robot) if played is None else played.home
        self._home = home if pose is None else pose
        self._panel = Panel(server, robot, self._scale, self._wake.set, lambda: self._soon(self._forget))
        self._stage = Stage(server.scene, robot, self._home)
        extent = self._stage.extent(self._home)
        self._framing = Framing(server, *extent)
        self._calibration = None if found is None else self._calibration_show(found)
        self._modes = self._mode_show(mode)
        self._space = self._space_show()
        self._push = PushShow(server, robot, self._channel, self._wake.set, self._soon, ready)
        cut_panel = self._build_cut_panel()
        self._export = ExportPanel(
            server, self._channel, lambda: self.view, lambda: (self._player.played, self._player.speed), extent
        )
        self._player = Player(played, self._put_on, beside)
        stage = TimelineStage(server.scene, robot, "" if beside is None else beside.names[1])
        timeline = TimelineShow(self._channel, self._player, stage)
        self._cuts = CutShow(server, self._channel, cut_panel, self._player, self._soon, self._go, ready)
        self._keys = KeysShow(self._channel, robot, self._go_near, self._go_home)
        balance = self._balance_shows(robot)
        state = self._state_show(source or Source())  # last: it knows the controls that there are
        shows = (
            *balance, self._calibration, self._modes, self._space, self._push, self._cuts, state, timeline, self._keys,
        )  # fmt: skip
        self._shows: tuple[Show, ...] = tuple(show for show in shows if show is not None)
        self._build_gizmo()
        self._changed: tuple[tuple[float, float, float], Robot] | None = None
        self._previous: Plan | None = None
        self.updates = 0
        self.shown = threading.Event()  # set when the first view stands
        self.view: View | None = None

    def serve(self) -> None:
        """Follow what clients do until `stop`; the calling thread does all the work."""
        self._update()
        last = time.monotonic()
        while not self._stopping.is_set():
            self._wake.wait(timeout=self._pace)
            rest = FRAME_TIME - (time.monotonic() - last)
            if rest > 0.0:
                time.sleep(rest)
            now = time.monotonic()
            if self._wake.is_set() or self._player.clock.playing or self._tasks:
                self._wake.clear()
                self._player.advance(now - last)
                self._work_off()
                self._update()
            for show in self._shows:
                show.tick()
            last = now

    def refresh(self) -> None:
        """Show everything once more; from any thread."""
        self._wake.set()

    def wait(self, what: str) -> None:
        """Say what the numbers wait for; from any thread."""
        self._panel.wait(what)

    def extend(self, played: Played) -> None:
        """Have what is played go on: it begins as what was played before, and is longer; from any thread.

        Who looks at its end sees the new end; who looks at an earlier time goes on doing that.
        """
        self._soon(lambda: self._extend(played))

    def stop(self) -> None:
        """Let `serve` return; from any thread."""
        self._stopping.set()
        self._wake.set()

    @property
    def _pace(self) -> float:
        """How long nothing needs to be drawn [s]."""
        if self._player.clock.playing or any(show.moving for show in self._shows):
            return FRAME_TIME
        return SOON if any(show.waiting for show in self._shows) else IDLE

    def _soon(self, task: Callable[[], None]) -> None:
        """Have the serving thread do something; from any thread."""
        self._tasks.append(task)
        self._wake.set()

    def _work_off(self) -> None:
        while self._tasks:
            self._tasks.popleft()()

    def _mode_show(self, mode: str) -> ModeShow:
        panel = ModesPanel(self._server.gui, self._panel.readings, self._wake.set, self._channel, mode)
        return ModeShow(panel, self._stage, Aside(self._soon), swing.vibrating, self._ready)

    def _space_show(self) -> SpaceShow:
        panel = SpacePanel(self._server.gui, self._panel.readings, planes_of(self._robot), self._wake.set)
        stage = SpaceStage(self._server, solids.size_of(self._robot))
        return SpaceShow(panel, stage, Aside(self._soon), hull_of, self._ready)

    def _balance_shows(self, robot: Robot) -> tuple[Show, ...]:
        """Which tensions, what is missing where there are none, and the forces that add up to nothing."""
        stage = MissingStage(self._server.scene, robot, self._scale)
        missing = MissingShow(self._panel, stage, Aside(self._soon), self._channel, self._go, self._ready)
        proof = ForcePolygonShow(
            self._server, self._panel.readings, solids.size_of(robot), self._wake.set, lambda: missing.missing
        )
        return DotShow(self._panel, self._channel, self._ready), missing, proof

    def _state_show(self, source: Source) -> StateShow:
        add_state_panel(self._server.gui)
        levers = Levers(self._check_near, self._go, self._pull, self._panel.choose_by_hand, self.refresh)
        controls = LinkedControls(self._server.gui)
        self._linked = Linking(self._robot, source, controls, self._framing, self._player, levers)
        return StateShow(self._channel, self._player, self._robot, source, self._go_near, self._linked)

    def _calibration_show(self, found: Calibration) -> CalibrationShow:
        return CalibrationShow(
            self._server, self._panel.readings, found, self._wake.set, self._soon, self._go, self._channel
        )

    def _build_cut_panel(self) -> CutPanel:
        return CutPanel(
            self._server.gui,
            self._robot,
            lambda: self._soon(self._cuts.choose),
            lambda: self._soon(self._cuts.cut),
            lambda: self._soon(self._cuts.calm),
        )

    def _put_on(self, played: Played | None) -> None:
        """Something else is played, or nothing."""
        self._traced = 0.0
        if played is None:
            self._stage.show_traces(np.empty((0, 3)), np.empty((0, 3)))
        self._export.offer_film(None if played is None else played.name)

    def _extend(self, played: Played) -> None:
        self._player.extend(played)
        self._traced = 0.0

    def _build_gizmo(self) -> None:
        @self._stage.gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == "start":
                self._soon(self._player.leave)
            self._wake.set()

        home = self._server.gui.add_button("Platform back home", icon=viser.Icon.HOME)
        home.on_click(lambda _: self._soon(self._go_home))

    def _go_home(self) -> None:
        self._go(self._home)

    def _go(self, pose: Pose) -> None:
        self._player.leave()
        self._stage.place(pose)
        self.refresh()

    def _go_near(self, pose: Pose) -> None:
        self._check_near(pose)
        self._go(pose)

    def _check_near(self, pose: Pose) -> None:
        """Refuse a pose that anybody may have asked for, where no drag leads."""
        self._stage.check_near(pose.position)
        both = np.stack((self._home.position, pose.position)), np.stack((self._home.quaternion, pose.quaternion))
        check_reach(self._robot, Pose.from_quaternion(*both), "pose")

    def _pull(self, wrench: Array | None) -> None:
        """Put a wrench on the platform, or none."""
        self._wrench = wrench

    def _forget(self) -> None:
        self._previous = None

    def _update(self) -> None:
        """Solve and show once."""
        player = self._player
        try:
            settings = self._panel.settings()
            snapshot = player.sight() if player.following else self._from_gizmo(settings)
        except SaglineError as error:
            self._panel.refuse(str(error))
            return
        played = player.played if player.following else None
        self._panel.show_what_if("" if played is None else played.still)
        self._show(
            View(snapshot, settings, self._scale, self._panel.ghost, self._wrench, played, playing=player.clock.playing)
        )

    def _from_gizmo(self, settings: Settings) -> Snapshot:
        if self._changed is None or self._changed[0] != settings.changes:
            self._changed = (settings.changes, settings.applied(self._robot))
        snapshot = taken_at(
            self._changed[1],
            self._stage.dragged_pose(),
            settings,
            self._previous,
            confirmed=self._ready(Reading.REST),
            wrench=self._wrench,
        )
        if not remembers(settings.tension):
            self._forget()  # what one comes from by another way of sharing is no way there
        elif snapshot.feasible:
            self._previous = snapshot.plan
        return snapshot

    def _show(self, view: View) -> None:
        snapshot, settings, played = view.snapshot, view.settings, self._player.played
        with self._server.atomic():
            if view.played is not None:
                self._stage.place(snapshot.pose)
            self._stage.show(snapshot, self._scale, settings.sag_scale, settings.error_scale, ghost=view.ghost)
            if played is not None and settings.error_scale != self._traced:
                self._traced = settings.error_scale
                self._stage.show_traces(*played.traces(TRACE_POINTS, settings.error_scale))
        self._panel.read_out(*self._words(snapshot))
        for show in self._shows:
            show.follow(view)
        self.view = view
        self.updates += 1
        self.shown.set()

    def _words(self, snapshot: Snapshot | Drawn) -> tuple[str, str]:
        """Verdict and numbers."""
        if isinstance(snapshot, SessionMoment):
            return session.verdict(snapshot), session.numbers(snapshot, self._scale)
        if isinstance(snapshot, Drawn):
            assert isinstance(snapshot, Moment)
            return playback.verdict(snapshot), playback.numbers(snapshot, self._scale)
        return readout.verdict(snapshot, capacity=self._ready(Reading.MARGIN)), self._numbers(snapshot)

    def _numbers(self, snapshot: Snapshot) -> str:
        if not self._ready(Reading.FREQUENCIES):
            return readout.numbers(snapshot, self._scale, None, frequencies_later=snapshot.feasible)
        return readout.numbers(snapshot, self._scale, _frequencies(snapshot))


def _frequencies(snapshot: Snapshot) -> Array | None:
    return modes(snapshot.plan.state).frequency if snapshot.plan is not None and snapshot.feasible else None
