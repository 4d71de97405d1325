"""Residual vibration after motions of all kinds by simulation, for a test, the benchmark and the table of the page."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

import sagline as sl

WAYPOINTS = [(0.0, 0.0, 1.5), (3.0, 0.0, 1.5)]
SECONDS, RATE = 2.0, 1000.0
AFTER = 3.0  # s of recorded vibration
HEAVY = 1.2


class Scene(NamedTuple):
    """A robot, a motion, and the frequencies with the largest excitation: massless, and with cable mass."""

    robot: sl.Robot
    path: sl.Path
    frequency: np.ndarray
    heavy_cables: np.ndarray


class Way(NamedTuple):
    """A kind of motion: its path, and True if the lengths are quasi-static."""

    path: Callable[[Scene], sl.Path]
    static: bool


@cache
def scene() -> Scene:
    robot = sl.load_robot("article-suspended")
    path = sl.quintic_path(WAYPOINTS, durations=SECONDS, rate=RATE)
    goal = sl.inverse(robot, path.pose[-1], tension=sl.MinimumNorm()).state
    return Scene(robot, path, sl.to_shape(sl.modes(goal), path), sl.vibration(goal, up_to=6.0).to_shape(path))


def _septic(_: Scene) -> sl.Path:
    return sl.septic_path(WAYPOINTS, durations=SECONDS, rate=RATE)


WAYS = {
    "static lengths": Way(lambda s: s.path, True),
    "static lengths, septic": Way(_septic, True),
    "static lengths, ZV": Way(lambda s: sl.shaped(s.path, sl.ZV(s.frequency[0])), True),
    "static lengths, ZVD": Way(lambda s: sl.shaped(s.path, sl.ZVD(s.frequency[0])), True),
    "static lengths, EI": Way(lambda s: sl.shaped(s.path, sl.EI(s.frequency[0])), True),
    "static lengths, ZV of both": Way(lambda s: sl.shaped(s.path, sl.ZV(s.frequency)), True),
    "plan": Way(lambda s: s.path, False),
    "plan, septic": Way(_septic, False),
    "plan, ZVD": Way(lambda s: sl.shaped(s.path, sl.ZVD(s.frequency[0])), False),
    "plan, ZV of both": Way(lambda s: sl.shaped(s.path, sl.ZV(s.frequency)), False),
    "plan, ZVD of both": Way(lambda s: sl.shaped(s.path, sl.ZVD(s.frequency)), False),
    "plan, ZVD of both with cable mass": Way(lambda s: sl.shaped(s.path, sl.ZVD(s.heavy_cables)), False),
    "plan, fastest": Way(lambda s: sl.fastest(s.robot, s.path, jerk=100.0), False),
    "plan, fastest, ZV of both": Way(
        lambda s: sl.shaped(sl.fastest(s.robot, s.path, jerk=100.0), sl.ZV(s.frequency)), False
    ),
}


@cache
def planned(name: str) -> tuple[sl.Path, np.ndarray]:
    """Path and lengths of a kind of motion."""
    way, given = WAYS[name], scene()
    path = way.path(given)
    plan = sl.inverse(given.robot, path.pose if way.static else path, tension=sl.MinimumNorm())
    assert plan.feasible.all()
    return path, plan.unstrained_length


def residual(name: str, mass: float = 1.0, **options: Any) -> float:
    """Largest distance from the rest position after the end of the motion [mm].

    Args:
        name: One of `WAYS`.
        mass: Of the platform that moves, and its inertia, of those that were planned for; it starts from its own
            equilibrium.
        **options: Of `simulate`.
    """
    path, lengths = planned(name)
    robot = scene().robot
    moved = robot.replace(mass=mass * robot.mass, inertia=mass * robot.inertia)
    start = sl.forward(moved, lengths[0], start=path.pose[0]).state
    table = (path.time, lengths)
    run = sl.simulate(start, unstrained_length=table, duration=path.duration + AFTER, record=0.002, **options)
    after = run.pose.position[run.time >= path.duration]
    goal = sl.forward(moved, lengths[-1], start=path.pose[-1]).pose.position
    if options:  # cables with mass have a slightly different shape: relative to the middle of the vibration
        goal = 0.5 * (after.min(axis=0) + after.max(axis=0))
    return float(1e3 * np.linalg.norm(after - goal, axis=1).max())
