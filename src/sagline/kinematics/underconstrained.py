"""Inverse kinematics of robots with fewer cables than degrees of freedom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress, blocks
from sagline.kernels import codes
from sagline.kernels.inverse.underconstrained import LEVEL, YAW, underconstrained_poses
from sagline.kernels.memory import memory_for
from sagline.kinematics.inverse_rows import BLOCK, InverseRows, Verdicts
from sagline.robot.batch import Robots, first_of, has_routing
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import LIMITS_OF

Given = Literal["x", "y", "z", "yaw", "level"]
CODES: Final[dict[str, int]] = {"x": 0, "y": 1, "z": 2, "yaw": YAW, "level": LEVEL}
_DEFAULT: Final = (*"xyz", "level")  # the first m of these, with three or four cables


def given_codes(robot: Robot, given: Sequence[Given] | None) -> Indices | None:
    """Codes of the given values of an underconstrained platform, (m,); None if the robot has enough cables.

    Raises:
        InvalidValueError: If the number of names is not m, or m is 1. If a name is unknown or occurs twice. If names
            are given for a robot with enough cables.
    """
    m = robot.cable_count
    if not is_underconstrained(robot):
        if given is not None:
            step = "Leave it out; the whole pose is given."
            raise InvalidValueError("given", brief(given), f"None for {m} cables and {robot.motion_pattern}", step)
        return None
    if given is None and not (3 <= m <= len(_DEFAULT) and robot.motion_pattern == "3R3T"):
        fewer = "3, 4 or " if robot.motion_pattern == "3R3T" else ""
        allowed = f"{fewer}>= {robot.degrees_of_freedom} for {robot.motion_pattern}"
        step = f"Add cables; or, in Python, name {m} given values for inverse, such as given=('x', 'z')."
        raise InvalidValueError(f"{robot.name}: number of cables", m, allowed, step)
    names = _DEFAULT[:m] if given is None else tuple(choice(name, "given", CODES) for name in given)
    if len(names) != m or len(set(names)) != m or m < 2:
        allowed = f"{m} different names of {', '.join(CODES)} for {m} cables" if m > 1 else "at least 2 cables"
        raise InvalidValueError("given", ", ".join(names), allowed, "Give as many values as the robot has cables.")
    return locked(np.array([CODES[name] for name in names], dtype=np.int64))


def solve_underconstrained_rows(
    robot: Robots,
    model: CableModel,
    rows: Array,
    loads: Array,
    given: Indices | None,
    level: float,
    chained: bool,
    stability: bool,
    progress: Progress | None = None,
) -> tuple[InverseRows, Verdicts, Array]:
    """Results, verdicts, and rows of the found poses (N, POSE_COLUMNS).

    rows: rows of the given poses; loads: external plus inertial wrenches (1 or N, 6); given: codes (m,); level: tension
    level [N]; chained: True to start each pose at the pose before; stability: True to mark solved poses as
    UNPROVED_STABILITY.
    """
    assert given is not None  # checked by the caller
    shared = first_of(robot)
    m, n = shared.cable_count, shared.degrees_of_freedom
    found, verdicts = InverseRows.empty(len(rows), m, n, has_routing(robot)), Verdicts.empty(len(rows), m, n)
    poses = np.empty_like(rows)
    terms = (model.code, *model.parameters), (LIMITS_OF[shared.tension_limits_of], np.nan), robot_terms(robot)
    memory = memory_for(max(m, n))
    arrays = (found.answers, poses, verdicts.blocking)
    for part in blocks(len(rows), BLOCK):
        underconstrained_poses(*terms, rows, loads, given, level, chained, memory, *arrays, part.start, part.stop)
        if progress is not None:
            progress(part.stop, len(rows))
    solved = found.pose_status == codes.POSE_SOLVED
    verdicts.brackets[solved] = 0.0
    if stability:
        found.pose_status[solved] = codes.UNPROVED_STABILITY
    return found, verdicts, locked(poses)
