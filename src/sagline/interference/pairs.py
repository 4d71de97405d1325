"""Bodies as rows of numbers for the kernels (`kernels.interference.shapes`), and the pairs to measure; meshes.

Distances from meshes are computed with python-fcl. Distances of cables follow by branch and bound over cable pieces.
fcl computes the distance between triangles, and between triangles and a segment, with full precision. The bulge of a
cable piece is an upper bound of the distance between the piece and its chord. A box is represented by twelve triangles
and a sphere by a segment of zero length, because the boxes and capsules of fcl are accurate only to 1e-7.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import combinations, product
from math import inf, sqrt
from types import ModuleType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, locked
from sagline.core.errors import SaglineError
from sagline.interference.obstacles import Box, Capsule, Mesh, Sphere
from sagline.kernels.codes import CATENARY
from sagline.kernels.interference import shapes
from sagline.kernels.interference.catenary_distance import BEGIN, BULGE, END, PIECE_COLUMNS, cut_piece
from sagline.robot.batch import Robots, robot_fields
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose


class _CablePart(NamedTuple):
    """Measured part of a cable: the whole cable, or the cable without a length at one end or at both ends."""

    cable: int
    off_frame: bool = False
    off_platform: bool = False


def cable_rows(state: Equilibrium, radius: Array) -> Array:
    """Rows of the cables from their exit points on, NaN for a cable without tension. `radius`: (m,) or (N, m) [m]."""
    cables, ends = state.cables, _platform_ends(state)
    exits = state.exit_point
    out = np.zeros((*cables.shape, shapes.COLUMNS))
    out[..., shapes.PLACE : shapes.PLACE + 3] = exits
    out[..., shapes.RADIUS] = radius
    out[..., shapes.LAST] = 1.0
    run = (ends - exits)[..., :2]
    level = np.hypot(run[..., 0], run[..., 1])[..., None]
    upright = level == 0.0
    out[..., shapes.LEVEL : shapes.LEVEL + 2] = np.where(upright, (1.0, 0.0), run / np.where(upright, 1.0, level))
    weight = cables.cable.linear_density * cables.gravity
    hanging = np.broadcast_to((weight > 0.0) & (cables.model.code == CATENARY), cables.shape)
    values = (cables.horizontal_tension, cables.vertical_force, cables.unstrained_length)
    drop = np.zeros(()) if hanging.all() else 4.0 * cables.sag
    shallow = (cables.span, cables.rise, drop)
    for column, value, other in zip((shapes.HORIZONTAL, shapes.VERTICAL, shapes.LENGTH), values, shallow, strict=True):
        out[..., column] = np.where(hanging, value, other)
    out[..., shapes.KIND] = np.where(hanging, shapes.HANGING, shapes.PARABOLA)
    out[..., shapes.WEIGHT] = weight
    out[..., shapes.STIFFNESS] = cables.cable.axial_stiffness
    out[np.isnan(cables.unstrained_length)] = np.nan
    return out


def _platform_ends(state: Equilibrium) -> Array:
    """Platform ends of the cables in the world [m], shape (m, 3) or (N, m, 3)."""
    (anchors,) = robot_fields(state.robot, "platform_anchors")
    if anchors.ndim == 2:
        return state.pose.transform(anchors)
    turned = np.einsum("nij,nmj->nmi", state.pose.matrix, anchors)
    return np.asarray(turned + state.pose.position[:, None])


def rows_of_parts(cables: Array, lengths: Array, parts: tuple[_CablePart, ...], left_out: float) -> Array:
    """Rows (N, len(parts), COLUMNS) of `parts` of the cables. `left_out`: unstrained length omitted at an end [m]."""
    out = cables[:, [part.cable for part in parts]]
    for k, part in enumerate(parts):
        share = np.minimum(left_out / lengths[:, part.cable], 0.5 if part.off_frame and part.off_platform else 1.0)
        if part.off_frame:
            out[:, k, shapes.FIRST] = share
        if part.off_platform:
            out[:, k, shapes.LAST] = 1.0 - share
    return out


def rod_row(rod: Capsule | Sphere) -> Array:
    """Row of the capsule or sphere `rod`, shape (COLUMNS,)."""
    start, end = (rod.start, rod.end) if isinstance(rod, Capsule) else (rod.center, rod.center)
    out = np.zeros(shapes.COLUMNS)
    run = end - start
    span = float(np.hypot(run[0], run[1]))
    out[shapes.KIND], out[shapes.RADIUS], out[shapes.LAST] = shapes.PARABOLA, rod.radius, 1.0
    out[shapes.PLACE : shapes.PLACE + 3] = start
    out[shapes.LEVEL : shapes.LEVEL + 2] = run[:2] / span if span > 0.0 else (1.0, 0.0)
    out[shapes.SPAN], out[shapes.RISE] = span, run[2]
    return out


def box_rows(box: Box, pose: Pose | None = None) -> Array:
    """Row of a box at rest, (COLUMNS,), or rows of a box that moves with N poses, (N, COLUMNS)."""
    shape = () if pose is None else pose.shape
    out = np.zeros((*shape, shapes.COLUMNS))
    turn = box.orientation if pose is None else pose.matrix @ box.orientation
    out[..., shapes.KIND] = shapes.BOX
    out[..., shapes.PLACE : shapes.PLACE + 3] = box.center if pose is None else pose.transform(box.center)
    out[..., shapes.AXES : shapes.AXES + 9] = turn.reshape(*shape, 9)
    out[..., shapes.HALF : shapes.HALF + 3] = 0.5 * box.size
    return out


Obstacle = Box | Capsule | Sphere | Mesh

PLATFORM: Final = "platform"
_SAME = 1e-9  # anchors count as one anchor if their distance, relative to the robot's extent, is smaller
_NO_LENGTH = "cables and platform: give from_anchor, the length of cable at the anchor that is not measured"


Body = _CablePart | int  # part of a cable, -1 for the platform, or number of an obstacle


class Pairs:
    """Pairs of numbered bodies: first all parts of cables, then the platform (even without shape), then obstacles."""

    def __init__(
        self, robot: Robots, obstacles: tuple[Obstacle, ...], platform: Box | Mesh | None, *, from_anchor: bool
    ) -> None:
        """Pair all bodies of a robot and obstacles. Without `from_anchor`, omit pairs with a common anchor."""
        at_frame, at_platform = (
            _together(anchors) for anchors in robot_fields(robot, "frame_anchors", "platform_anchors")
        )
        cables = range(len(at_frame))
        found: list[tuple[Body, Body]] = []  # part of a cable, -1 for the platform, or number of an obstacle
        left_out: list[str] = []
        for i, j in combinations(cables, 2):
            shared = bool(at_frame[i, j]), bool(at_platform[i, j])
            if all(shared) or (any(shared) and not from_anchor):
                where = " and ".join(name for name, there in zip(("frame", PLATFORM), shared, strict=True) if there)
                left_out.append(f"cable {i} and cable {j}: they share their anchor on the {where}")
            else:
                found.append((_CablePart(i, *shared), _CablePart(j, *shared)))
        found += [(_CablePart(i, off_frame=from_anchor), k) for k in range(len(obstacles)) for i in cables]
        if platform is not None:
            found += [(-1, k) for k in range(len(obstacles))]
            found += [(_CablePart(i, off_platform=True), -1) for i in cables if from_anchor]
            left_out += [] if from_anchor else [_NO_LENGTH]
        parts = tuple(dict.fromkeys(one for pair in found for one in pair if isinstance(one, _CablePart)))
        forms = (platform, *obstacles)
        own = _names(obstacles)

        def number(one: Body) -> int:
            return parts.index(one) if isinstance(one, _CablePart) else len(parts) + 1 + one

        def name(one: Body) -> str:
            return f"cable {one.cable}" if isinstance(one, _CablePart) else PLATFORM if one < 0 else own[one]

        def form(one: Body) -> object:
            return one if isinstance(one, _CablePart) else forms[1 + one]

        def in_order(pair: tuple[Body, Body]) -> tuple[Body, Body]:
            boxes = [isinstance(form(one), Box) for one in pair]
            return pair[::-1] if boxes == [True, False] else pair  # in kernels, a box is the second body of a pair

        other = [pair for pair in found if any(isinstance(form(one), Mesh) for one in pair)]
        plain = [in_order(pair) for pair in found if pair not in other]
        numbers = (np.array([[number(a), number(b)] for a, b in some], dtype=np.int64) for some in (plain, other))
        # by_kernel: numbers of the pairs that kernels measure, shape (P, 2)
        # with_mesh: numbers of the pairs with at least one mesh, shape (Q, 2)
        self.by_kernel, self.with_mesh = (locked(array.reshape(-1, 2)) for array in numbers)
        # names of all pairs, in the order of their numbers
        self.names = tuple((name(a), name(b)) for a, b in plain + other)
        # parts: parts of cables that occur in pairs
        # left_out: pairs that are not measured, with the reasons
        self.parts, self.left_out = parts, tuple(left_out)


def _together(anchors: Array) -> NDArray[np.bool_]:
    """Mask (m, m) of the pairs of cables that have a common anchor in any robot of a batch."""
    apart = np.linalg.norm(anchors[..., :, None, :] - anchors[..., None, :, :], axis=-1)
    same: NDArray[np.bool_] = (apart <= _SAME * max(1.0, float(np.abs(anchors).max()))).reshape(-1, *apart.shape[-2:])
    return np.asarray(same.any(axis=0))


def _names(obstacles: tuple[Obstacle, ...]) -> list[str]:
    """Names of the obstacles; a repeated name gets a number."""
    names: list[str] = []
    for one in obstacles:
        again = sum(other.name == one.name for other in obstacles[: len(names)])
        names.append(one.name if not again else f"{one.name} {again + 1}")
    return names


MISSING: Final = 'Meshes need python-fcl, which is not installed. Run: pip install "sagline[workspace]"'
ROUNDING: Final = 1e-12  # rounding error, relative to the coordinates, that is subtracted from a lower bound
_PIECES: Final = 4000  # largest number of examined cable pieces per distance
_SEARCHES: Final = 60  # sufficient number of iterations for the nearest point of a cable with full precision
# corners of a box as signs of its half edges, and its triangles as indices of corners
_SIGNS: Final = np.array(list(product((-0.5, 0.5), repeat=3)))
_FACES: Final = np.reshape([int(n) for n in "013032467475045051237276026064157173"], (12, 3))


class _Solid:
    """A body for fcl."""

    def __init__(self, fcl: ModuleType, form: Obstacle | None) -> None:
        # radius: radius of a rod or ball, which is subtracted from distances [m]
        # mesh: triangles of the body; None for rods and balls
        # place: rotation and position of a body at rest
        self.radius, self.mesh, self.place = 0.0, None, (np.eye(3), np.zeros(3))
        if isinstance(form, Box):
            form = Mesh(_SIGNS * form.size @ form.orientation.T + form.center, _FACES, form.name)
        if isinstance(form, Mesh):
            self.geometry, self.mesh, self.inner = fcl.BVHModel(), form, form.vertices[form.faces[0, 0]]
            self.geometry.beginModel(len(form.vertices), len(form.faces))
            self.geometry.addSubModel(np.array(form.vertices), np.array(form.faces))
            self.geometry.endModel()
            return
        assert isinstance(form, Capsule | Sphere)
        ends = (form.start, form.end) if isinstance(form, Capsule) else (form.center, form.center)
        # inner: point inside the body [m]
        self.radius, self.inner = form.radius, ends[0]
        self.place, length = _along(*ends)
        self.geometry = fcl.Capsule(0.0, length)


_Nearest = tuple[float, float, Array, Array]
"""Distance [m], its proved lower bound, and the nearest points."""


class Meshed:
    """Pairs of bodies with at least one mesh. The bodies are prepared only once."""

    def __init__(self, pairs: Pairs, forms: tuple[Obstacle | None, ...], precision: float) -> None:
        """Prepare the bodies `forms`: the platform, or None, then the obstacles in the order of their indices."""
        self._fcl = package()
        self._pairs, self._precision, self._parts = pairs, precision, len(pairs.parts)
        taking_part = {int(number) for number in pairs.with_mesh.ravel() if number >= self._parts}
        self._solids = {number: _Solid(self._fcl, forms[number - self._parts]) for number in sorted(taking_part)}
        self._known: dict[tuple[int, bytes], bool] = {}

    def measure(self, pose: Pose, moving: Array, least: Array | None, out: tuple[Array, Array, Array]) -> None:
        """Fill the distances of all pairs at every pose. Pairs farther apart than `least` (N,) [m] may be skipped."""
        turns, places = pose.matrix.reshape(-1, 3, 3), np.atleast_2d(pose.position)
        value, low, nearest = out
        for n in range(len(moving)):
            enough = inf if least is None else float(least[n])
            for q, (i, j) in enumerate(self._pairs.with_mesh.tolist()):
                if np.isnan(moving[n]).any():
                    value[n, q] = low[n, q] = nearest[n, q] = np.nan
                    continue
                at = {self._parts: (turns[n], places[n])}
                row = moving[n, i] if i < self._parts else None
                found = self._of_cable(row, j, at, enough) if row is not None else self._of_solids(i, j, at)
                value[n, q], low[n, q] = found[:2]
                nearest[n, q] = found[2:]
                if least is not None:
                    enough = min(enough, found[0])

    def _object(self, number: int, at: dict[int, tuple[Array, Array]]) -> Any:
        solid = self._solids[number]
        return self._fcl.CollisionObject(solid.geometry, self._fcl.Transform(*at.get(number, solid.place)))

    def _apart(self, one: Any, other: Any) -> tuple[float, Array, Array]:
        """Distance of two bodies [m], 0 for contact, and their nearest points, first the point on a mesh."""
        request, result = self._fcl.DistanceRequest(True), self._fcl.DistanceResult()
        distance = max(float(self._fcl.distance(one, other, request, result)), 0.0)
        return distance, *result.nearest_points

    def _of_solids(self, i: int, j: int, at: dict[int, tuple[Array, Array]]) -> _Nearest:
        one, other = self._solids[i], self._solids[j]
        distance, a, b = self._apart(self._object(i, at), self._object(j, at))
        if distance > 0.0 and (self._within(one.inner, i, j, at) or self._within(other.inner, j, i, at)):
            distance = 0.0
        radii = one.radius + other.radius
        return (distance - radii, _proved(distance, distance, a) - radii, a, b)

    def _within(self, point: Array, of: int, number: int, at: dict[int, tuple[Array, Array]]) -> bool:
        """True if `point` of the body `of`, in the frame of that body, is inside the solid body `number`."""
        mesh = self._solids[number].mesh
        if mesh is None:
            return False
        if of in at:
            point = at[of][0] @ point + at[of][1]
        if number in at:
            point = at[number][0].T @ (point - at[number][1])
        key = number, point.tobytes()  # the frame end of a cable does not move
        if key not in self._known:
            if len(self._known) > 1000:
                self._known.clear()
            self._known[key] = bool(mesh.encloses(point))
        return self._known[key]

    def _of_cable(self, row: Array, number: int, at: dict[int, tuple[Array, Array]], enough: float) -> _Nearest:
        """Distance of a cable from the body `number`, by branch and bound over the pieces of the cable."""
        body, radius = self._object(number, at), float(row[shapes.RADIUS])
        enough += radius
        nearest = (inf, 0.0, np.zeros(3), np.zeros(3))  # points along the centerline of the cable
        waiting: list[tuple[float, int, float, float, float]] = []
        proved, looked = inf, 0

        def at_share(share: float) -> tuple[float, float, Array, Array]:
            point = _pieces(row, [(share, share)])[0, :3]
            ball = self._fcl.CollisionObject(self._fcl.Capsule(0.0, 0.0), self._fcl.Transform(point))
            distance, on_mesh, _ = self._apart(body, ball)
            return distance, share, point, on_mesh

        def look_at(ranges: list[tuple[float, float]]) -> None:
            nonlocal nearest, looked
            for piece in _pieces(row, ranges):
                looked += 1
                place, length = _along(piece[:3], piece[3:6])
                chord = self._fcl.CollisionObject(self._fcl.Capsule(0.0, length), self._fcl.Transform(*place))
                distance, _, on_chord = self._apart(body, chord)
                begin, end, bulge = float(piece[BEGIN]), float(piece[END]), float(piece[BULGE])
                if distance < nearest[0]:
                    along = np.dot(on_chord - piece[:3], piece[3:6] - piece[:3]) / max(length * length, 1e-300)
                    if distance == 0.0:
                        along = 0.5
                    share = begin + min(max(float(along), 0.0), 1.0) * (end - begin)
                    nearest = min(nearest, at_share(share), key=lambda found: found[0])
                heapq.heappush(waiting, (distance - bulge, looked, begin, end, bulge))

        look_at([(float(row[shapes.FIRST]), float(row[shapes.LAST]))])
        if self._within(_pieces(row, [(nearest[1], nearest[1])])[0, :3].copy(), -1, number, at):
            return (-radius, -radius, nearest[2], nearest[2])
        while waiting:
            low, _, begin, end, bulge = heapq.heappop(waiting)
            if low >= min(nearest[0], enough) - self._precision or bulge == 0.0 or looked > _PIECES:
                proved = low
                break
            middle = 0.5 * (begin + end)
            look_at([(begin, middle), (middle, end)])
        if nearest[0] < enough + self._precision:
            nearest = _polished(at_share, nearest, row)
        return (nearest[0] - radius, _proved(proved, nearest[0], nearest[2]) - radius, nearest[2], nearest[3])


def package() -> ModuleType:
    """Module python-fcl, loaded at the first use. Without the module, the error names the command that installs it."""
    try:
        import fcl
    except ImportError:
        raise SaglineError(MISSING) from None
    found: ModuleType = fcl
    return found


def _pieces(row: Array, ranges: list[tuple[float, float]]) -> Array:
    out = np.empty((len(ranges), PIECE_COLUMNS))
    cut_piece(locked(row.view()), locked(np.array(ranges)), out)
    return out


def _along(start: Array, end: Array) -> tuple[tuple[Array, Array], float]:
    """Placement of an fcl capsule (along z around its middle) from `start` to `end`, and the length of the capsule."""
    run = end - start
    length = sqrt(float(run @ run))
    x, y, z = (run / length).tolist() if length > 0.0 else (0.0, 0.0, 1.0)
    half = np.array([1.0 + z, -y, x, 0.0]) if z > -1.0 + 1e-12 else np.array([0.0, 1.0, 0.0, 0.0])
    return (half / sqrt(float(half @ half)), 0.5 * (start + end)), length


def _proved(low: float, value: float, place: Array) -> float:
    """The lower bound `low`, reduced by the possible rounding error, >= 0."""
    return max(min(low, value) - ROUNDING * (1.0 + value + float(np.abs(place).max())), 0.0)


def _polished(
    at_share: Callable[[float], tuple[float, float, Array, Array]],
    nearest: tuple[float, float, Array, Array],
    row: Array,
) -> tuple[float, float, Array, Array]:
    """Nearest point of a cable by Brent's method (golden sections and parabolas), which starts at `nearest`."""
    from scipy.optimize import minimize_scalar

    reach = 0.02 * float(row[shapes.LAST] - row[shapes.FIRST])
    for _ in range(3):
        limits = max(nearest[1] - reach, float(row[shapes.FIRST])), min(nearest[1] + reach, float(row[shapes.LAST]))
        if nearest[0] == 0.0 or limits[0] >= limits[1]:
            break
        options = {"xatol": 1e-9 * (limits[1] - limits[0]), "maxiter": _SEARCHES}
        best = minimize_scalar(lambda share: at_share(share)[0], bounds=limits, method="bounded", options=options)
        found = min((at_share(float(share)) for share in (best.x, *limits)), key=lambda one: one[0])
        nearest = min(nearest, found, key=lambda one: one[0])
        if nearest[1] not in limits:
            break
    return nearest
