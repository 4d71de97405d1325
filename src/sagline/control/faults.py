"""Table of all faults, and creation of the fault rules for a robot."""

from __future__ import annotations

from typing import Final, NamedTuple

from sagline.control.evidence import Evidence, Fault
from sagline.control.faults_cables import CableBroken, CellDead, CellLost, CellOff, CellStuck, OverTension, Slack
from sagline.control.faults_drives import CorrectionAtLimit, EncoderJump, FollowingError, NotFollowing, ServoSaturated
from sagline.control.faults_link import (
    BlockDiscarded,
    CycleLate,
    CycleLost,
    EmergencyStop,
    GroupActs,
    GroupSilent,
    GroupStale,
    OwnerLost,
    RecordingStopped,
)
from sagline.control.link import PERIOD
from sagline.control.null_space import cell_errors
from sagline.control.tension_loop import TensionSettings
from sagline.core.arguments import brief, instance
from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot

LARGEST_CORRECTION: Final = TensionSettings().largest  # largest correction of the tension loop [m]

# in the order of evaluation, because a lost or dead cell must be found before its cable counts as slack
FAULTS: Final[tuple[type[Fault], ...]] = (
    EmergencyStop,
    OwnerLost,
    GroupActs,
    GroupSilent,
    GroupStale,
    BlockDiscarded,
    CellLost,
    CellDead,
    CellStuck,
    CellOff,
    OverTension,
    CableBroken,
    Slack,
    EncoderJump,
    FollowingError,
    NotFollowing,
    ServoSaturated,
    CorrectionAtLimit,
    CycleLost,
    CycleLate,
    RecordingStopped,
)


class FaultRow(NamedTuple):
    """Row of the fault table in the documentation.

    Attributes:
        name: Name of its events.
        rule: Condition of the fault.
        to: Name of the controller's reaction.
        within: Longest time until detection.
        by: Part that detects the fault.
    """

    name: str
    rule: str
    to: str
    within: str
    by: str


_ELSEWHERE: Final = (
    FaultRow(
        "controller dead",
        "the command counter does not change for 100 ms",
        "ramp of 0.2 s, hold",
        "300 ms",
        "each PLC",
    ),
    FaultRow("foreign block", "magic, version, group or size differ on connection", "OFF", "1 cycle", "the connection"),
    FaultRow("second controller", "another controller owns a group on connection", "OFF", "1 cycle", "the connection"),
    FaultRow("set point infeasible", "the plan's status", "refused before it is sent", "", "the check of the plan"),
)
FAULT_TABLE: Final = (
    *(FaultRow(kind.name, kind.rule, kind.reaction.name, kind.within, "the controller") for kind in FAULTS),
    *_ELSEWHERE,
)


def faults_of(
    robot: Robot,
    period: float = PERIOD,
    *,
    groups: tuple[tuple[int, ...], ...] | None = None,
    cell_deviation: float | None = None,
    cell_bias: float | None = None,
    largest_correction: float = LARGEST_CORRECTION,
) -> tuple[Fault, ...]:
    """Create a set of fault rules. A controller creates a new set each time it leaves OFF, FAULT or homing.

    Args:
        robot: Robot for planning.
        period: Period of a cycle [s], > 0.
        groups: Winches of each group, as in the link; None for groups of two neighboring winches.
        cell_deviation: Standard deviation of a good load cell [N], > 0; None: the value of the robot's winches, or 1 N
            if they have no value.
        cell_bias: Largest bias of a good load cell [N], >= 0; None: the value of the robot's winches, and at least 2 N.
        largest_correction: Largest correction of a length by the tension loop [m], > 0.

    Returns:
        The rules. Evaluate all of them in every cycle, in this order.

    Raises:
        InvalidValueError: If an argument has the wrong type or is out of its range.

    Examples:
        >>> import sagline as sl
        >>> rules = sl.control.faults_of(sl.load_robot("article-prototype"))
        >>> print(len(rules), "rules,", rules[0].name, "first:", rules[0].reaction.name)
        21 rules, emergency stop first: EMERGENCY
    """
    checked_robot = instance(robot, Robot, "robot")
    if groups is not None:
        _check_groups(groups, checked_robot.cable_count)
    known = [float(errors.max()) for errors in cell_errors(checked_robot)]
    given = (cell_deviation, cell_bias)
    deviation, bias = (own if value is None else value for value, own in zip(given, known, strict=True))
    seen = Evidence(
        checked_robot,
        number(period, "period", "s", above=0.0),
        groups,
        (number(deviation, "cell_deviation", "N", above=0.0), number(bias, "cell_bias", "N", low=0.0)),
        number(largest_correction, "largest_correction", "m", above=0.0),
    )
    return tuple(kind(seen) for kind in FAULTS)


def _check_groups(groups: object, cable_count: int) -> None:
    """Reject groups that do not contain every winch exactly once."""
    try:
        winches = sorted(winch for group in groups for winch in group)  # type: ignore[attr-defined]
        fits = winches == list(range(cable_count))
    except TypeError:
        fits = False
    if not fits:
        allowed = f"tuples with each winch from 0 to {cable_count - 1} once"
        raise InvalidValueError("groups", brief(groups), allowed, "Give the groups of the link: link.groups.")
