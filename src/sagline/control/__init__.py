"""The controller of a cable robot: states, loops, faults, and link to the machine."""

from sagline.control.checks import Motion
from sagline.control.controller import Controller
from sagline.control.evidence import Cycle, Fault, Reaction
from sagline.control.execution import (
    Execution,
    ExecutionStatus,
    Samples,
    null_space_error,
    planned_position,
    position_error,
)
from sagline.control.faults import FAULT_TABLE, FaultRow, faults_of
from sagline.control.link import Command, Link, Missing, Mode, Sample
from sagline.control.null_space import Gains, NullSpace, gains_along, null_space, parity
from sagline.control.real_time import Histogram, Pace
from sagline.control.recording import Event, EventKind, Recorded, Recorder
from sagline.control.states import RefusedError, State
from sagline.control.tension_loop import TensionLoop, TensionSettings

__all__ = [
    "FAULT_TABLE",
    "Command",
    "Controller",
    "Cycle",
    "Event",
    "EventKind",
    "Execution",
    "ExecutionStatus",
    "Fault",
    "FaultRow",
    "Gains",
    "Histogram",
    "Link",
    "Missing",
    "Mode",
    "Motion",
    "NullSpace",
    "Pace",
    "Reaction",
    "Recorded",
    "Recorder",
    "RefusedError",
    "Sample",
    "Samples",
    "State",
    "TensionLoop",
    "TensionSettings",
    "faults_of",
    "gains_along",
    "null_space",
    "null_space_error",
    "parity",
    "planned_position",
    "position_error",
]
