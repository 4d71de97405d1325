"""The viewer: one thread waits for a change, solves and draws; callbacks only wake it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable

import viser

from sagline.calibration.result import Calibration
from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.robot.reach import home_pose as home_pose
from sagline.robot.robot import Robot
from sagline.statics.stiffness import modes
from sagline.viewer import readout
from sagline.viewer.drawn import InMotion
from sagline.viewer.feature import Feature, Reading, View
from sagline.viewer.features import FEATURES
from sagline.viewer.features.calibration import CalibrationFeature
from sagline.viewer.page import Page
from sagline.viewer.player import Beside, Played
from sagline.viewer.robot_scene import TRACE_POINTS
from sagline.viewer.snapshot import Settings, Snapshot, depends_on_history, taken_at
from sagline.viewer.state_code import Source

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
        page = self.page = Page(server, robot, played, ready, wrench, pose, mode, found, source or Source(), beside)
        page.forget = self._forget
        self._stopping = threading.Event()
        first = () if found is None else (CalibrationFeature(page, found),)
        page.features = (*first, *(make(page) for make in FEATURES))
        self._build_gizmo()
        self._depended: dict[Feature, Hashable] = {}  # what a feature depended on when it followed last
        self._traced: tuple[int, int, float] = (0, 0, 0.0)  # what the traces are of
        self._extended = 0  # how often what is played has gone on
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
            self.page.wake.wait(timeout=self._pace)
            rest = FRAME_TIME - (time.monotonic() - last)
            if rest > 0.0:
                time.sleep(rest)
            now = time.monotonic()
            if self.page.wake.is_set() or self.page.player.clock.playing or self.page.tasks:
                self.page.wake.clear()
                self.page.player.advance(now - last)
                self._work_off()
                self._update()
            for feature in self.page.features:
                feature.tick()
            last = now

    def refresh(self) -> None:
        """Show everything once more; from any thread."""
        self.page.wake.set()

    def wait(self, what: str) -> None:
        """Say what the numbers wait for; from any thread."""
        self.page.panel.wait(what)

    def extend(self, played: Played) -> None:
        """Have what is played go on: it begins as what was played before, and is longer; from any thread.

        Who looks at its end sees the new end; who looks at an earlier time goes on doing that.
        """
        self.page.later(lambda: self._extend(played))

    def stop(self) -> None:
        """Let `serve` return; from any thread."""
        self._stopping.set()
        self.page.wake.set()

    @property
    def _pace(self) -> float:
        """Time until the next update, unless something wakes it [s]."""
        if self.page.player.clock.playing or any(feature.moving for feature in self.page.features):
            return FRAME_TIME
        return SOON if any(feature.waiting for feature in self.page.features) else IDLE

    def _work_off(self) -> None:
        while self.page.tasks:
            self.page.tasks.popleft()()

    def _extend(self, played: Played) -> None:
        self.page.player.extend(played)
        self._extended += 1

    def _build_gizmo(self) -> None:
        @self.page.scene.gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == "start":
                self.page.later(self.page.player.leave)
            self.page.wake.set()

        home = self.page.server.gui.add_button("Platform back home", icon=viser.Icon.HOME)
        home.on_click(lambda _: self.page.later(self.page.go_home))

    def _forget(self) -> None:
        self._previous = None

    def _update(self) -> None:
        """Solve and show once."""
        player = self.page.player
        try:
            settings = self.page.panel.settings()
            snapshot = player.sight() if player.following else self._from_gizmo(settings)
        except SaglineError as error:
            self.page.panel.refuse(str(error))
            return
        played = player.played if player.following else None
        self.page.panel.show_what_if("" if played is None else played.still)
        self._show(
            View(
                snapshot,
                settings,
                self.page.scale,
                self.page.panel.ghost,
                self.page.wrench,
                played,
                playing=player.clock.playing,
            )
        )

    def _from_gizmo(self, settings: Settings) -> Snapshot:
        if self._changed is None or self._changed[0] != settings.changes:
            self._changed = (settings.changes, settings.applied(self.page.robot))
        snapshot = taken_at(
            self._changed[1],
            self.page.scene.dragged_pose(),
            settings,
            self._previous,
            confirmed=self.page.ready(Reading.REST),
            wrench=self.page.wrench,
        )
        if not depends_on_history(settings.tension):
            self._forget()  # what one comes from by another way of sharing is no way there
        elif snapshot.feasible:
            self._previous = snapshot.plan
        return snapshot

    def _show(self, view: View) -> None:
        snapshot, settings, played = view.snapshot, view.settings, self.page.player.played
        with self.page.server.atomic():
            if view.played is not None:
                self.page.scene.place(snapshot.pose)
            self.page.scene.show(snapshot, self.page.scale, settings.sag_scale, settings.error_scale, ghost=view.ghost)
            traced = self.page.player.number, self._extended, settings.error_scale
            if played is not None and traced != self._traced:
                self._traced = traced
                self.page.scene.show_traces(*played.traces(TRACE_POINTS, settings.error_scale))
        self.page.view = view
        self.page.panel.read_out(*self._words(snapshot))
        for feature in self.page.features:
            key = feature.depends(view)
            if feature not in self._depended or self._depended[feature] != key:
                self._depended[feature] = key
                feature.follow(view)
        self.view = view
        self.updates += 1
        self.shown.set()

    def _words(self, snapshot: Snapshot | InMotion) -> tuple[str, str]:
        """Verdict and numbers."""
        if isinstance(snapshot, InMotion):
            return snapshot.verdict(), snapshot.numbers(self.page.scale)
        return readout.verdict(snapshot, capacity=self.page.ready(Reading.MARGIN)), self._numbers(snapshot)

    def _numbers(self, snapshot: Snapshot) -> str:
        if not self.page.ready(Reading.FREQUENCIES):
            return readout.numbers(snapshot, self.page.scale, None, frequencies_later=snapshot.feasible)
        return readout.numbers(snapshot, self.page.scale, _frequencies(snapshot))


def _frequencies(snapshot: Snapshot) -> Array | None:
    return modes(snapshot.plan.state).frequency if snapshot.plan is not None and snapshot.feasible else None
