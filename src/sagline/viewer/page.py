"""Page: all that a feature of the viewer is given."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import viser

from sagline.calibration.result import Calibration
from sagline.core.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import check_reach, home_pose
from sagline.robot.robot import Robot
from sagline.viewer import solids
from sagline.viewer.camera import Framing
from sagline.viewer.channel import Channel
from sagline.viewer.feature import Feature, Reading, View
from sagline.viewer.panel import Panel
from sagline.viewer.player import Beside, Played, Player
from sagline.viewer.robot_scene import RobotScene
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.state_code import Source
from sagline.viewer.tension_scale import TensionScale

F = TypeVar("F", bound=Feature)


class Page:
    """A robot on a server, what is shown of it, and what a feature may do; all but `later` and `refresh` by one thread.

    Attributes:
        server: A running server.
        robot: The robot.
        ready: Whether a reading can be had without waiting.
        channel: Messages to and from browsers.
        panel: Controls and readings; a feature adds a tab to `panel.readings`.
        scene: The robot in the scene.
        player: What is played.
        framing: Cameras of the clients.
        scale: Colors of tensions.
        size: Of the robot [m].
        home: Where the platform is at first.
        extent: Lowest and highest corner of what there is to see [m].
        wrench: External wrench on the platform that is dragged, shape (6,); None for none.
        found: A calibration of the robot; None for none.
        mode: Name of the mode that moves at first; "" for none.
        source: Where all this came from.
        view: What is shown now; None at first.
        features: All features, in the order in which they follow.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        played: Played | None,
        ready: Callable[[Reading], bool],
        wrench: Array | None,
        pose: Pose | None,
        mode: str,
        found: Calibration | None,
        source: Source,
        beside: Beside | None,
    ) -> None:
        """Build what all features share; the arguments are those of `Viewer`."""
        self.server, self.robot, self.ready, self.wrench = server, robot, ready, wrench
        self.mode, self.found, self.source = mode, found, source
        self.wake = threading.Event()
        self.tasks: deque[Callable[[], None]] = deque()  # appended to by any thread
        self.scale, self.size = TensionScale.of(robot), solids.size_of(robot)
        self.channel = Channel(server.gui, self.later)
        server.on_client_connect(self.channel.connect)
        server.on_client_disconnect(self.channel.disconnect)
        home = home_pose(robot) if played is None else played.home
        self.home = home if pose is None else pose
        self.forget: Callable[[], None] = lambda: None
        self.panel = Panel(server, robot, self.scale, self.refresh, lambda: self.later(lambda: self.forget()))
        self.scene = RobotScene(server.scene, robot, self.home)
        self.extent = self.scene.extent(self.home)
        self.framing = Framing(server, *self.extent)
        self.view: View | None = None
        self.features: tuple[Feature, ...] = ()
        self.player = Player(played, self._put_on, beside)

    def later(self, task: Callable[[], None]) -> None:
        """Have the serving thread call a function; from any thread."""
        self.tasks.append(task)
        self.wake.set()

    def refresh(self) -> None:
        """Show everything once more; from any thread."""
        self.wake.set()

    def refresh_on(self, *handles: Any) -> None:
        """Refresh when one of these controls changes."""
        for handle in handles:
            handle.on_update(lambda _: self.refresh())

    @property
    def state(self) -> Equilibrium | None:
        """The equilibrium that is shown; None in motion, and where the pose is not feasible."""
        snapshot = None if self.view is None else self.view.snapshot
        if not isinstance(snapshot, Snapshot) or snapshot.plan is None or not snapshot.feasible:
            return None
        return snapshot.plan.state

    def feature(self, kind: type[F]) -> F:
        """The feature of a type."""
        return next(each for each in self.features if isinstance(each, kind))

    def go(self, pose: Pose) -> None:
        """Put the platform to a pose."""
        self.player.leave()
        self.scene.place(pose)
        self.refresh()

    def go_home(self) -> None:
        """Put the platform home."""
        self.go(self.home)

    def go_near(self, pose: Pose) -> None:
        """Put the platform to a pose, unless it is out of reach."""
        self.check_near(pose)
        self.go(pose)

    def check_near(self, pose: Pose) -> None:
        """Refuse a pose out of reach."""
        self.scene.check_near(pose.position)
        both = np.stack((self.home.position, pose.position)), np.stack((self.home.quaternion, pose.quaternion))
        check_reach(self.robot, Pose.from_quaternion(*both), "pose")

    def _put_on(self, played: Played | None) -> None:
        """Something else is played, or nothing."""
        if played is None:
            self.scene.show_traces(np.empty((0, 3)), np.empty((0, 3)))
        for feature in self.features:
            feature.put_on(played)
