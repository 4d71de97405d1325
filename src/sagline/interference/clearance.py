"""Least distances between cables, platform and obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, check_memory, instance
from sagline.core.arrays import Array, Indices, blocks, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.interference.obstacles import Box, Capsule, Mesh, Sphere, extent_text
from sagline.interference.pairs import Obstacle, Pairs, box_rows, cable_rows, rod_row, rows_of_parts
from sagline.kernels.interference import shapes
from sagline.kernels.interference.catenary_distance import least_distances, work_arrays_for_pieces
from sagline.robot.batch import Robots, first_of
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds
from sagline.robot.robot import Robot

BLOCK = 1024  # poses per block


class ClearanceRows:
    """Measurement of distances at batches of poses. Data that do not depend on the pose are prepared only once.

    Attributes:
        pairs: Names and indices of the measured pairs, and the omitted pairs.
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
        """Prepare the measurement with the checked arguments of `clearance`."""
        self._precision = precision
        self._radius = cable_radius
        self._from_anchor = 0.0 if from_anchor is None else from_anchor
        self._platform = _platform_of(robot) if platform is None else platform
        self.pairs = Pairs(robot, obstacles, self._platform, from_anchor=from_anchor is not None)
        still = [rod_row(one) if isinstance(one, Capsule | Sphere) else _box_row(one) for one in obstacles]
        self._still = locked(np.array(still).reshape(-1, shapes.COLUMNS))
        self._meshed = None
        if len(self.pairs.with_mesh):
            from sagline.interference.pairs import Meshed  # this class needs python-fcl

            self._meshed = Meshed(self.pairs, (self._platform, *obstacles), precision)

    def distances(self, state: Equilibrium, *, together: bool = False) -> tuple[Array, Array, Array]:
        """Distances of every pair at every pose. If `together`, only the smallest distance of each pose is exact."""
        # value [m] (N, P), proved lower bound [m] (N, P), nearest points [m] (N, P, 2, 3); NaN without tensions
        single = not state.pose.shape
        count, several = 1 if single else len(state), len(self.pairs.names)
        out = np.empty((count, several)), np.empty((count, several)), np.empty((count, several, 2, 3))
        known, memory = len(self.pairs.by_kernel), work_arrays_for_pieces()  # new for each thread
        for part in blocks(count, BLOCK):
            own = state if single else state[part]
            moving = self._moving(own)
            some = tuple(np.empty((len(moving), known, *rest)) for rest in ((), (), (2, 3)))
            least_distances(moving, self._still, self.pairs.by_kernel, self._precision, together, *memory, *some)
            for whole, piece in zip(out, some, strict=True):
                whole[part, :known] = piece
            if self._meshed is not None:
                value, low, nearest = (whole[part, known:] for whole in out)
                least = out[0][part, :known].min(axis=1, initial=np.inf)
                self._meshed.measure(own.pose, moving, least if together else None, (value, low, nearest))
            lost = np.isnan(np.atleast_2d(own.free_length)).any(axis=1)
            for whole in out:
                whole[part][lost] = np.nan
        return out

    def least(self, state: Equilibrium) -> tuple[Array, Indices]:
        """Smallest distance (N,) [m], NaN without tensions, and the index of its pair. Faster than `distances`."""
        lost = np.asarray(np.isnan(np.atleast_2d(state.free_length)).any(axis=1))
        found = np.nan_to_num(self.distances(state, together=True)[0], nan=np.inf)
        if not found.shape[1]:
            return np.where(lost, np.nan, np.inf), np.full(len(lost), -1)
        pair = np.where(lost, -1, found.argmin(axis=1))
        return np.where(lost, np.nan, found.min(axis=1)), pair

    def of_platform(self, pose: Pose, half: Array) -> Array:
        """Upper bound (N,) [m] of the platform's distance from obstacles for all positions in a box around `pose`."""
        # half: half edges of the box, (3,) [m]. The platform is replaced by a box that is smaller by `half`. At each
        # position, the smaller box is inside the platform. Meshes are omitted.
        first = len(self.pairs.parts)
        pairs = self.pairs.by_kernel
        pairs = pairs[(pairs >= first).all(axis=1) & (pairs == first).any(axis=1)] - first
        if not isinstance(self._platform, Box) or not len(pairs):
            return np.full(len(pose), np.inf)
        moving = np.ascontiguousarray(box_rows(self._platform, pose).reshape(-1, 1, shapes.COLUMNS))
        edges = moving[:, 0, shapes.HALF : shapes.HALF + 3]
        away = half @ np.abs(moving[:, 0, shapes.AXES : shapes.AXES + 9].reshape(-1, 3, 3))
        beyond = np.linalg.norm(np.maximum(away - edges, 0.0), axis=1)
        edges[:] = np.maximum(edges - away, 0.0)
        out = tuple(np.empty((len(pose), len(pairs), *rest)) for rest in ((), (), (2, 3)))
        least_distances(locked(moving), self._still, pairs, self._precision, False, *work_arrays_for_pieces(), *out)
        return np.asarray(out[0].min(axis=1) + beyond)

    def _moving(self, state: Equilibrium) -> Array:
        """Rows of the moving bodies: cable parts and platform. No platform, or a mesh, is replaced by a placeholder."""
        diameter = state.cables.cable.diameter
        known = np.zeros(1) if diameter is None else 0.5 * diameter
        cables = cable_rows(state, known if self._radius is None else self._radius)
        lengths = np.atleast_2d(state.free_length)
        parts = rows_of_parts(cables.reshape(*lengths.shape, -1), lengths, self.pairs.parts, self._from_anchor)
        box = self._platform if isinstance(self._platform, Box) else Box(np.ones(3))
        rows = np.concatenate((parts, box_rows(box, state.pose).reshape(-1, 1, shapes.COLUMNS)), axis=1)
        return locked(np.ascontiguousarray(rows))  # a read-only array would cause a second compilation of the kernel


