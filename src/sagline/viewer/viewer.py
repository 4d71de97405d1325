"""The viewer itself: one thread that waits for a change, solves, and shows; callbacks only wake it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from enum import Enum

import numpy as np
import viser

from sagline.arrays import Array
from sagline.errors import SaglineError
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.stiffness import modes
from sagline.viewer import readout, solids
from sagline.viewer.export_panel import ExportPanel
from sagline.viewer.framing import Framing
from sagline.viewer.panel import Panel
from sagline.viewer.polygon_figure import polygon_figure, polygon_later
from sagline.viewer.run import Run
from sagline.viewer.run_panel import RunPanel
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import Snapshot, taken_at
from sagline.viewer.stage import TRACE_POINTS, Stage
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.timeline import Timeline
from sagline.viewer.view import View
from sagline.viewer.wording import remembers

FRAME_TIME = 1.0 / 60.0  # s: no update comes sooner after the one before
IDLE = 0.5  # s: how long Ctrl-C may go unheard where waiting cannot be interrupted


class Reading(Enum):
    """What can come after the cables."""

    MARGIN = "capacity margin"
    POLYGON = "polygon of feasible tensions"
    FREQUENCIES = "natural frequencies"
    REST = "where the platform rests if the model is approximate"


class Viewer:
    """A robot, perhaps with a run, on a server that the caller has started and will stop.

    All its state belongs to the thread in `serve`; other threads only leave messages.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        run: Run | None = None,
        ready: Callable[[Reading], bool] = lambda _: True,
        wrench: Array | None = None,
    ) -> None:
        """Build the page.

        Args:
            server: A running server with nothing on it.
            robot: The robot; that of the run, if there is one.
            run: A plan along a path, to play.
            ready: Whether a reading can be had without waiting; until then the page says that it comes. `refresh`
                when one has become ready.
            wrench: External wrench on the platform that is dragged, shape (6,), as `inverse` takes it; None for none.
        """
        self._ready = ready
        self._wrench = wrench
        self._server = server
        self._robot = robot
        self._run = run
        self._wake = threading.Event()
        self._stopping = threading.Event()
        self._tasks: deque[Callable[[], None]] = deque()  # appended to by any thread
        self._scale = TensionScale.of(robot)
        self._home = home_pose(robot) if run is None else run.plan.state.pose[0]
        self._panel = Panel(server, robot, self._scale, self._wake.set, lambda: self._soon(self._forget))
        self._stage = Stage(server.scene, robot, self._home)
        self._framing = Framing(server, *self._stage.extent(self._home))
        self._clock = Timeline(0.0 if run is None else run.duration)
        self._run_panel: RunPanel | None = None
        if run is not None:
            self._run_panel = RunPanel(server, run, self._scrub_soon, lambda: self._soon(self._toggle))
        self._export = ExportPanel(server, lambda: self.view, run)
        self._build_gizmo()
        self._changed: tuple[Settings, Robot] | None = None
        self._previous: Plan | None = None
        self._traced = 0.0
        self.updates = 0
        self.shown = threading.Event()  # set when the first view stands
        self.view: View | None = None

    def serve(self) -> None:
        """Follow what clients do until `stop`; the calling thread does all the work."""
        self._update()
        last = time.monotonic()
        while not self._stopping.is_set():
            self._wake.wait(timeout=FRAME_TIME if self._clock.playing else IDLE)
            rest = FRAME_TIME - (time.monotonic() - last)
            if rest > 0.0:
                time.sleep(rest)
            now = time.monotonic()
            if self._wake.is_set() or self._clock.playing or self._tasks:
                self._wake.clear()
                self._clock = self._clock.advanced(
                    now - last, 1.0 if self._run_panel is None else self._run_panel.speed
                )
                self._work_off()
                self._update()
            last = now

    def refresh(self) -> None:
        """Show everything once more; from any thread."""
        self._wake.set()

    def wait(self, what: str) -> None:
        """Say what the numbers wait for; from any thread."""
        self._panel.wait(what)

    def stop(self) -> None:
        """Let `serve` return; from any thread."""
        self._stopping.set()
        self._wake.set()

    def _soon(self, task: Callable[[], None]) -> None:
        """Have the serving thread do something; from any thread."""
        self._tasks.append(task)
        self._wake.set()

    def _work_off(self) -> None:
        while self._tasks:
            self._tasks.popleft()()

    def _build_gizmo(self) -> None:
        @self._stage.gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            if event.phase == "start" and self._run_panel is not None:
                self._soon(self._leave_run)
            self._wake.set()

        home = self._server.gui.add_button("Platform back home", icon=viser.Icon.HOME)
        home.on_click(lambda _: self._soon(self._go_home))

    def _go_home(self) -> None:
        self._leave_run()
        self._stage.place(self._home)

    def _forget(self) -> None:
        self._previous = None

    def _leave_run(self) -> None:
        self._clock = self._clock.scrubbed(self._clock.time)
        if self._run_panel is not None:
            self._run_panel.leave()

    def _toggle(self) -> None:
        self._clock = self._clock.toggled()
        if self._run_panel is not None:
            self._run_panel.join()

    def _scrub_soon(self) -> None:
        self._soon(self._scrub)

    def _scrub(self) -> None:
        if self._run_panel is not None and abs(self._run_panel.time - self._clock.time) > 1e-9:
            self._clock = self._clock.scrubbed(self._run_panel.time)

    def _update(self) -> None:
        """Solve and show once."""
        try:
            settings = self._panel.settings()
            following = self._run_panel is not None and self._run_panel.following
            snapshot = self._from_run() if following else self._from_gizmo(settings)
        except SaglineError as error:
            self._panel.refuse(str(error))
            return
        if self._run_panel is not None:
            self._run_panel.show(self._clock)
        self._panel.show_what_if(not following)
        self._show(View(snapshot, settings, self._scale, self._panel.ghost), follow=following)

    def _from_run(self) -> Snapshot:
        assert self._run is not None
        return self._run.snapshot(self._run.index_at(self._clock.time))

    def _from_gizmo(self, settings: Settings) -> Snapshot:
        if self._changed is None or self._changed[0] != settings:
            self._changed = (settings, settings.applied(self._robot))
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

    def _show(self, view: View, *, follow: bool) -> None:
        snapshot, settings = view.snapshot, view.settings
        with self._server.atomic():
            if follow:
                self._stage.place(snapshot.pose)
            self._stage.show(snapshot, self._scale, settings.sag_scale, settings.error_scale, ghost=view.ghost)
            if self._run is not None and settings.error_scale != self._traced:
                self._traced = settings.error_scale
                self._stage.show_traces(*self._run.traces(TRACE_POINTS, settings.error_scale))
        self._panel.read_out(
            readout.verdict(snapshot, capacity=self._ready(Reading.MARGIN)),
            self._numbers(snapshot),
            polygon_figure(snapshot) if self._ready(Reading.POLYGON) else polygon_later(),
        )
        self.view = view
        self.updates += 1
        self.shown.set()

    def _numbers(self, snapshot: Snapshot) -> str:
        if not self._ready(Reading.FREQUENCIES):
            return readout.numbers(snapshot, self._scale, None, frequencies_later=snapshot.feasible)
        return readout.numbers(snapshot, self._scale, _frequencies(snapshot))


def home_pose(robot: Robot) -> Pose:
    """The middle of the poses that a robot is meant for, or of its box."""
    if robot.test_box is not None:
        return Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))
    low, high = solids.bounds(robot)
    return Pose(0.5 * (low + high), np.eye(3))


def _frequencies(snapshot: Snapshot) -> Array | None:
    return modes(snapshot.plan.state).frequency if snapshot.plan is not None and snapshot.feasible else None
