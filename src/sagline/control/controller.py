"""The controller: passes requests of an operator or a program to the control loop."""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.control.active_states import Following, HomingState
from sagline.control.checks import ON_TICK, Motion, check_lead, plan_motion
from sagline.control.context import Context
from sagline.control.execution import Execution
from sagline.control.link import Link
from sagline.control.null_space import TensionSettings
from sagline.control.preparation import Preparation
from sagline.control.real_time import Pace, load_kernels
from sagline.control.recording import Recorder
from sagline.control.set_points import Along, PlatformJog, SetPoint, SetPointSource, Standing, winch_jog
from sagline.control.states import RefusedError, State, check_transition
from sagline.core.arguments import instance, whole_number
from sagline.core.arrays import Array, checked, number
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path
from sagline.motion.rest_to_rest import septic_path
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

START: Final = 2e-3  # [m], largest distance between the platform and the first pose of a path
SPEED: Final = 0.1  # default speed of go_to [m/s]
TURNING: Final = 0.2  # default angular speed of go_to [rad/s]
MOST_WINCH: Final = 0.1  # largest jog of a winch [m]
MOST_PLATFORM: Final = 0.2  # largest jog of the platform [m or rad]
SPEEDING_UP: Final = 0.5  # shortest time to full speed [s]; it makes short paths slow


