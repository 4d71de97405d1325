"""The controller: what an operator, or a program, asks of the loop."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.control.checks import Motion, check_lead, check_motion, check_start, motion_along
from sagline.control.connecting import Claim, Trouble
from sagline.control.execution import Execution
from sagline.control.homing import Homing, HomingJog, tension_limits
from sagline.control.jogging import PlatformJog, checked_displacement, checked_winch, winch_jog
from sagline.control.link import Link
from sagline.control.loop import Loop
from sagline.control.real_time import Pace, aside, interrupt_calls
from sagline.control.recording import EventKind, Recorder
from sagline.control.set_points import Along, SetPoint, Standing
from sagline.control.states import MOTION, RefusedError, State, check_transition
from sagline.control.tension_loop import TensionSettings
from sagline.core.arguments import instance
from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path
from sagline.motion.rest_to_rest import septic_path
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

SETTLING: Final = 3.0  # s that homing looks, at most
SPEED: Final = 0.1  # m/s, of go_to
TURNING: Final = 0.2  # rad/s
SPEEDING_UP: Final = 0.5  # s, to full speed at least: a short way is a slow one
T = TypeVar("T")


class Controller(Loop):
    """Drives a robot through a `Link`.

    It knows what samples say, and nothing else; each `cycle` sends one command, which was checked. The methods that
    begin something (`start`, `begin_homing`, `start_jog`, `claim`) return at once, and `cycle` is to be called each
    period; those that wait (`execute`, `go_to`, `home`, `jog`, `connect`) call it themselves, until nothing moves.

    Attributes:
        state: What it does.
        robot: As it is planned for.
        sample: What the machine said last; None before anything.
        zero: What homing added to the lengths that are read [m], shape (m,).
        homed: Whether the platform's place is known.
    """

    def __init__(
        self,
        robot: Robot,
        link: Link,
        *,
        pace: Pace | None = None,
        model: CableModel | None = None,
        tension: TensionMethod | None = None,
        loop: TensionSettings | None = None,
        record: Recorder | None = None,
        shadow: bool = False,
        seed: int | None = None,
    ) -> None:
        """Prepare everything; nothing is sent.

        Args:
            robot: As it is planned for. Its winches need drum_radius at least.
            link: The way to the machine.
            pace: Real time; None: every cycle begins when the one before is over, on the clock of a machine that
                waits for it.
            model: Of the cables; the default is exact.
            tension: How the load is shared; the default is `Closest`.
            loop: How the tension loop works. A robot without redundancy has none.
            record: One who looks on.
            shadow: Whether it reads only: nothing is ever sent, and the state stays OFF.
            seed: Of its id and of random waiting; None: the system's, so that no two controllers are alike.

        Raises:
            InvalidValueError: If data of the winches are missing, the link is for another number of winches, or an
                argument is of the wrong kind.

        Examples:
            >>> import sagline as sl
            >>> robot = sl.load_robot("article-prototype")
            >>> machine = sl.twin.Machine(robot, seed=1)
            >>> control = sl.control.Controller(robot, machine.link(), seed=2)
            >>> control.connect()
            >>> control.home(sl.Pose.from_euler([0, 0, 1.5], 0, 0, 0))
            >>> done = control.go_to(sl.Pose.from_euler([0.1, 0, 1.5], 0, 0, 0))
            >>> print(done.status.name, done.position[-1].round(3))
            DONE [0.1 0.  1.5]
        """
        super().__init__(robot, link, pace, model, tension, loop, record, bool(shadow), seed)

    @property
    def estimate(self) -> Pose:
        """Where the platform is by the encoders.

        Raises:
            RefusedError: If that is not known.
        """
        pose = self._estimator.pose
        if pose is None:
            raise RefusedError("the estimate", "the platform's place is not known", "Home first: home(pose).")
        return pose

    @property
    def moving(self) -> bool:
        """Whether set points change."""
        return self.state in MOTION and not (self.state is State.HOMING and self._course is None)

    # connecting and homing

    def claim(self) -> None:
        """Begin to connect.

        Raises:
            RefusedError: If it is connected already, or reads only.
        """
        if self._shadow:
            raise RefusedError("connecting", "this controller only reads", "Make one without shadow.")
        check_transition(self.state, State.CONNECTING, "connecting")
        self._enter(State.CONNECTING, "claims the groups")
        self._refused = None
        self._claim = Claim(self.owner, self._link.groups, self.period, self._random)

    def connect(self) -> None:
        """Connect, and wait until all groups agree.

        Raises:
            RefusedError: If they do not; it says why.
        """
        self.claim()
        with interrupt_calls(self.stop):
            while self.state is State.CONNECTING:
                self.cycle()
            self._let_go()
        if self.state is not State.READY:
            step = "Check the machine and who else controls it, then try again."
            raise (self._refused or Trouble(self._reason, step)).refusal("connecting")

    def begin_homing(self, pose: Pose) -> None:
        """Say where the platform is held, and look whether the tensions agree.

        Args:
            pose: A single pose.

        Raises:
            RefusedError: If the robot is not ready, or the pose has no tensions within the limits.
        """
        if self.state is not State.HOMING:
            check_transition(self.state, State.HOMING, "homing")
        elif self._course is not None:
            raise RefusedError("homing", "a winch is being jogged", "Wait until it stands.")
        place = instance(pose, Pose, "pose")
        self._homing = self._beside(lambda: Homing(self.robot, place, self._model, self._method))
        self.zero, self.homed = np.zeros(self.robot.cable_count), False
        self._new_loop()
        if self.state is not State.HOMING:
            self._enter(State.HOMING, "the operator named the pose")

    def home(self, pose: Pose) -> None:
        """Say where the platform is held, and wait until the tensions agree.

        Args:
            pose: A single pose.

        Raises:
            RefusedError: If they do not: the state stays HOMING, and the message names a jog.
        """
        self.begin_homing(pose)
        with interrupt_calls(self.stop):
            for _ in range(round(SETTLING / self.period)):
                self.cycle()
                if self.state is not State.HOMING:
                    break
        if self.state is State.HOMING and self._homing is not None:
            raise self._homing.refusal()
        if self.state is not State.IDLE:
            raise RefusedError("homing", f"it ended in {self.state.name}: {self._reason}", "Read the events.")

    # moving

    def plan(self, path: Path) -> Motion:
        """Plan a path and check all of it; nothing is sent.

        Args:
            path: From rest to rest, with a sample at every tick.

        Returns:
            What `start` and `execute` take too.

        Raises:
            RefusedError: If a check fails; it says which, where, and the next step.
        """
        given = instance(path, Path, "path")
        arguments = self.robot, given, self.period, self._model, self._method, self._held
        return self._beside(lambda: motion_along(*arguments))

    def start(self, path: Path | Motion) -> None:
        """Begin to follow a path.

        Args:
            path: From rest to rest, with a sample at every tick, from where the platform is; or a motion that was
                planned before.

        Raises:
            RefusedError: If the robot is not idle, a check fails, or the path begins elsewhere.
        """
        check_transition(self.state, State.MOVING, "the path")
        motion = path if isinstance(path, Motion) else self.plan(path)
        check_transition(self.state, State.MOVING, "the path")
        self._check_agreement("the path")
        check_motion(motion, self.robot, self.period)
        check_start(self.robot, self.estimate, motion.state.pose[0])
        lead = self._stood("the path").length - motion.length[0]
        check_lead("the path", lead)
        course = Along(motion, self.period, lead)
        self._begin(State.MOVING, course, motion, f"a path of {self.period * (len(motion) - 1):.2f} s")

    def execute(self, path: Path | Motion) -> Execution:
        """Follow a path to its end.

        Args:
            path: As of `start`.

        Returns:
            What became of it: a fault is its status, not an error.

        Raises:
            RefusedError: As `start`.
        """
        self.start(path)
        return self.wait()

    def path_to(self, pose: Pose, speed: float = SPEED, angular_speed: float = TURNING) -> Path:
        """The straight way from where the platform is.

        Args:
            pose: Where to, a single pose.
            speed: Largest of the origin [m/s], > 0.
            angular_speed: Largest of the platform [rad/s], > 0.

        Raises:
            RefusedError: If the platform's place is not known, or it is there already.
        """
        limits = number(speed, "speed", "m/s", above=0.0), number(angular_speed, "angular_speed", "rad/s", above=0.0)
        here = self._here()
        if instance(pose, Pose, "pose").shape:
            raise InvalidValueError("pose", f"a batch of {len(pose)}", "a single pose", "Give one: pose[0].")
        points = self.robot.platform_anchors
        if float(np.abs(pose.transform(points) - here.transform(points)).max()) < 1e-6:
            raise RefusedError("the way", "the platform is there already", "Name another pose.")
        return septic_path(
            [here, pose],
            speed=limits[0],
            acceleration=limits[0] / SPEEDING_UP,
            angular_speed=limits[1],
            angular_acceleration=limits[1] / SPEEDING_UP,
            rate=round(1.0 / self.period),
        )

    def go_to(self, pose: Pose, speed: float = SPEED, angular_speed: float = TURNING) -> Execution:
        """Go straight to a pose.

        Args:
            pose: Where to, a single pose.
            speed: Largest of the origin [m/s], > 0.
            angular_speed: Largest of the platform [rad/s], > 0.

        Returns:
            What became of it.

        Raises:
            RefusedError: As `start`.
        """
        check_transition(self.state, State.MOVING, "the way")
        return self.execute(self._beside(lambda: self.path_to(pose, speed, angular_speed)))

    def start_jog(self, winch: int, by: float) -> None:
        """Begin to jog one winch.

        Args:
            winch: Which, from 0.
            by: How far [m], positive where it lets cable out.

        Raises:
            RefusedError: If the robot is neither idle nor being homed, or a tension would leave its limits.
        """
        chosen, far = checked_winch(self.robot, winch, by)
        if self.state is State.HOMING:
            self._jog_in_homing(chosen, far)
            return
        check_transition(self.state, State.JOGGING, "the jog")
        self._check_agreement("the jog")
        here, length = self._here(), self._stood("the jog").length
        motion = self._beside(lambda: winch_jog(self.robot, length, here, chosen, far, self.period, self._model))
        check_transition(self.state, State.JOGGING, "the jog")
        course = Along(motion, self.period, np.zeros(len(length)))
        self._begin(State.JOGGING, course, motion, f"winch {chosen} by {1e3 * far:+g} mm")

    def _jog_in_homing(self, winch: int, by: float) -> None:
        """Jog one winch while the others have no power, and tensions alone are watched."""
        if self._homing is None or self.sample is None or self._course is not None:
            raise RefusedError("the jog", "another winch is being jogged", "Wait until it stands.")
        self._most_tension = tension_limits(self._homing, self.sample)
        begin = SetPoint(
            self.sample.length, np.zeros(len(self.zero)), self._unknown, self._sender.tension, None, None, np.nan, False
        )
        self._course = HomingJog(begin, winch, by, self.period)
        self._say(EventKind.NOTE, "jog", f"winch {winch} by {1e3 * by:+g} mm")

    def _here(self) -> Pose:
        """Where the platform stands: where it was meant to go, which the estimate agrees with but for its noise."""
        pose = self._course.pose if isinstance(self._course, Standing) else None
        return self.estimate if pose is None else pose

    def jog(self, winch: int, by: float) -> None:
        """Jog one winch, and wait for its end.

        Args:
            winch: Which, from 0.
            by: How far [m], positive where it lets cable out.

        Raises:
            RefusedError: As `start_jog`.
        """
        self.start_jog(winch, by)
        self._rest()

    def start_jog_platform(self, by: ArrayLike) -> None:
        """Begin to jog the platform along a straight line, each pose solved when it is due.

        Args:
            by: Displacement [m], and rotation vector [rad] or not, world axes, shape (3,) or (6,).

        Raises:
            RefusedError: If the robot is not idle, or the pose at the end has no tensions within the limits.
        """
        far = checked_displacement(by)
        check_transition(self.state, State.JOGGING, "the jog")
        self._check_agreement("the jog")
        here, point = self._here(), self._stood("the jog")
        course = self._beside(lambda: PlatformJog(self.robot, point, here, far, self.period, self._model, self._method))
        check_transition(self.state, State.JOGGING, "the jog")
        self._begin(State.JOGGING, course, None, "the platform")

    def jog_platform(self, by: ArrayLike) -> None:
        """Jog the platform, and wait for its end.

        Args:
            by: As of `start_jog_platform`.

        Raises:
            RefusedError: As `start_jog_platform`.
        """
        self.start_jog_platform(by)
        self._rest()

    def wait(self) -> Execution:
        """Go on until nothing moves; Ctrl-C stops the robot, and interrupts then.

        Returns:
            What became of the motion.

        Raises:
            RefusedError: If nothing has moved yet.
        """
        self._rest()
        done = self.execution
        if done is None:
            raise RefusedError("waiting", "nothing has moved yet", "Begin with start(path).")
        return done

    def _rest(self) -> None:
        """Go on until nothing moves."""
        try:
            with interrupt_calls(self.stop):
                while self.moving:
                    self.cycle()
        finally:
            self._garbage.go_on()

    def pause(self) -> None:
        """Slow down on the path, and stand; `resume` goes on.

        Raises:
            RefusedError: If no path is being followed.
        """
        check_transition(self.state, State.PAUSING, "pausing")
        course = self._course
        if not isinstance(course, Along):
            raise RefusedError("pausing", "no path is being followed", "Stop instead: stop().")
        course.pause()
        self._enter(State.PAUSING, f"at {course.clock:.2f} s of the path")

    def resume(self) -> None:
        """Go on where `pause` stopped.

        Raises:
            RefusedError: If there is nothing to go on with, or the platform is elsewhere.
        """
        check_transition(self.state, State.MOVING, "resuming")
        if self._paused is None:
            raise RefusedError("resuming", "no path was paused here", "Begin one with start(path).")
        self._check_agreement("resuming")
        check_start(self.robot, self.estimate, self._paused.pose)
        course, self._paused = self._paused, None
        course.resume()
        self._course = course
        self._go(State.MOVING, f"goes on at {course.clock:.2f} s of the path")

    def _beside(self, work: Callable[[], T]) -> T:
        """Do what may take longer than a cycle; in real time the cycles go on beside it, or the PLCs would hold."""
        if self._pace is None or self.state is State.OFF:
            return work()
        with interrupt_calls(self.stop):
            return self._wait_for(aside(work, threaded=True))

    def _wait_for(self, begun: Future[T]) -> T:
        """Go on until work is done."""
        while not begun.done():
            self.cycle()
        return begun.result()

    def stop(self) -> None:
        """Lead all rates to zero, from the next cycle on; where nothing moves, nothing happens."""
        self._stop_asked = True

    def acknowledge(self) -> None:
        """Say that what was wrong is mended: from FAULT to READY, and to IDLE where the place is still known.

        Where the robot is idle and degraded, the load cells are believed again.

        Raises:
            RefusedError: If the state is another one, or not all groups agree yet; it says which, and why.
        """
        what = "acknowledging"
        if self.state is State.IDLE and self.degraded:
            self._clear_faults()
            self._say(EventKind.NOTE, "acknowledged", "the load cells are believed again")
            return
        if self.state is not State.FAULT:
            raise RefusedError(what, f"the state is {self.state.name}", "There is nothing to acknowledge.")
        sample = self._check_agreement(what)
        begun = self._stand_at(sample.length + self.zero - self._correction) if self.homed else None
        found = None if begun is None else self._wait_for(begun)
        self._check_agreement(what)  # after the cycles beside it
        check_transition(self.state, State.READY, what)
        self._clear_faults()
        self._enter(State.READY, "the operator acknowledged")
        if found is not None and self.homed:
            self.homed = self._stands(found)
            if self.homed:
                self._enter(State.IDLE, "the place is still known")

    def off(self) -> None:
        """Give all grants back, and wait until they are; the brakes fall.

        Raises:
            RefusedError: If something moves.
        """
        if self.state is not State.OFF:
            check_transition(self.state, State.OFF, "switching off")
            self._leave("the operator")
            self.cycle()
        self._let_go()

    def _let_go(self) -> None:
        """While it is off, send what gives the grants back, until they are."""
        while self.state is State.OFF and self._sender.command is not None:
            self.cycle()
