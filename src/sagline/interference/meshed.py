"""Least distances from meshes, with python-fcl. Distances of cables follow by branch and bound over cable pieces.

fcl computes the distance between triangles, and between triangles and a segment, with full precision. The bulge of a
cable piece is an upper bound of the distance between the piece and its chord. A box is represented by twelve triangles
and a sphere by a segment of zero length, because the boxes and capsules of fcl are accurate only to 1e-7.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import product
from math import inf, sqrt
from types import ModuleType
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.errors import SaglineError
from sagline.interference.obstacles import Box, Capsule, Mesh, Sphere
from sagline.interference.pairs import Pairs
from sagline.kernels.interference import shapes
from sagline.kernels.interference.catenary_distance import BEGIN, BULGE, END, PIECE_COLUMNS, cut_piece
from sagline.robot.pose import Pose

Form = Box | Capsule | Sphere | Mesh
MISSING: Final = 'Meshes need python-fcl, which is not installed. Run: pip install "sagline[workspace]"'
ROUNDING: Final = 1e-12  # rounding error, relative to the coordinates, that is subtracted from a lower bound
_PIECES: Final = 4000  # largest number of examined cable pieces per distance
_SEARCHES: Final = 60  # sufficient number of iterations for the nearest point of a cable with full precision
# corners of a box as signs of its half edges, and its triangles as indices of corners
_SIGNS: Final = np.array(list(product((-0.5, 0.5), repeat=3)))
_FACES: Final = np.reshape([int(n) for n in "013032467475045051237276026064157173"], (12, 3))


class _Solid(NamedTuple):
    """A body for fcl."""

    geometry: Any  # geometry of the body
    radius: float  # radius of a rod or ball, which is subtracted from distances [m]
    mesh: Mesh | None  # triangles of the body; None for rods and balls
    inner: Array  # point inside the body [m]
    place: tuple[Array, Array]  # rotation and position of a body at rest


_Nearest = tuple[float, float, Array, Array]
"""Distance [m], its proved lower bound, and the nearest points."""


class Meshed:
    """Pairs of bodies with at least one mesh. The bodies are prepared only once."""

    def __init__(self, pairs: Pairs, forms: tuple[Form | None, ...], precision: float) -> None:
        """Prepare the bodies `forms`: the platform, or None, then the obstacles in the order of their indices."""
        self._fcl = package()
        self._pairs, self._precision, self._parts = pairs, precision, len(pairs.parts)
        taking_part = {int(number) for number in pairs.with_mesh.ravel() if number >= self._parts}
        self._solids = {number: self._solid(forms[number - self._parts]) for number in sorted(taking_part)}
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

    def _solid(self, form: Form | None) -> _Solid:
        still = np.eye(3), np.zeros(3)
        if isinstance(form, Box):
            form = Mesh(_SIGNS * form.size @ form.orientation.T + form.center, _FACES, form.name)
        if isinstance(form, Mesh):
            model = self._fcl.BVHModel()
            model.beginModel(len(form.vertices), len(form.faces))
            model.addSubModel(np.array(form.vertices), np.array(form.faces))
            model.endModel()
            return _Solid(model, 0.0, form, form.vertices[form.faces[0, 0]], still)
        if isinstance(form, Capsule):
            place, length = _along(form.start, form.end)
            return _Solid(self._fcl.Capsule(0.0, length), form.radius, None, form.start, place)
        assert isinstance(form, Sphere)
        return _Solid(self._fcl.Capsule(0.0, 0.0), form.radius, None, form.center, (np.eye(3), form.center))

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
