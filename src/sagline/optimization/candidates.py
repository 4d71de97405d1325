"""Candidates of a design search, as points of the unit cube, as values of design variables, and as robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import field, frozen

from sagline.core.arguments import brief, choice, whole_number
from sagline.core.arrays import Array, Flags, Indices, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import check_fields, checked_by, reduced
from sagline.kernels import tables
from sagline.optimization.free import Bound, DesignVariable, Free, FreeCable
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import cable_table

MOST_SAMPLES = 1000
COINCIDENT = 1e-9  # largest distance [m] between the frame ends, and between the platform ends, of coincident cables


class Candidates:
    """Set of candidates: all robots that differ from the initial robot only in the design variables."""

    def __init__(self, robot: Robot, free: Sequence[Free], item: str = "free") -> None:
        """Prepare candidates for an initial robot and its design variables; item: name of the variables in messages."""
        self.robot = robot
        self.free = free_parts(free, item)
        self._bound: list[Bound] = [one.bound(robot, f"{item}[{k}]") for k, one in enumerate(self.free)]
        self.parts: tuple[DesignVariable, ...] = tuple(part for parts, _ in self._bound for part in parts)
        names = [part.name for part in self.parts]
        for name in names:
            if names.count(name) > 1:
                raise InvalidValueError(item, f"twice among {name}", "each part once", "Omit one of them.")
        self._table = cable_table(robot)[0]
        self._low = np.array([part.low for part in self.parts])
        self._high = np.array([part.high for part in self.parts])
        self._choices = np.array([part.choices for part in self.parts])

    @property
    def start(self) -> Array:
        """Values (d,) of the design variables in the initial robot."""
        return np.array([part.start for part in self.parts])

    def units(self, values: Array) -> Array:
        """Convert design variables (N, d) to points of the unit cube; a choice becomes the center of an interval."""
        span = np.where(self._choices > 0, self._choices, self._high - self._low)
        return np.asarray((values - self._low + 0.5 * (self._choices > 0)) / span)

    def values(self, points: Array) -> Array:
        """Convert points of the unit cube (N, d) to design variables (N, d)."""
        inside = np.minimum(self._low + points * (self._high - self._low), self._high)
        chosen = np.minimum(np.floor(points * self._choices), self._choices - 1)
        return np.asarray(np.where(self._choices > 0, chosen, inside))

    def cables(self, values: Array) -> Array:
        """Cable tables (N, m, CABLE_COLUMNS) of candidates with the design variables `values` (N, d)."""
        found = np.repeat(self._table[None], len(values), axis=0)
        self.write(found, values)
        return found

    def write(self, cables: Array, values: Array) -> None:
        """Change the cable tables `cables` (N, m, CABLE_COLUMNS) in place to the design variables `values` (N, d)."""
        first = 0
        for parts, write in self._bound:
            write(cables, values[:, first : first + len(parts)])
            first += len(parts)

    def costs(self, values: Array) -> Array | None:
        """Cost (N,) per meter of cable; None without a `FreeCable`. Raises an error if the catalogue has no costs."""
        for k, one in enumerate(self.free):
            if isinstance(one, FreeCable):
                missing = [entry.name for entry in one.catalogue if entry.cost is None]
                if missing:
                    step = "Give the cost of a meter, because the goal cable_cost needs it."
                    raise InvalidValueError(f"free[{k}]: {missing[0]}", "without cost", "a number >= 0", step)
                which = values[:, self._column(k)].astype(np.int64)
                return np.array([entry.cost for entry in one.catalogue], dtype=np.float64)[which]
        return None

    def robots(self, values: Array, names: Sequence[str]) -> tuple[Robot, ...]:
        """Robots with the design variables `values` (N, d) and the names `names`; the constructor checks the robots."""
        return tuple(
            self._robot(table, own, name) for table, own, name in zip(self.cables(values), values, names, strict=True)
        )

    def _robot(self, table: Array, values: Array, name: str) -> Robot:
        columns = {
            "frame_anchors": table[:, tables.FRAME_X : tables.FRAME_Z + 1],
            "platform_anchors": table[:, tables.PLATFORM_X : tables.PLATFORM_Z + 1],
            "tension_min": table[:, tables.TENSION_MIN],
            "tension_max": table[:, tables.TENSION_MAX],
        }
        changed: dict[str, Any] = {
            key: value for key, value in columns.items() if not np.array_equal(value, getattr(self.robot, key))
        }
        for k, one in enumerate(self.free):
            if isinstance(one, FreeCable):
                chosen = one.catalogue[int(values[self._column(k)])]
                if not np.array_equal(self.robot.cables.linear_density, table[:, tables.DENSITY]) or not np.array_equal(
                    self.robot.cables.axial_stiffness, table[:, tables.STIFFNESS]
                ):
                    changed["cables"] = chosen.cable
        assumed = {key: why for key, why in self.robot.assumed.items() if key not in changed}
        origin = f"found by sagline from {self.robot.name}"
        notes = f"{self.robot.notes}; {origin}" if self.robot.notes else origin
        return self.robot.replace(**changed, name=name, assumed=assumed, notes=notes)

    def _column(self, which: int) -> int:
        return sum(len(parts) for parts, _ in self._bound[:which])


def free_parts(free: object, item: str) -> tuple[Free, ...]:
    """Checked tuple of design variables; item: name of the variables in messages."""
    given = [free] if isinstance(free, Free) else free
    step = 'Give [FreeAnchors("frame", low, high), ...].'
    allowed = "a sequence of FreeAnchors, FreeCable and FreeLimit"
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise InvalidValueError(item, brief(free), allowed, step)
    for k, one in enumerate(given):
        if not isinstance(one, Free):
            raise InvalidValueError(f"{item}[{k}]", brief(one), allowed, step)
    return tuple(given)


def impossible(cables: Array) -> Flags:
    """True for each table of `cables` (N, m, CABLE_COLUMNS) with coincident cables or contradictory tension limits."""
    ends = cables[..., : tables.PLATFORM_Z + 1]
    first, second = np.triu_indices(cables.shape[1], 1)
    apart = np.abs(ends[:, first] - ends[:, second]).max(axis=-1, initial=0.0)
    crossed = cables[..., tables.TENSION_MIN] > cables[..., tables.TENSION_MAX]
    return np.asarray((apart < COINCIDENT).any(axis=-1) | crossed.any(axis=-1))


class PlatformBox:
    """Box around the platform at G poses, in which frame anchors are not allowed."""

    def __init__(self, robot: Robot, poses: Pose) -> None:
        """Store the size of the platform. If the size is not given, the box contains all platform anchors."""
        low, high = robot.platform_anchors.min(axis=0), robot.platform_anchors.max(axis=0)
        self._half = 0.5 * ((high - low) if robot.platform_size is None else robot.platform_size)
        self._middle = 0.5 * (low + high)
        self._position, self._matrix = poses.position, poses.matrix
        self._reach = float(np.linalg.norm(np.abs(self._middle) + self._half))

    def holds(self, points: Array) -> Indices:
        """Index (...) of the first pose at which a point (..., 3) [m] is inside the platform; -1 if none is."""
        flat = points.reshape(-1, 3)
        found = np.full(len(flat), -1)
        low, high = self._position.min(axis=0) - self._reach, self._position.max(axis=0) + self._reach
        for k in np.flatnonzero(((flat > low) & (flat < high)).all(axis=1)):
            away = np.einsum("gi,gij->gj", flat[k] - self._position, self._matrix) - self._middle
            inside = np.flatnonzero((np.abs(away) < self._half).all(axis=1))
            found[k] = inside[0] if inside.size else -1
        return found.reshape(points.shape[:-1])

    def holds_at(self, points: Array, poses: Pose) -> Flags:
        """True (N,) for each pose at which any of the points (N, m, 3) [m] of this pose is inside the platform."""
        found = np.zeros(len(points), dtype=np.bool_)
        away = points - poses.position[:, None]
        near = np.flatnonzero((np.abs(away) < self._reach).all(axis=-1).any(axis=-1))
        if near.size:
            turned = np.einsum("nki,nij->nkj", away[near], poses[near].matrix) - self._middle
            found[near] = (np.abs(turned) < self._half).all(axis=-1).any(axis=-1)
        return found


@frozen(weakref_slot=False)
class AnchorErrors:
    """Normally distributed errors of all anchor coordinates. All candidates have the same random errors.

    Attributes:
        deviation: Standard deviation of each coordinate [m], > 0.
        samples: Number of robots with random errors that represent each candidate, 1 to 1000.
        take: Value of a candidate: "worst" for the worst value of its samples, "mean" for their mean value.
        seed: Seed of the random errors, a whole number >= 0.

    Raises:
        InvalidValueError: If an argument has a wrong type, or is out of range.

    Examples:
        >>> import sagline as sl
        >>> print(sl.AnchorErrors(0.01, samples=4).take)
        worst
    """

    deviation: float = field(metadata=checked_by(number, "m", above=0.0))
    samples: int = field(default=8, kw_only=True, metadata=checked_by(whole_number, 1, MOST_SAMPLES))
    take: str = field(default="worst", kw_only=True, metadata=checked_by(choice, ("worst", "mean")))
    seed: int = field(default=0, kw_only=True, metadata=checked_by(whole_number, 0))

    __attrs_post_init__ = check_fields
    __reduce__ = reduced

    def added(self, cables: Array) -> Array:
        """Add the sample of anchor errors to cable tables.

        Args:
            cables: Cable tables of candidates, shape (N, m, CABLE_COLUMNS).

        Returns:
            Cable tables with errors, shape (N, samples, m, CABLE_COLUMNS).
        """
        many = np.repeat(cables[:, None], self.samples, axis=1)
        ends = tables.PLATFORM_Z + 1  # the first columns are coordinates of both ends
        errors = np.random.default_rng(self.seed).standard_normal((self.samples, cables.shape[1], ends))
        many[..., :ends] += self.deviation * errors
        return many
