"""Gains of the tension loop along a plan, worked out before anything moves."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.control.null_space import NullSpace, null_space
from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kinematics.plan import Plan
from sagline.robot.several import first_of

EVERY: Final = 0.5  # s between rows: 3 cm at the article's speed


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """A table of what the tension loop needs, one row a pose of the plan.

    Attributes:
        time: Of the poses [s], strictly increasing, shape (R,); 0 for a plan of a single pose.
        rows: What is needed there, R of them.
    """

    time: Array
    rows: tuple[NullSpace, ...]
    _changes: tuple[float, ...]  # where the next row is as near, R - 1 of them

    def at(self, time: float) -> NullSpace:
        """The row of the nearest pose; before the first that one, after the last the last, where the robot waits.

        Args:
            time: On the path's clock [s].
        """
        return self.rows[bisect_right(self._changes, time)]


def gains_along(plan: Plan, every: float = EVERY) -> Gains | None:
    """Gains of the tension loop along a plan.

    Args:
        plan: Along a path, or of a single pose; feasible.
        every: Time between two rows [s], > 0; the plan's samples nearest to these times are taken.

    Returns:
        The table; None for a robot without redundancy, which has no tension loop: its tensions follow from the load.

    Raises:
        InvalidValueError: If the plan is of poses without a path, or has one without lengths.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> path = sl.quintic_path([(0, 0, 1.5), (0.3, 0, 1.5)], speed=0.1)
        >>> gains = sl.control.gains_along(sl.inverse(robot, path))
        >>> print(len(gains.rows), "rows")
        13 rows

    Source:
        docs/model.md, section 12.
    """
    step = number(every, "every", "s", above=0.0)
    state = instance(plan, Plan, "plan").state
    robot = first_of(state.robot)
    if robot.cable_count <= len(robot.freedom):
        return None
    if plan.path is None:
        if state.pose.shape:
            raise InvalidValueError("plan", "of poses without a path", "a plan with times", "Plan a path of them.")
        time, row = np.zeros(1), null_space(state)
        spaces = [row]
    else:
        chosen = _nearest(plan.path.time, step)
        time, batch = plan.path.time[chosen], null_space(state[chosen])
        spaces = [NullSpace(*parts) for parts in zip(*batch, strict=True)]
    lost = [i for i, row in enumerate(spaces) if np.isnan(row.correction).any()]
    if lost:
        raise InvalidValueError(
            "plan", f"without lengths or stiffness at {time[lost[0]]:g} s", "a feasible plan", "Change the path."
        )
    changes = tuple((0.5 * (time[1:] + time[:-1])).tolist())
    return Gains(locked(np.array(time)), tuple(spaces), changes)


def _nearest(time: Array, step: float) -> np.ndarray:
    """Samples nearest to the first time and every step from there on, the last sample too; no sample twice."""
    wanted = time[0] + step * np.arange(int((time[-1] - time[0]) / step) + 1)
    after = np.clip(np.searchsorted(time, wanted), 1, max(time.size - 1, 1))
    if time.size == 1:
        return np.zeros(1, dtype=np.int64)
    nearer = np.where(wanted - time[after - 1] <= time[after] - wanted, after - 1, after)
    return np.unique(np.append(nearer, time.size - 1))