def _box_row(one: Box | Mesh) -> Array:
    """Row of the obstacle `one`. A mesh gets a placeholder row, so that the indices of the obstacles do not change."""
    return box_rows(one if isinstance(one, Box) else Box(np.ones(3)))


def _platform_of(robot: Robots) -> Box | None:
    """Box of the platform's size around its anchors; None if unknown. Robots with unequal platforms are refused."""
    one = first_of(robot)
    for other in () if isinstance(robot, Robot) else robot[1:]:
        own = "platform_size", "platform_anchors"
        if not all(np.array_equal(getattr(one, name), getattr(other, name)) for name in own):
            step = "Measure each robot separately, or give the form of the platform: platform=Box(...)."
            raise InvalidValueError("platform_size", "not the same for all robots", "one platform", step)
    if one.platform_size is None:
        return None
    low, high = one.platform_anchors.min(axis=0), one.platform_anchors.max(axis=0)
    return Box(one.platform_size, 0.5 * (low + high), name="platform")


NO_TENSIONS = "no tensions are known, so that the cables have no shape; use a feasible pose"
NOTHING = "nothing is measured"
_SHOWN = 8  # largest number of printed pairs per pose, and of printed lines about omitted pairs
# largest extent of a mesh, relative to the robot; the unit of a larger mesh is probably wrong
_TOO_LARGE = 100.0
_NUMBERS = 9  # number of values per pair and pose: distance, lower bound and two points


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Clearances(Result, Tabular):
    """Least distances between sagging cables, platform and obstacles, at one pose or N poses.

    Attributes:
        pairs: P pairs of names of measured bodies.
        pair_distance: Least distance of each pair [m], minus known cable radii, shape (P,) or (N, P). A value <= 0
            means contact. The depth of penetration is not measured. NaN if a pose has no tensions.
        pair_low: Proved lower bound of each distance [m], of the same shape.
        nearest: Nearest points of each pair, on the center lines of cables and rods [m], shape (P, 2, 3) or (N, P, 2,
            3).
        left_out: Pairs that were not measured, with the reasons.
        precision: Largest difference between distance and proved bound [m].
    """

    _columns: ClassVar[Columns] = ("distance", "low", "d#=pair_distance")

    pairs: tuple[tuple[str, str], ...]
    pair_distance: Array
    pair_low: Array
    nearest: Array
    left_out: tuple[str, ...]
    precision: float

    @property
    def distance(self) -> Array:
        """Smallest distance of all pairs [m], shape () or (N,); infinite if no pair was measured."""
        return self._least(self.pair_distance)

    @property
    def low(self) -> Array:
        """Proved lower bound of all distances [m], shape () or (N,)."""
        return self._least(self.pair_low)

    @property
    def between(self) -> Any:
        """Names of the nearest pair, at each of N poses. If no distance is known, a sentence."""
        return self._between(self.pair_distance) if self._single else tuple(map(self._between, self.pair_distance))

    def __str__(self) -> str:
        """Summary with the nearest pairs, in a few lines."""
        rows = np.atleast_2d(self.pair_distance)
        lost = int(np.isnan(rows).any(axis=1).sum())
        least = np.where(np.isnan(rows), np.inf, rows)
        at = int(np.argmin(least.min(axis=1, initial=np.inf))) if len(rows) else 0
        head = f"Clearance: {len(self.pairs)} pairs" + ("" if self._single else f", {len(rows)} poses")
        lines = [head]
        if lost:
            lines.append(f"  {NO_TENSIONS}" if self._single else f"  {lost} poses: {NO_TENSIONS}")
        if not self.pairs:
            lines.append(f"  {NOTHING}")
        elif lost < len(rows):
            lines += [] if self._single else [f"  least, at pose {at}:"]
            shown = np.argsort(least[at], kind="stable")[:_SHOWN]
            width = max(len(" - ".join(self.pairs[k])) for k in shown)
            lines += [f"  {' - '.join(self.pairs[k]):<{width}}  {1e3 * least[at, k]:10.1f} mm" for k in shown]
            rest = len(self.pairs) - len(shown)
            lines += [f"  and {rest} pairs farther apart"] if rest else []
        if self.left_out:
            lines.append("  left out:")
            lines += [f"    {line}" for line in self.left_out[:_SHOWN]]
            rest = len(self.left_out) - _SHOWN
            lines += [f"    and {rest} more"] if rest > 0 else []
        return "\n".join(lines)

    @property
    def _single(self) -> bool:
        return self.pair_distance.ndim == 1

    def _least(self, rows: Array) -> Array:
        return locked(np.asarray(rows.min(axis=-1, initial=np.inf)))

    def _between(self, row: Array) -> tuple[str, str] | str:
        if not len(row):
            return NOTHING
        return NO_TENSIONS if np.isnan(row).any() else self.pairs[int(row.argmin())]


