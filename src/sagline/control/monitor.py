"""Read-only view of a controller: state, samples, events, estimate and execution."""

from __future__ import annotations

from sagline.control.context import Context
from sagline.control.execution import Execution
from sagline.control.link import Sample
from sagline.control.loop import Loop
from sagline.control.real_time import Pace
from sagline.control.recording import Event
from sagline.control.set_points import Along
from sagline.control.states import MOTION, RefusedError, State
from sagline.core.arguments import whole_number
from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


class Monitor:
    """State, samples, events, estimate and execution of a controller; base class of `Controller`."""

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
        """Newest sample of the machine; None before the first."""
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
        return self._context.owner

    @property
    def degraded(self) -> bool:
        """True if tensions are not reliable. The tension loop then keeps its correction."""
        return self._context.degraded

    @property
    def events(self) -> tuple[Event, ...]:
        """All events up to now."""
        return tuple(self._context.journal.events)

    def events_from(self, first: int) -> list[Event]:
        """Events that are newer than the known events.

        Args:
            first: Number of events that are already known.

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
