"""The nearest pose at which the platform can be held, turned as it is or, where that can be nowhere, level."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags
from sagline.core.errors import SaglineError
from sagline.kinematics.inverse import inverse
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.hull import CELLS, Asked
from sagline.workspaces.levels import Levels
from sagline.workspaces.region import Region, region_of
from sagline.workspaces.wrench_sets import WrenchBox

NODES: Final = 15  # of the first grid, along each axis
AROUND: Final = 2  # points of a finer one to each side
STARTS: Final = 4
ROUNDS: Final = 40
FINEST: Final = 1e-6  # of the region's size
AT_ONCE: Final = 250  # positions: a few milliseconds, after which others have their turn
INWARD: Final = (1e-5, 1e-4, 1e-3, 1e-2)  # of the region's size: the border itself is no place to stay


class NearestHeld(NamedTuple):
    """A pose that is held.

    Attributes:
        pose: The pose.
        distance: To it [m].
        turned: Whether the platform has to be turned too.
    """

    pose: Pose
    distance: float
    turned: bool


def nearest_held(robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> NearestHeld | None:
    """Look for it.

    Args:
        robot: The robot.
        pose: Where it cannot be held.
        model: Cable model.
        wrench: External wrench on the platform, shape (6,); None for none.

    Returns:
        The pose; None where none was found within the robot's region.
    """
    for turned in (False, True):
        looked_at = Pose(pose.position, np.eye(3)) if turned else pose
        if turned and np.allclose(looked_at.matrix, pose.matrix):
            break
        try:
            search = _Search(robot, looked_at, model, wrench)
            found = search.nearest(pose.position)
        except SaglineError:  # a pattern that does not turn so
            continue
        if found is not None:
            there = Pose.from_quaternion(found, looked_at.quaternion)
            return NearestHeld(there, float(np.linalg.norm(found - pose.position)), turned)
    return None


class _Search:
    """At one orientation."""

    def __init__(self, robot: Robot, pose: Pose, model: CableModel, wrench: Array | None) -> None:
        self._robot, self._model, self._wrench, self._quaternion = robot, model, wrench, pose.quaternion
        self._levels: Levels = Asked(robot, pose.quaternion, model, WrenchBox(center=wrench)).levels()
        self._region: Region = region_of(robot, None, CELLS)
        free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
        if self._region.flat is not None:
            free[self._region.flat] = False
        self._free = np.flatnonzero(free)
        self._size = float(np.max(self._region.high - self._region.low))

    def nearest(self, start: Array) -> Array | None:
        """The nearest position where it is held [m], (3,)."""
        low, high = self._region.low, self._region.high
        axes = [np.linspace(low[axis], high[axis], NODES) for axis in self._free]
        nodes = np.tile(start, (NODES ** len(axes), 1))
        nodes[:, self._free] = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        inside = nodes[self._held(nodes)]
        if not len(inside):
            return None
        order = np.argsort(np.linalg.norm(inside - start, axis=1))[:STARTS]
        step = (high - low)[self._free] / (NODES - 1)
        best = min((self._refined(start, node, step) for node in inside[order]), key=lambda at: _distance(at, start))
        return self._moved_in(start, best)

    def _refined(self, start: Array, best: Array, step: Array) -> Array:
        """Nearer and nearer, by finer and finer grids around the nearest so far."""
        ways = np.linspace(-1.0, 1.0, 2 * AROUND + 1)
        offsets = np.stack(np.meshgrid(*[ways] * len(step), indexing="ij"), axis=-1).reshape(-1, len(step))
        for _ in range(ROUNDS):
            places = np.tile(best, (len(offsets), 1))
            places[:, self._free] += offsets * step
            nearer = places[np.linalg.norm(places - start, axis=1) < _distance(best, start)]
            held = nearer[self._held(nearer)]
            if len(held):
                best = held[np.argmin(np.linalg.norm(held - start, axis=1))]
            else:
                step = step / AROUND
                if step.max() < FINEST * self._size:
                    break
        return best

    def _moved_in(self, start: Array, best: Array) -> Array | None:
        """A little beyond the border, where the platform is held as `inverse` sees it."""
        way = best - start
        way = way / max(float(np.linalg.norm(way)), 1e-12)
        for share in INWARD:
            place = best + share * self._size * way
            if inverse(self._robot, self._pose(place), self._model, wrench=self._wrench).feasible:
                return place
        return None

    def _held(self, places: Array) -> Flags:
        parts = [self._levels.details(part).margin >= 0.0 for part in _parts(places)]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=np.bool_)

    def _pose(self, place: Array) -> Pose:
        return Pose.from_quaternion(place, self._quaternion)


def _parts(places: Array) -> list[Array]:
    return [places[k : k + AT_ONCE] for k in range(0, len(places), AT_ONCE)]


def _distance(one: Array, other: Array) -> float:
    return float(np.linalg.norm(one - other))
