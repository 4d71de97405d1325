"""What a run does over time, as drawings."""

from __future__ import annotations

from math import isfinite

from sagline.arrays import Array
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot
from sagline.viewer.course_figure import CourseFigure, Limit
from sagline.viewer.readout import force_unit


def run_figures(plan: Plan, time: Array) -> tuple[CourseFigure, ...]:
    """The tensions that are limited, with their limits, and the lengths; over time [s], shape (N,)."""
    return _tensions(plan, time), CourseFigure.of("Unstrained length [m]", time, plan.unstrained_length)


def _tensions(plan: Plan, time: Array) -> CourseFigure:
    robot, unit = plan.state.one_robot, force_unit(plan.state.one_robot)
    name = "Chord tension" if robot.tension_limits_of == "chord" else "Tension at the winch"
    values = plan.state.limited_tension / unit.newtons
    return CourseFigure.of(f"{name} [{unit.name}]", time, values, _limits(robot, unit.newtons))


def _limits(robot: Robot, newtons: float) -> tuple[Limit, ...]:
    """The limits that all cables keep, in a unit [N]; where they differ, the first that one may reach."""
    low, high = float(robot.tension_min.max()), float(robot.tension_max.min())
    lower = (Limit(low / newtons, "lowest allowed"),) if low > 0.0 else ()
    upper = (Limit(high / newtons, "highest allowed"),) if isfinite(high) else ()
    return lower + upper