@of_equilibrium
def clearance(
    state: Equilibrium,
    obstacles: Obstacle | Sequence[Obstacle] = (),
    *,
    precision: float = 1e-4,
    cable_radius: ArrayLike | None = None,
    platform: Box | Mesh | None = None,
    from_anchor: float | None = None,
) -> Clearances:
    """Least distances between sagging cables, platform and obstacles.

    Cables have the shape of their model, such as a catenary, and begin at the exit point of their pulley. The distances
    are accurate to about 1e-12 m (with meshes 1e-7 m). A proof shows that the true distance is smaller by at most
    `precision`.

    Args:
        state: An equilibrium, single or N of them; a plan or a solution; or a robot and its poses.
        obstacles: One or several obstacles: Box, Capsule, Sphere and Mesh. Obstacles are solid: a body inside an
            obstacle is in contact with it.
        precision: Largest difference between a distance and its proved bound [m], > 0.
        cable_radius: Radius of the cables [m], one for all or one per cable, >= 0. None: half the diameter of the
            robot's cables, or 0 if the diameter is unknown.
        platform: Shape of the platform in the platform frame. None: a box of the robot's platform_size around its
            anchors, if this size is known.
        from_anchor: Length of cable next to an anchor that the measurement ignores [m], > 0. The length applies to two
            cables with a common anchor, to cables and platform, and to obstacles near frame anchors. None: pairs of two
            cables with a common anchor, and pairs of a cable and the platform, are omitted and listed in `left_out`.

    Returns:
        Clearances.

    Raises:
        InvalidValueError: If an argument has the wrong type. If a mesh is 100 times larger than the robot.
        SaglineError: If an obstacle is a mesh and python-fcl is missing.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((1.0, 0.5, 1.5), np.eye(3)))
        >>> near = sl.clearance(plan.state, sl.Sphere([3, 2, 2], radius=0.2, name="lamp"))
        >>> print(f"{near.distance:.3f} m between {' and '.join(near.between)}")
        0.395 m between cable 2 and cable 3

    Source:
        docs/model.md, section 13.
    """
    robot = state.robot
    things = check_obstacles(obstacles, first_of(robot))
    some = None if from_anchor is None else number(from_anchor, "from_anchor", "m", above=0.0)
    radius = None if cable_radius is None else _radius(cable_radius, first_of(robot).cable_count)
    if isinstance(platform, Mesh):
        _check_size(platform, first_of(robot))
    elif platform is not None:
        instance(platform, Box, "platform")
    near = number(precision, "precision", "m", above=0.0)
    rows = ClearanceRows(robot, things, precision=near, cable_radius=radius, platform=platform, from_anchor=some)
    shape = state.pose.shape
    check_memory("clearances", 8.0 * _NUMBERS * prod(shape) * len(rows.pairs.names), "Split the poses into parts.")
    value, low, nearest = (locked(field.reshape(*shape, *field.shape[1:])) for field in rows.distances(state))
    return Clearances(rows.pairs.names, value, low, nearest, rows.pairs.left_out, near)


