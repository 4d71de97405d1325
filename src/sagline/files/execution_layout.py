"""What a log of the controller holds of each cycle: quantities, where an execution keeps them, units and digits."""

from __future__ import annotations

from typing import Any, Final

from numpy.typing import NDArray

from sagline.control.execution import Execution
from sagline.control.states import State
from sagline.files.variables import Known, Quantity

ROWS: Final = "time"
NONE: Final = -1  # of a code: there is none
GROUP, CABLE, AXIS, TURN = ("group",), ("cable",), ("axis",), ("quaternion_part",)


def _real(name: str, place: str, parts: tuple[str, ...], unit: str, what: str) -> Quantity:
    return Quantity(name, place, parts, unit, what, known=Known.SOMEWHERE, infinite=True)


def _whole(name: str, place: str, parts: tuple[str, ...], what: str) -> Quantity:
    return Quantity(name, place, parts, "", what, values=int)


TIME: Final = _real("time", "time", (), "s", "time on the clock of the link")
CYCLES: Final = (
    Quantity("answered", "answered", (), "", "whether there was a sample", values=bool),
    Quantity("state", "state", (), "", "state of the controller at the end of the cycle", codes=State),
    _real("late", "late", (), "s", "by how much the cycle began too late"),
    _real("clock", "clock", (), "s", "where on the plan the cycle was, from its start; none beside it"),
    _real("position", "position", AXIS, "m", "position of the platform origin, estimated from the encoders"),
    _real("quaternion", "quaternion", TURN, "1", "rotation from platform to world, estimated, scalar last"),
    _whole("estimate", "estimate", (), f"code of the estimate; {NONE}: none"),
    _whole("mode", "mode", (), f"code of the command's mode; {NONE}: none was sent"),
    _real("set_length", "set_length", CABLE, "m", "set point of the unstrained length, with the zero of homing"),
    _real("set_rate", "set_rate", CABLE, "m/s", "set point of its rate"),
    _real("set_tension", "set_tension", CABLE, "N", "set point of the tension at the drum"),
    _real("planned_tension", "planned_tension", CABLE, "N", "tension at the frame end planned for the sample"),
    _real("correction", "correction", CABLE, "m", "what the tension loop has in the set point of the length"),
    _real("age", "samples.age", GROUP, "s", "since the newest good block came in"),
    _whole("counter", "samples.counter", GROUP, "of the blocks"),
    _real("plc_time", "samples.plc_time", GROUP, "s", "when the PLC wrote its block, on its own clock"),
    _whole("owner", "samples.owner", GROUP, "who has the grant; 0: nobody"),
    _whole("echo", "samples.echo", GROUP, "counter of the last command that the PLC took"),
    _whole("group_status", "samples.status", GROUP, "bits of the PLC's status"),
    _whole("group_fault", "samples.fault", GROUP, "code of why the PLC acts by itself; 0: it does not"),
    _whole("discarded", "samples.discarded", GROUP, "blocks that were no good so far"),
    _real("length", "samples.length", CABLE, "m", "unstrained length off the drum as read, without the zero of homing"),
    _real("rate", "samples.rate", CABLE, "m/s", "its rate"),
    _real("torque", "samples.torque", CABLE, "N m", "of the motor at its shaft, positive where it lets cable out"),
    _real("tension", "samples.tension", CABLE, "N", "tension at the frame end as the load cell reads it"),
    _real("filtered", "samples.filtered", CABLE, "N", "the same behind the PLC's filter"),
    _whole("counts", "samples.counts", CABLE, "of the encoder"),
    _whole("winch_state", "samples.state", CABLE, "code of the winch's state"),
    _whole("winch_fault", "samples.winch_fault", CABLE, "the drive's own code; 0: none"),
)
EVERY: Final = (TIME, *CYCLES)
SMALL: Final = frozenset({"estimate", "mode"})  # whole numbers that are kept in a byte
# Digits behind the point that a log keeps of what is recorded while the machine runs. They are finer than what
# measures: an encoder's step is 72 nm and its whole counts are kept, a load cell's noise is 1 N. With all digits of
# that noise fourteen minutes would be twice as large.
DECIMALS: Final = {
    "time": 6, "late": 6, "clock": 6, "age": 5, "plc_time": 5, "position": 7, "quaternion": 8, "length": 7,
    "set_length": 8, "correction": 8, "rate": 5, "set_rate": 7, "torque": 3, "tension": 2, "filtered": 2,
    "set_tension": 3, "planned_tension": 3,
}  # fmt: skip
EVENTS: Final = {  # of what happened
    "time": "when it happened, on the clock of the link [s]",
    "cycle": "in which cycle of the controller, from 0",
    "kind": "state, fault or note",
    "name": "the state that was entered, or the fault",
    "state": "of the controller after it",
    "text": "what the operator was told",
}


def columns_of(execution: Execution) -> dict[str, NDArray[Any]]:
    """What there is of every cycle.

    Args:
        execution: N cycles.

    Returns:
        Arrays whose first axis is N, by the name of the quantity.
    """
    return {quantity.name: quantity.of(execution) for quantity in EVERY}
