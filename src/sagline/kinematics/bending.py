"""Bending cycles of the cables on pulleys and drums along a plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from sagline.core.arguments import instance, whole_number
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.kinematics.plan import Plan

MOST_ELEMENTS: Final = 100_000


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BendingCycles(Result, Tabular):
    """Result of `bending_cycles`: cycles of K elements of each cable, arrays of shape (K, m).

    An element has its place on the cable. A cycle is straight, bent, straight; the element bends when it reaches a
    pulley or drum, and straightens when it leaves it, so that each of these events is half a cycle.

    Attributes:
        plan: The plan.
        position: Unstrained length of cable between the platform end and the middle of each element [m], shape (K,).
        pulley: Cycles on the pulley; zero without a pulley.
        drum: Cycles on the drum.
        tension: Largest tension at the frame end while an element bends or straightens [N]; 0 for an element that does
            neither.
    """

    _columns: ClassVar[Columns] = ("position", "pulley#=pulley", "drum#=drum", "T#=tension")

    plan: Plan
    position: Array
    pulley: Array
    drum: Array
    tension: Array

    @property
    def largest(self) -> Array:
        """Cycles on pulley and drum of the element with most cycles, for each cable, shape (m,)."""
        return locked((self.pulley + self.drum).max(axis=0))


def bending_cycles(plan: Plan, elements: int = 500) -> BendingCycles:
    """Count the bending cycles of the elements of each cable on its pulley and its drum, along a plan.

    The count is an input for rules of wear and discard. It is not a proof of safety: life also depends on the rope, on
    the diameters of pulleys and drums, on tensions, lubrication and side deflection. Guides are not counted. Cable on
    the pulley or drum at the first sample is bent, which is not an event. Between samples, lengths change uniformly.

    Args:
        plan: A plan along a path without gaps, of a robot with winches.
        elements: Number of elements of equal length, 1 to 100,000, over the longest length off the drums.

    Returns:
        BendingCycles.

    Raises:
        InvalidValueError: If the plan has no path, a sample without a solution, or a robot without winches.

    Examples:
        >>> import sagline as sl
        >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=3.0, drum_radius=0.06)
        >>> robot = sl.load_robot("cogiro").replace(winches=winch)
        >>> path = sl.quintic_path([(0, 0, 1), (0, 0, 3), (0, 0, 1)], durations=2.0)
        >>> found = sl.bending_cycles(sl.inverse(robot, path))
        >>> print(found.largest)
        [2. 2. 2. 2. 2. 2. 2. 2.]
    """
    state, elements = instance(plan, Plan, "plan").state, whole_number(elements, "elements", 1, MOST_ELEMENTS)
    robot, contact = state.one_robot, state.contact
    if plan.path is None:
        raise InvalidValueError("plan", "a plan of poses without times", "a plan along a path", "Plan along a Path.")
    if robot.winches is None:
        step = "Give them in the robot file, or with robot.replace(winches=Winch(...))."
        raise InvalidValueError("winches", "not given", "the winches of the cables", step)
    free, whole = state.free_length, plan.unstrained_length
    lost = np.flatnonzero(np.isnan(whole).any(axis=1))
    if lost.size:
        step = "Select a path inside the feasible region."
        raise InvalidValueError(f"plan: sample {lost[0]}", "without a solution", "a solution at all samples", step)
    wrapped = np.zeros(free.shape) if contact is None else contact.wrapped_length
    edges = np.linspace(0.0, whole.max(), elements + 1)
    position = 0.5 * (edges[1:] + edges[:-1])
    tension = state.cables.frame_end_tension
    tension = np.maximum(tension[1:], tension[:-1])
    counts = np.zeros((2, elements, robot.cable_count))
    largest = np.zeros((elements, robot.cable_count))
    ends = [(1, whole)] + [(0, end) for end in (free, free + wrapped) if robot.winches.pulley_radius.any()]
    for which, end in ends:
        for i in range(robot.cable_count):
            if which == 0 and robot.winches.pulley_radius[i] == 0.0:
                continue
            beyond = np.searchsorted(position, end[:, i], side="right")  # first element beyond the end, (N,)
            first, last = np.minimum(beyond[1:], beyond[:-1]), np.maximum(beyond[1:], beyond[:-1])
            for k in np.flatnonzero(first < last):
                part = slice(first[k], last[k])  # elements that pass the end
                counts[which, part, i] += 0.5
                largest[part, i] = np.maximum(largest[part, i], tension[k, i])
    return BendingCycles(plan, locked(position), locked(counts[0]), locked(counts[1]), locked(largest))
