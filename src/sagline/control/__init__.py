"""The controller of a cable robot: states, loops, faults, and the link to a machine."""

from sagline.control.checks import Motion
from sagline.control.controller import Controller
from sagline.control.cycle import Cycle
from sagline.control.deviation import null_space_error, planned_position, position_error
from sagline.control.events import Event, EventKind
from sagline.control.execution import Execution, ExecutionStatus, Samples
from sagline.control.fault import Fault, Reaction
from sagline.control.faults import FAULT_TABLE, FaultRow, faults_of
from sagline.control.gains import Gains, gains_along
from sagline.control.link import Command, Link, Missing, Mode, Sample
from sagline.control.load_cells import parity
from sagline.control.null_space import NullSpace, null_space
from sagline.control.pace import Histogram, Pace
from sagline.control.recording import Recorded, Recorder
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