class Controller(Preparation):
    """Controller of a robot through a `Link`.

    Each `cycle` reads one sample and sends one checked command. The methods that begin an action (`start`,
    `begin_homing`, `start_jog`, `claim`) return immediately, and the caller must then call `cycle` every period. The
    methods that wait (`execute`, `go_to`, `home`, `jog`, `connect`) call `cycle` themselves until the action ends.
    """

    def __init__(
        self,
        robot: Robot,
        link: Link,
        *,
        pace: Pace | None = None,
        model: CableModel | str | None = None,
        tension: TensionMethod | str | None = None,
        loop: TensionSettings | None = None,
        record: Recorder | None = None,
        shadow: bool = False,
        seed: int | None = None,
    ) -> None:
        """Prepare the controller; nothing is sent.

        Args:
            robot: Robot for planning. The winches of the robot must have at least drum_radius.
            link: Connection to the machine.
            pace: Pace of cycles in real time. None for lockstep. A cycle then begins when the previous cycle ends, and
                the machine and its clock wait for the controller.
            model: Cable model; by default the elastic catenary.
            tension: Tension distribution method; the default is `Closest`.
            loop: Settings of the tension loop. A robot without redundancy has no tension loop.
            record: Recorder of all cycles and events.
            shadow: True for a controller that only reads: it never sends a command, and its state remains OFF.
            seed: Seed of the controller's id and of random waiting times. None: every controller gets its own random
                seed.

        Raises:
            InvalidValueError: If data of the winches are missing, `link` is for another number of winches, or an
                argument has the wrong type.

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
        super().__init__(Context(robot, link, pace, model, tension, loop, record, shadow, seed))
        if pace is not None:
            c = self._context
            load_kernels(robot, c.period, c.model, c.method)

    def plan(self, path: Path) -> Motion:
        """Plan a path and check it completely; nothing is sent.

        Args:
            path: Path from rest to rest, with a sample at every tick.

        Returns:
            A motion for `start` and `execute`.

        Raises:
            RefusedError: If a check fails: the message names the check, the place on the path and the next step.
        """
        c, given = self._context, instance(path, Path, "path")
        return self._result_of(partial(plan_motion, c.robot, given, c.period, c.model, c.method, c.previous_plan))

    def start(self, path: Path | Motion) -> None:
        """Begin to follow a path.

        Args:
            path: A motion from `plan`, or a path. A path leads from rest to rest, has a sample at every tick, and
                begins at the pose of the platform.

        Raises:
            RefusedError: If the robot is not idle. If a check fails. If the path begins at another pose.
        """
        check_transition(self.state, State.MOVING, "the path")
        motion = path if isinstance(path, Motion) else self.plan(path)
        check_transition(self.state, State.MOVING, "the path")
        self._context.check_agreement("the path")
        _check_motion(motion, self.robot, self.period)
        _check_start(self.robot, self.estimate, motion.state.pose[0])
        lead = self._set_point("the path").length - motion.length[0]
        check_lead("the path", lead)
        text = f"a path of {self.period * (len(motion) - 1):.2f} s"
        self._begin(State.MOVING, Along(motion, self.period, lead), motion, text)

    def execute(self, path: Path | Motion) -> Execution:
        """Follow a path to its end.

        Args:
            path: As in `start`.

        Returns:
            The execution. A fault does not raise an error: the status of the execution reports it.

        Raises:
            RefusedError: For the same reasons as `start`.
        """
        self.start(path)
        return self.wait()

    def path_to(self, pose: PoseLike, speed: float = SPEED, angular_speed: float = TURNING) -> Path:
        """Create a straight path from the present pose of the platform to another pose.

        Args:
            pose: Pose at the end of the path, a single pose.
            speed: Largest speed of the origin [m/s], > 0.
            angular_speed: Largest angular speed of the platform [rad/s], > 0.

        Raises:
            RefusedError: If the pose of the platform is unknown. If the platform is already at `pose`.
        """
        limits = number(speed, "speed", "m/s", above=0.0), number(angular_speed, "angular_speed", "rad/s", above=0.0)
        here = self._here()
        pose = single_pose(pose)
        points = self.robot.platform_anchors
        if float(np.abs(pose.transform(points) - here.transform(points)).max()) < 1e-6:
            raise RefusedError("the way", "the platform is already there", "Give another pose.")
        work = partial(
            septic_path,
            [here, pose],
            speed=limits[0],
            acceleration=limits[0] / SPEEDING_UP,
            angular_speed=limits[1],
            angular_acceleration=limits[1] / SPEEDING_UP,
            rate=round(1.0 / self.period),
        )
        return self._result_of(work)

    def go_to(self, pose: PoseLike, speed: float = SPEED, angular_speed: float = TURNING) -> Execution:
        """Move straight to a pose.

        Args:
            pose: Pose at the end of the motion, a single pose.
            speed: Largest speed of the origin [m/s], > 0.
            angular_speed: Largest angular speed of the platform [rad/s], > 0.

        Returns:
            The execution.

        Raises:
            RefusedError: For the same reasons as `start`.
        """
        check_transition(self.state, State.MOVING, "the way")
        return self.execute(self.path_to(pose, speed, angular_speed))

    def start_jog(self, winch: int, by: float) -> None:
        """Begin to jog one winch: a short motion of one cable.

        Args:
            winch: Index of the winch, from 0.
            by: Change of length [m], positive if cable is paid out.

        Raises:
            RefusedError: If the robot is neither idle nor in homing. If a tension would leave its limits.
        """
        c = self._context
        chosen = whole_number(winch, "winch", 0, c.robot.cable_count - 1)
        far = _at_most(number(by, "by", "m"), "m", MOST_WINCH)
        if isinstance(self._loop.active, HomingState):
            self._loop.active.jog(chosen, far)
            return
        check_transition(self.state, State.JOGGING, "the jog")
        c.check_agreement("the jog")
        here, length = self._here(), self._set_point("the jog").length
        motion = self._result_of(partial(winch_jog, c.robot, length, here, chosen, far, c.period, c.model))
        check_transition(self.state, State.JOGGING, "the jog")
        source = Along(motion, c.period, np.zeros(len(length)))
        self._begin(State.JOGGING, source, motion, f"winch {chosen} by {1e3 * far:+g} mm")

    def jog(self, winch: int, by: float) -> None:
        """Jog one winch, and wait for the end of the jog.

        Args:
            winch: Index of the winch, from 0.
            by: Change of length [m], positive if cable is paid out.

        Raises:
            RefusedError: For the same reasons as `start_jog`.
        """
        self.start_jog(winch, by)
        self._run_while(lambda: self.moving)

    def start_jog_platform(self, by: ArrayLike) -> None:
        """Begin to jog the platform along a straight line; each cycle computes the next pose.

        Args:
            by: Displacement [m], shape (3,), or displacement and rotation vector [m, rad], shape (6,), world axes.

        Raises:
            RefusedError: If the robot is not idle. If no tensions within the limits hold the platform at the end.
        """
        c, far = self._context, _checked_displacement(by)
        check_transition(self.state, State.JOGGING, "the jog")
        c.check_agreement("the jog")
        here, point = self._here(), self._set_point("the jog")
        source = PlatformJog(c.robot, point, here, far, c.period, c.model, c.method)
        self._begin(State.JOGGING, source, None, "the platform")

    def jog_platform(self, by: ArrayLike) -> None:
        """Jog the platform, and wait for the end of the jog.

        Args:
            by: As in `start_jog_platform`.

        Raises:
            RefusedError: For the same reasons as `start_jog_platform`.
        """
        self.start_jog_platform(by)
        self._run_while(lambda: self.moving)

    def wait(self) -> Execution:
        """Run cycles until the motion ends. Ctrl-C stops the robot, and then KeyboardInterrupt is raised.

        Returns:
            The execution of the motion.

        Raises:
            RefusedError: If nothing has moved yet.
        """
        self._run_while(lambda: self.moving)
        done = self.execution
        if done is None:
            raise RefusedError("waiting", "nothing has moved yet", "Begin with start(path).")
        return done

    def pause(self) -> None:
        """Slow down along the path and stop; `resume` continues the motion.

        Raises:
            RefusedError: If no path is being followed.
        """
        check_transition(self.state, State.PAUSING, "pausing")
        active = self._loop.active
        if not isinstance(active.source, Along):
            raise RefusedError("pausing", "no path is being followed", "Stop instead: stop().")
        active.source.pause()
        text = f"at {active.source.clock:.2f} s of the path"
        self._loop.active = Following(self._context, State.PAUSING, text, active.point, active.source)

    def resume(self) -> None:
        """Continue the path at the point where `pause` stopped the platform.

        Raises:
            RefusedError: If no path is paused. If the platform is no longer at the pose of the pause.
        """
        check_transition(self.state, State.MOVING, "resuming")
        run = self._context.run
        if run.paused is None:
            raise RefusedError("resuming", "no path was paused here", "Begin a path with start(path).")
        self._context.check_agreement("resuming")
        _check_start(self.robot, self.estimate, run.paused.pose)
        source, run.paused = run.paused, None
        source.resume()
        self._follow(State.MOVING, source, f"continues at {source.clock:.2f} s of the path")

    # the methods above share these functions

    def _begin(self, state: State, source: SetPointSource, motion: Motion | None, text: str) -> None:
        """Begin to follow the set points of `source`, and start the record of the motion."""
        self._context.begin_run(motion)
        self._follow(state, source, text)

    def _follow(self, state: State, source: SetPointSource, text: str) -> None:
        point = self._set_point(text)._replace(done=False)
        self._context.continue_run()
        self._loop.active = Following(self._context, state, text, point, source)

    def _set_point(self, what: str) -> SetPoint:
        """Set point at rest, from which a motion begins."""
        point = self._loop.active.point
        if point is None:
            raise RefusedError(what, "there is no set point from which it can begin", "Home first: home(pose).")
        return point

    def _here(self) -> Pose:
        """Planned pose of the platform at rest, because the estimated pose contains noise."""
        source = self._loop.active.source
        pose = source.pose if isinstance(source, Standing) else None
        return self.estimate if pose is None else pose


def _check_motion(motion: Motion, robot: Robot, period: float) -> None:
    """Reject `motion` if its plan is not for `robot`, or not for cycles of `period` [s]."""
    step = "Plan the path with this controller: control.plan(path)."
    if abs(motion.period - period) > ON_TICK * period:
        reason = f"its plan is for cycles of {1e3 * motion.period:g} ms; they take {1e3 * period:g} ms"
        raise RefusedError("the path", reason, step)
    if motion.robot is not robot:
        raise RefusedError("the path", f"its plan is for another robot, {motion.robot.name}", step)


def _check_start(robot: Robot, here: Pose, start: Pose) -> None:
    """Reject a motion if its first pose `start` differs from the present pose `here`."""
    points = np.vstack((np.zeros(3), robot.platform_anchors))
    jump = float(np.linalg.norm(start.transform(points) - here.transform(points), axis=1).max())
    if not jump <= START:
        place = ", ".join(f"{x:.4f}" for x in here.position)
        away = f"it begins {1e3 * jump:.3g} mm from the pose of the platform; allowed: {1e3 * START:g} mm"
        raise RefusedError("the path", away, f"Go to the first pose, or begin the path at ({place}) m.")


def _checked_displacement(by: ArrayLike) -> Array:
    """Check the displacement `by`, with or without a rotation vector. Returns both, (6,), by default no rotation."""
    given = checked(by, "by", "m or rad")
    if given.shape not in ((3,), (6,)):
        step = "Give a displacement, or a displacement and a rotation vector."
        raise InvalidValueError("by", f"of shape {given.shape}", "shape (3,) or (6,)", step)
    whole = np.zeros(6)
    whole[: given.size] = given
    for part, unit in ((whole[:3], "m"), (whole[3:], "rad")):
        _at_most(float(np.linalg.norm(part)), unit, MOST_PLATFORM)
    return whole


def _at_most(by: float, unit: str, most: float) -> float:
    if abs(by) <= most:
        return by
    raise InvalidValueError("by", f"{by:g} {unit}", f"up to {most:g} {unit} at a time", "Jog in parts, or use go_to.")