def check_obstacles(given: Any, robot: Robot) -> tuple[Obstacle, ...]:
    """Check the obstacles `given`, and return a tuple. A mesh that is 100 times larger than `robot` is refused."""
    found = obstacles_of(given, "obstacles")
    for one in found:
        if isinstance(one, Mesh):
            _check_size(one, robot)
    return found


def obstacles_of(given: Any, item: str) -> tuple[Obstacle, ...]:
    """Check `given`, one obstacle or several, and return a tuple."""
    some = (given,) if isinstance(given, Obstacle) else given
    several = isinstance(some, Sequence) and not isinstance(some, str)
    wrong = [one for one in some if not isinstance(one, Obstacle)] if several else [given]
    if wrong:
        step = 'Create them: Sphere(center, radius), Box(size, center), load_mesh("hall.stl").'
        raise InvalidValueError(item, brief(wrong[0]), "Box, Capsule, Sphere or Mesh, one or several", step)
    return tuple(some)


def _check_size(mesh: Mesh, robot: Robot) -> None:
    """Refuse `mesh` if it is much larger than `robot`, because its unit is then probably wrong."""
    own, size = np.ptp(mesh.bounds, axis=0).max(), np.subtract(*reversed(bounds(robot))).max()
    if own > _TOO_LARGE * size:
        value = f"{extent_text(mesh.bounds)} large, and the robot {size:.4g} m"
        step = 'If its file is in millimeters: load_mesh(file, unit="mm").'
        raise InvalidValueError(f"mesh {mesh.name}", value, f"up to {_TOO_LARGE:g} times the robot", step)


def _radius(given: ArrayLike, cables: int) -> Array:
    radius = checked(given, "cable_radius", "m", low=0.0)
    if radius.shape not in ((), (cables,)):
        step = "Give one value per cable, or one value for all cables."
        raise InvalidValueError("cable_radius", f"of shape {radius.shape}", f"shape () or ({cables},)", step)
    return radius
