"""Least distances over batches of poses, everything but the poses made ready once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import blocks
from sagline.interference.mesh import Mesh
from sagline.interference.obstacles import Box, Capsule, Sphere
from sagline.interference.pairs import Obstacle, pairs_of
from sagline.interference.rows import box_rows, cable_rows, parts_of, rod_row
from sagline.kernels.interference import shapes
from sagline.kernels.interference.hanging_distance import least_distances, memory_for_pieces
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.robot.several import Robots, first_of

BLOCK = 1024  # poses


class Distances(NamedTuple):
    """Of N poses and P pairs.

    Attributes:
        value: Distances less radii [m], shape (N, P); NaN where a cable has no tension.
        low: Proved lower bounds [m], shape (N, P).
        nearest: Nearest points, on the middle lines of cables and rods [m], shape (N, P, 2, 3).
    """

    value: Array
    low: Array
    nearest: Array


class ClearanceRows:
    """What is measured at every pose of a robot, made once.

    Attributes:
        pairs: Names, numbers and what is left out.
    """

    def __init__(
        self,
        robot: Robots,
        obstacles: tuple[Obstacle, ...] = (),
        *,
        precision: float = 1e-4,
        cable_radius: Array | None = None,
        platform: Box | Mesh | None = None,
        from_anchor: float | None = None,
    ) -> None:
        """Make ready; arguments are checked already, as of `clearance`."""
        self._precision = precision
        self._radius = cable_radius
        self._from_anchor = 0.0 if from_anchor is None else from_anchor
        self._platform = platform_of(robot) if platform is None else platform
        self.pairs = pairs_of(robot, obstacles, self._platform, from_anchor=from_anchor is not None)
        still = [rod_row(one) if isinstance(one, Capsule | Sphere) else _box_row(one) for one in obstacles]
        self._still = locked(np.array(still).reshape(-1, shapes.COLUMNS))
        self._meshed = None
        if len(self.pairs.with_mesh):
            from sagline.interference.meshed import Meshed  # which needs python-fcl

            self._meshed = Meshed(self.pairs, (self._platform, *obstacles), precision)

    def distances(self, state: Equilibrium, *, together: bool = False) -> Distances:
        """Least distance of every pair at every pose.

        Args:
            state: The equilibrium, a batch of N poses; a single one has N = 1.
            together: Whether the least of all pairs is enough: of the others then only so much is known.

        Returns:
            Distances.
        """
        single = not state.pose.shape
        count, several = 1 if single else len(state), len(self.pairs.names)
        out = Distances(np.empty((count, several)), np.empty((count, several)), np.empty((count, several, 2, 3)))
        known, memory = len(self.pairs.by_kernel), memory_for_pieces()  # of its own: threads may measure at once
        for part in blocks(count, BLOCK):
            own = state if single else state[part]
            moving = self._moving(own)
            some = tuple(np.empty((len(moving), known, *rest)) for rest in ((), (), (2, 3)))
            least_distances(moving, self._still, self.pairs.by_kernel, self._precision, together, *memory, *some)
            for whole, piece in zip(out, some, strict=True):
                whole[part, :known] = piece
            if self._meshed is not None:
                rest = Distances(*(whole[part, known:] for whole in out))
                least = out.value[part, :known].min(axis=1, initial=np.inf)
                self._meshed.measure(own.pose, moving, least if together else None, rest)
            lost = np.isnan(np.atleast_2d(own.free_length)).any(axis=1)
            for whole in out:
                whole[part][lost] = np.nan
        return out

    def least(self, state: Equilibrium) -> tuple[Array, Indices]:
        """Least distance of all pairs at every pose: a third of the time that every pair takes.

        Args:
            state: The equilibrium, a batch of N poses.

        Returns:
            Distances [m], shape (N,): NaN where a cable has no tension, infinite where nothing is measured; and the
            pair's number, -1 where there is none.
        """
        lost = np.asarray(np.isnan(np.atleast_2d(state.free_length)).any(axis=1))
        found = np.nan_to_num(self.distances(state, together=True).value, nan=np.inf)
        if not found.shape[1]:
            return np.where(lost, np.nan, np.inf), np.full(len(lost), -1)
        pair = np.where(lost, -1, found.argmin(axis=1))
        return np.where(lost, np.nan, found.min(axis=1)), pair

    def _moving(self, state: Equilibrium) -> Array:
        """Rows of what moves: the parts of cables, and the platform or what stands for it."""
        diameter = state.cables.cable.diameter
        known = np.zeros(1) if diameter is None else 0.5 * diameter
        cables = cable_rows(state, known if self._radius is None else self._radius)
        lengths = np.atleast_2d(state.free_length)
        parts = parts_of(cables.reshape(*lengths.shape, -1), lengths, self.pairs.parts, self._from_anchor)
        box = self._platform if isinstance(self._platform, Box) else Box(np.ones(3))
        rows = np.concatenate((parts, box_rows(box, state.pose).reshape(-1, 1, shapes.COLUMNS)), axis=1)
        return locked(np.ascontiguousarray(rows))  # a batch's are not, and the kernel would be compiled again


def _box_row(one: Box | Mesh) -> Array:
    """The row of a box; of a mesh one that stands for it, so that obstacles keep their numbers."""
    return box_rows(one if isinstance(one, Box) else Box(np.ones(3)))


def platform_of(robot: Robots) -> Box | None:
    """The platform as a box of its size around its anchors, as it is drawn; None where no size is given.

    Raises:
        InvalidValueError: If several robots have platforms of several forms.
    """
    one = first_of(robot)
    for other in () if isinstance(robot, Robot) else robot[1:]:
        if not all(_alike(getattr(one, name), getattr(other, name)) for name in ("platform_size", "platform_anchors")):
            step = "Measure them robot by robot, or give the platform's form: platform=Box(...)."
            raise InvalidValueError("platform_size", "not the same for all robots", "one platform", step)
    if one.platform_size is None:
        return None
    low, high = one.platform_anchors.min(axis=0), one.platform_anchors.max(axis=0)
    return Box(one.platform_size, 0.5 * (low + high), name="platform")


def _alike(one: Array | None, other: Array | None) -> bool:
    return one is other is None or (one is not None and other is not None and np.array_equal(one, other))
