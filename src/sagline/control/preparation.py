"""State of a controller as properties, and requests to connect, home, stop, acknowledge faults and switch off."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final, TypeVar

from sagline.control.active_states import Connecting, Following, Holding, HomingState, Off
from sagline.control.context import Context
from sagline.control.execution import Execution
from sagline.control.homing import Homing
from sagline.control.link import Sample
from sagline.control.loop import Loop
from sagline.control.real_time import Pace, interrupt_calls, result_in_thread
from sagline.control.recording import Event, EventKind
from sagline.control.set_points import Along
from sagline.control.states import MOTION, RefusedError, State, check_transition
from sagline.core.arguments import whole_number
from sagline.core.arrays import Array
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot

T = TypeVar("T")
SETTLING: Final = 3.0  # longest time for the comparison of tensions during homing [s]


class Preparation:
    """State of a controller, and requests to connect, home, stop and switch off; base class of `Controller`."""

    def __init__(self, context: Context) -> None:
        """Begin with a control loop in the state OFF."""
        self._context, self._loop = context, Loop(context)

    @property
    def state(self) -> State:
        """State of the controller."""
        return self._context.state

    @property
    def robot(self) -> Robot:
        """Robot for planning."""
        return self._context.robot

    @property
    def period(self) -> float:
        """Period of a cycle [s]."""
        return self._context.period

    @property
    def sample(self) -> Sample | None:
        """Newest sample of the machine; None before the first sample."""
        return self._context.sample

    @property
    def zero(self) -> Array:
        """Offsets that homing adds to the measured lengths [m], shape (m,)."""
        return self._context.zero

    @property
    def homed(self) -> bool:
        """True if the pose of the platform is known."""
        return self._context.homed

    @property
    def owner(self) -> int:
        """Id of the controller."""
        return self._context.sender.owner

    @property
    def degraded(self) -> bool:
        """True if tensions are not reliable, so that the tension loop keeps its correction."""
        return self._context.degraded

    @property
    def events(self) -> tuple[Event, ...]:
        """All events up to now."""
        return tuple(self._context.journal.events)

    def events_from(self, first: int) -> list[Event]:
        """Events after the first `first` events.

        Args:
            first: Number of events that the caller already knows.

        Raises:
            InvalidValueError: If `first` is not a whole number between 0 and the number of events.
        """
        events = self._context.journal.events
        return events[whole_number(first, "first", 0, len(events)) :]

    @property
    def pace(self) -> Pace | None:
        """Pace of the cycles in real time; None in lockstep."""
        return self._context.pace

    @property
    def clock(self) -> tuple[float, float] | None:
        """Time on the path, and duration of the path [s]; None if no path is followed."""
        source = self._loop.active.source
        if not isinstance(source, Along):
            return None
        return source.clock, self.period * (len(source.motion) - 1)

    @property
    def execution(self) -> Execution | None:
        """Execution of the last motion, or of a running motion until now; None before the first motion."""
        return self._context.execution()

    @property
    def estimate(self) -> Pose:
        """Pose of the platform from the encoders.

        Raises:
            RefusedError: If the pose is unknown.
        """
        pose = self._context.estimator.pose
        if pose is None:
            raise RefusedError("the estimate", "the pose of the platform is not known", "Home first: home(pose).")
        return pose

    @property
    def moving(self) -> bool:
        """True if set points change."""
        return self.state in MOTION and not (self.state is State.HOMING and self._loop.active.source is None)

    def cycle(self) -> None:
        """Run one cycle: exchange data, estimate the pose, check for faults, and prepare the next command.

        An exception in the cycle stops the winches. The exception becomes an event, a hold command is sent, and the
        exception is raised again.
        """
        self._loop.cycle()

    def claim(self) -> None:
        """Begin to connect.

        Raises:
            RefusedError: If the controller is already connected. If it only reads.
        """
        if self._context.shadow:
            raise RefusedError("connecting", "this controller only reads", "Make a controller with shadow=False.")
        check_transition(self.state, State.CONNECTING, "connecting")
        self._loop.active = Connecting(self._context)

    def connect(self) -> None:
        """Connect, and wait until all groups agree.

        Raises:
            RefusedError: If the groups do not agree: the message contains the reason.
        """
        self.claim()
        connecting = self._loop.active
        self._run_while(lambda: self.state is State.CONNECTING or self._leaving)
        if self.state is not State.READY:
            step = "Check the machine, and if another controller owns it; then try again."
            refused = connecting.claim.refused if isinstance(connecting, Connecting) else None
            raise RefusedError("connecting", *(refused or (self._context.run.reason, step)))

    def begin_homing(self, pose: PoseLike) -> None:
        """State the pose of the platform at rest, and begin to compare tensions.

        Args:
            pose: A single pose.

        Raises:
            RefusedError: If the robot is not ready. If no tensions within the limits exist at `pose`.
        """
        c, active = self._context, self._loop.active
        if not isinstance(active, HomingState):
            check_transition(self.state, State.HOMING, "homing")
        elif active.source is not None:
            raise RefusedError("homing", "a winch is being jogged", "Wait until it stops.")
        place = single_pose(pose)
        present = c.zero - c.correction  # the lengths include the correction of the tension loop
        homing = self._result_of(partial(Homing, c.robot, place, c.model, c.method, present))
        c.zero, c.homed = present, False
        c.reset_tension_loop()
        active = self._loop.active
        if isinstance(active, HomingState):
            active.homing = homing
        else:
            self._loop.active = HomingState(c, homing)

    def home(self, pose: PoseLike) -> None:
        """State the pose of the platform at rest, and wait until tensions and lengths agree.

        Lengths are compared only if the robot has `length_zero` or the controller was homed before.

        Args:
            pose: A single pose.

        Raises:
            RefusedError: If the tensions do not agree: the message recommends a jog. If only the lengths of the machine
                do not agree. In both cases, the state remains HOMING, and no length changes.
        """
        self.begin_homing(pose)
        self._compare()

    def confirm_homing(self) -> None:
        """Confirm the pose of `home` despite different lengths in the machine, and wait until the tensions agree again.

        Raises:
            RefusedError: If the last call of `home` did not report a difference of lengths. If a winch has moved since
                `home`. If the tensions do not agree.
        """
        active = self._loop.active
        if not isinstance(active, HomingState) or not active.homing.conflicts:
            reason = "no difference of lengths was reported, or a winch has moved after the report"
            raise RefusedError("confirming", reason, "Home first: home(pose).")
        active.homing.confirmed, active.homing.agrees = True, False
        self._compare()

    def _compare(self) -> None:
        """Wait until homing ends. Raise an error if homing fails."""
        last = self._context.number + round(SETTLING / self.period)

        def waits() -> bool:
            active = self._loop.active
            return isinstance(active, HomingState) and not active.homing.conflicts and self._context.number < last

        self._run_while(waits)
        active = self._loop.active
        if isinstance(active, HomingState):
            raise self._result_of(active.homing.refusal)
        if self.state is not State.IDLE:
            reason = f"it ended in {self.state.name}: {self._context.run.reason}"
            raise RefusedError("homing", reason, "Read the events.")

    def stop(self) -> None:
        """Stop the robot: if it moves, all rates decrease to zero from the next cycle on."""
        self._loop.stop_requested = True

    def acknowledge(self) -> None:
        """Confirm that a fault is repaired. The state changes from FAULT to READY, and to IDLE if the pose is known.

        If load cells are ignored while the robot is idle, they are used again.

        Raises:
            RefusedError: If there is no fault. If a group does not agree yet: the message contains the reason.
        """
        c, what = self._context, "acknowledging"
        if self.state is State.IDLE and self.degraded:
            c.clear_faults()
            c.say(EventKind.NOTE, "acknowledged", "the load cells are used again")
            return
        if self.state is not State.FAULT:
            raise RefusedError(what, f"the state is {self.state.name}", "There is nothing to acknowledge.")
        sample = c.check_agreement(what)
        c.clear_faults()
        self._loop.active = Holding(c, State.READY, "the operator acknowledged")
        if c.homed:
            found = c.find_equilibrium(sample.length + c.zero - c.correction)
            self._loop.active = Following.at_rest(c, found, "the pose is still known") or self._loop.active

    def off(self) -> None:
        """Give up the ownership of all groups, and wait until no group is owned. The brakes then engage.

        Raises:
            RefusedError: If the robot moves.
        """
        if self.state is not State.OFF:
            check_transition(self.state, State.OFF, "switching off")
            self._loop.active = Off(self._context, "the operator", self._loop.active.point)
            self.cycle()
        while self._leaving:
            self.cycle()

    @property
    def _leaving(self) -> bool:
        """True in the state OFF until the ownership of all groups is given up."""
        return self.state is State.OFF and self._context.sender.command is not None

    def _run_while(self, condition: Callable[[], bool]) -> None:
        """Run cycles while a condition holds. Ctrl-C first stops the motion."""
        try:
            with interrupt_calls(self.stop):
                while condition():
                    self.cycle()
        finally:
            self._context.collect_garbage()

    def _result_of(self, work: Callable[[], T]) -> T:
        """Result of long `work`. In real time, cycles continue meanwhile, because otherwise the PLCs would hold."""
        if self._context.pace is None or self.state is State.OFF:
            return work()
        result = result_in_thread(work)

        def stop() -> None:
            self.stop()
            result.cancel()

        with interrupt_calls(stop):
            while not result.done():
                self.cycle()
        return result.result()
