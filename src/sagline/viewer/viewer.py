"""The viewer itself: one thread that waits for a change, solves, and shows; callbacks only wake it."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from enum import Enum

import numpy as np
import viser

from sagline.arrays import Array
from sagline.dynamics.simulation import Simulation
from sagline.errors import SaglineError
from sagline.kinematics.plan import Plan
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.stiffness import modes
from sagline.viewer import dynamics, moment_words, readout, session_words, solids
from sagline.viewer.aside import Aside
from sagline.viewer.cut_panel import CutPanel
from sagline.viewer.drawn import Drawn
from sagline.viewer.export_panel import ExportPanel
from sagline.viewer.framing import Framing
from sagline.viewer.hull import hull_of
from sagline.viewer.mode_show import ModeShow
from sagline.viewer.modes_panel import ModesPanel
from sagline.viewer.moment import Moment
from sagline.viewer.panel import Panel
from sagline.viewer.playback import Playback
from sagline.viewer.played import Played
from sagline.viewer.polygon_figure import polygon_figure, polygon_later
from sagline.viewer.run_panel import RunPanel
from sagline.viewer.session import SessionMoment
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import Snapshot, taken_at
from sagline.viewer.space_panel import SpacePanel
from sagline.viewer.space_show import SpaceShow, planes_of
from sagline.viewer.space_stage import SpaceStage
from sagline.viewer.stage import TRACE_POINTS, Stage
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.timeline import Timeline
from sagline.viewer.view import View
from sagline.viewer.wording import remembers

FRAME_TIME = 1.0 / 60.0  # s: no update comes sooner after the one before
SOON = 0.05  # s: how long what is worked out beside the page may wait until it is shown
IDLE = 0.5  # s: how long Ctrl-C may go unheard where waiting cannot be interrupted


class Reading(Enum):
    """What can come after the cables."""

    MARGIN = "capacity margin"
    POLYGON = "polygon of feasible tensions"
    FREQUENCIES = "natural frequencies"
    REST = "where the platform rests if the model is approximate"
    MODES = "modes with cable mass"
    SIMULATION = "what follows when a cable is cut"
    WORKSPACE = "margins over a set of loads"


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
        """
        self._ready = ready
        self._wrench = wrench
        self._server = server
        self._robot = robot
        self._played = self._given = played
        self._wake = threading.Event()
        self._stopping = threading.Event()
        self._tasks: deque[Callable[[], None]] = deque()  # appended to by any thread
        self._scale = TensionScale.of(robot)
        home = home_pose(robot) if played is None else played.home
        self._home = home if pose is None else pose
        self._panel = Panel(server, robot, self._scale, self._wake.set, lambda: self._soon(self._forget))
        self._stage = Stage(server.scene, robot, self._home)
        self._framing = Framing(server, *self._stage.extent(self._home))
        self._modes = self._mode_show(mode)
        self._space = self._space_show()
        self._cuts = Aside(self._soon)
        self._cut_panel = CutPanel(server.gui, robot, lambda: self._soon(self._cut), lambda: self._soon(self._back))
        self._export = ExportPanel(server, lambda: self.view, lambda: self._played)
        self._clock = Timeline(0.0)
        self._run_panel: RunPanel | None = None
        self._play(played)
        self._build_gizmo()
        self._changed: tuple[Settings, Robot] | None = None
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
            if self._wake.is_set() or self._clock.playing or self._tasks:
                self._wake.clear()
                self._clock = self._clock.advanced(
                    now - last, 1.0 if self._run_panel is None else self._run_panel.speed
                )
                self._work_off()
                self._update()
            self._modes.tick()
            self._space.tick()
            if self._cuts.waited:
                self._cut_panel.say(f"Simulating: {self._cuts.waited:.0f} s so far")
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
        if self._clock.playing or self._modes.moving:
            return FRAME_TIME
        return SOON if self._modes.waiting or self._space.waiting or self._cuts.busy else IDLE

    def _soon(self, task: Callable[[], None]) -> None:
        """Have the serving thread do something; from any thread."""
        self._tasks.append(task)
        self._wake.set()

    def _work_off(self) -> None:
        while self._tasks:
            self._tasks.popleft()()

    def _mode_show(self, mode: str) -> ModeShow:
        panel = ModesPanel(self._server.gui, self._panel.readings, self._wake.set, mode)
        return ModeShow(panel, self._stage, Aside(self._soon), dynamics.vibrating)

    def _space_show(self) -> SpaceShow:
        panel = SpacePanel(self._server.gui, self._panel.readings, planes_of(self._robot), self._wake.set)
        stage = SpaceStage(self._server.scene, solids.size_of(self._robot))
        return SpaceShow(panel, stage, Aside(self._soon), hull_of)

    def _play(self, played: Played | None, *, at_once: bool = False) -> None:
        """Put something on the timeline in place of what was there, or nothing."""
        if self._run_panel is not None:
            self._run_panel.remove()
        self._played, self._run_panel, self._traced = played, None, 0.0
        self._clock = Timeline(0.0 if played is None else played.duration, 0.0, at_once)
        if played is not None:
            self._run_panel = RunPanel(self._server, played, self._scrub_soon, lambda: self._soon(self._toggle))
        else:
            self._stage.show_traces(np.empty((0, 3)), np.empty((0, 3)))
        self._export.offer_film(None if played is None else played.name)
        self._cut_panel.offer_back(self._given.name if self._given is not None and played is not self._given else "")

    def _extend(self, played: Played) -> None:
        if self._run_panel is None or self._played is not self._given:  # what a cut brought is looked at
            self._given = played
            return
        self._played = self._given = played
        self._clock, self._traced = self._clock.extended(played.duration), 0.0
        self._run_panel.extend(played)

    def _back(self) -> None:
        self._play(self._given)

    def _cut(self) -> None:
        """Simulate what comes when a cable of the robot that is shown breaks, and play it."""
        snapshot, panel = None if self.view is None else self.view.snapshot, self._cut_panel
        if not isinstance(snapshot, Snapshot) or snapshot.plan is None or not snapshot.feasible:
            panel.say("A cable is cut at rest, where the platform is held: drag it there first.")
            return
        if not self._ready(Reading.SIMULATION):
            panel.say("The simulation is still being compiled.")
            return
        state, cable, cable_mass = snapshot.plan.state, panel.cable, panel.cable_mass
        panel.say("Simulating …")
        self._cuts.ask(lambda: dynamics.cut(state, cable, cable_mass), self._play_cut, panel.refuse)

    def _play_cut(self, simulation: Simulation) -> None:
        self._cut_panel.say("")
        self._play(Playback(simulation), at_once=True)

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
            snapshot = self._from_played() if following else self._from_gizmo(settings)
        except SaglineError as error:
            self._panel.refuse(str(error))
            return
        if self._run_panel is not None:
            self._run_panel.show(self._clock)
        self._panel.show_what_if(self._played.still if following and self._played is not None else "")
        self._show(View(snapshot, settings, self._scale, self._panel.ghost), follow=following)

    def _from_played(self) -> Snapshot | Drawn:
        assert self._played is not None
        return self._played.sight(self._clock.time)

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
            if self._played is not None and settings.error_scale != self._traced:
                self._traced = settings.error_scale
                self._stage.show_traces(*self._played.traces(TRACE_POINTS, settings.error_scale))
        self._panel.read_out(*self._words(snapshot))
        self._modes.follow(*self._vibrating(snapshot, settings))
        if self._ready(Reading.WORKSPACE):
            self._space.follow(snapshot.robot, snapshot.pose, settings.model, self._wrench)
        else:
            self._space.wait()
        self.view = view
        self.updates += 1
        self.shown.set()

    def _words(self, snapshot: Snapshot | Drawn) -> tuple[str, str, str]:
        """Verdict, numbers and polygon."""
        if isinstance(snapshot, SessionMoment):
            return (
                session_words.verdict(snapshot),
                session_words.numbers(snapshot, self._scale),
                session_words.polygon(),
            )
        if isinstance(snapshot, Drawn):
            assert isinstance(snapshot, Moment)
            return moment_words.verdict(snapshot), moment_words.numbers(snapshot, self._scale), moment_words.polygon()
        return (
            readout.verdict(snapshot, capacity=self._ready(Reading.MARGIN)),
            self._numbers(snapshot),
            polygon_figure(snapshot) if self._ready(Reading.POLYGON) else polygon_later(),
        )

    def _vibrating(self, snapshot: Snapshot | Drawn, settings: Settings) -> tuple[Equilibrium | None, Hashable]:
        """The state whose modes are asked for, if there is one, and what tells it from others."""
        if isinstance(snapshot, Drawn) or snapshot.plan is None or not snapshot.feasible:
            return None, None
        if self._clock.playing or not self._ready(Reading.MODES):
            return None, None
        place = snapshot.pose.position.tobytes() + snapshot.pose.quaternion.tobytes()
        return snapshot.plan.state, (
            place,
            settings.mass,
            settings.density,
            settings.stiffness,
            settings.model,
            settings.tension,
            id(self._played),
        )

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
