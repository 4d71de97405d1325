"""The controller of a cable robot: states, loops, faults, and the link to a machine."""

from sagline.control.events import Event, EventKind
from sagline.control.execution import Execution, ExecutionStatus, Samples
from sagline.control.link import Command, Link, Missing, Mode, Sample
from sagline.control.recording import Recorded, Recorder
from sagline.control.states import RefusedError, State

__all__ = [
    "Command",
    "Event",
    "EventKind",
    "Execution",
    "ExecutionStatus",
    "Link",
    "Missing",
    "Mode",
    "Recorded",
    "Recorder",
    "RefusedError",
    "Sample",
    "Samples",
    "State",
]
