"""Shapes of a robot: cables as lines, its parts as solids."""

from __future__ import annotations

from itertools import combinations, product
from math import floor, log10
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableState
from sagline.core.arrays import Array, Indices, locked
from sagline.robot.batch import (
    cable_ends,
    dead_cable,
    on_platform,
    outward,
    points_on_pulleys,
    pulley_centers,
    pulley_radius,
)
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds as bounds
from sagline.robot.robot import Robot
from sagline.statics.tables import touching_angle

POINTS = 41  # points along a free cable; odd, so that both ends have a dash
WRAP_POINTS = 16  # points along the cable on a pulley
_UPRIGHT = 1e-6  # largest difference of a vertical dead length from its rise, relative to the length


def points_per_cable(robot: Robot) -> int:
    """Number of points of a cable, from the entry of its pulley to its other end."""
    return POINTS + WRAP_POINTS * bool(robot.winches is not None and robot.winches.pulley_radius.any())


def exits_of(state: Equilibrium | None) -> Array | None:
    """Exit points (m, 3) [m] that determine the planes of the pulleys; None if their axes determine these planes."""
    return None if state is None or state.contact is None or state.contact.azimuth is None else state.exit_point


def wraps(robot: Robot, pose: Pose, state: Equilibrium | None = None) -> Array:
    """Points of the cables from their entry points over pulleys to exit points [m], (m, WRAP_POINTS, 3)."""
    # in the equilibrium `state`, or for straight cables; shape (m, 1, 3), the entry points, if no cable has a pulley
    if robot.winches is None or not robot.winches.pulley_radius.any():
        return cable_ends(robot, pose).entry[:, None]
    contact = None if state is None else state.contact
    angle = np.nan_to_num(touching_angle(robot, pose)) if contact is None else contact.wrap_angle
    angles = np.linspace(0.0, 1.0, WRAP_POINTS)[:, None] * angle
    return np.swapaxes(points_on_pulleys(robot, pose, angles, exits_of(state)), 0, 1)


def chords(robot: Robot, pose: Pose, exits: Array | None = None) -> Array:
    """Both ends of every free cable in the world [m], shape (m, 2, 3): frame end, then platform end."""
    # `exits`: exit points of the pulleys, or None for cables from anchor to anchor
    entry, _, other = cable_ends(robot, pose)
    ends = np.stack((entry if exits is None else exits, other), axis=1)
    return locked(np.where(on_platform(robot)[:, None, None], ends[:, ::-1], ends))


def in_world(robot: Robot, pose: Pose, points: Array) -> Array:
    """World coordinates of `points` (m, P, 3) in the axes of the winches, which are at the frame or on the platform."""
    return np.where(on_platform(robot)[:, None, None], pose.transform(points), points)


def _winch_ends(robot: Robot) -> tuple[Array, Array]:
    """Entry points [m] and unit vectors along the dead lengths there, in the axes of the winches, (m, 3) each."""
    entry, axis, _ = cable_ends(robot, Pose(np.zeros(3), np.eye(3)))
    slanted = np.zeros(robot.cable_count, dtype=bool) if robot.winches is None else robot.winches.slanted
    return entry, np.where(slanted[:, None], axis, [0.0, 0.0, 1.0])  # the axis of an eyelet has no effect


def dead_runs(robot: Robot) -> tuple[Array, NDArray[np.bool_]]:
    """Dead lengths as lines along the swivel axes; below a vertical pulley at the frame only the rise is known."""
    # Returns entry points, and the other ends of the lines [m], in the axes of the winches, shape (m, 2, 3); and True
    # for each line that has the dead length and the rise, shape (m,). The paths of the others are not known.
    winches, (entry, along) = robot.winches, _winch_ends(robot)
    if winches is None:
        return np.stack((entry, entry), axis=1), np.ones(robot.cable_count, dtype=bool)
    length = np.where(winches.slanted, winches.dead_cable, winches.dead_rise)
    run, known = length[:, None] * along, winches.dead_cable - np.abs(length)
    known = known + np.where(winches.on_platform, 0.0, np.abs(run[:, 2] - winches.dead_rise))
    return np.stack((entry, entry - run), axis=1), known <= _UPRIGHT * winches.dead_cable


def drum_axes(robot: Robot) -> Array:
    """Ends of the axes of the drums with known radii [m], in the axes of the winches, shape (k, 2, 3)."""
    # A drum touches the end of its dead length, and its axis is horizontal. The drum is on the side away from the
    # middle of the anchors if the dead length is vertical, otherwise below it.
    winches = robot.winches
    if winches is None or winches.drum_radius is None:
        return np.empty((0, 2, 3))
    feet, (entry, along) = dead_runs(robot)[0][:, 1], _winch_ends(robot)
    middle = np.where(winches.on_platform[:, None], robot.platform_anchors.mean(axis=0), entry.mean(axis=0))
    upright = ~along[:, :2].any(axis=1, keepdims=True)
    away = np.where(upright, (feet - middle) * [1.0, 1.0, 0.0], [0.0, 0.0, -1.0])
    away -= along * (away * along).sum(axis=1, keepdims=True)
    length = np.linalg.norm(away, axis=1, keepdims=True)
    away = np.where(length > 0.0, away / np.where(length > 0.0, length, 1.0), [1.0, 0.0, 0.0])
    centers = feet + winches.drum_radius[:, None] * away
    width = winches.drum_radius if winches.drum_width is None else winches.drum_width
    half = 0.5 * width[:, None] * np.cross(along, away)
    return np.stack((centers - half, centers + half), axis=1)


def straight(ends: Array) -> Array:
    """Points along chords (m, 2, 3), shape (m, POINTS, 3)."""
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    return np.asarray(ends[:, :1] * (1.0 - share) + ends[:, 1:] * share)


def catenaries(ends: Array, cables: CableState, sag_scale: float) -> Array:
    """Points along catenaries (m, POINTS, 3), with the sag below the chord scaled by `sag_scale`."""
    run = ends[:, 1] - ends[:, 0]
    span = np.hypot(run[:, 0], run[:, 1])
    level = np.divide(run[:, :2], span[:, None], out=np.zeros((len(run), 2)), where=span[:, None] > 0.0)
    along, up = np.moveaxis(cables.points(POINTS), -1, 0)
    slope = np.divide(run[:, 2], span, out=np.zeros(len(run)), where=span > 0.0)[:, None]
    drop = np.where(span[:, None] > 0.0, up - slope * along, 0.0)  # a vertical cable remains on its chord
    height = up + (sag_scale - 1.0) * drop
    return np.asarray(ends[:, :1] + np.concatenate((level[:, None] * along[..., None], height[..., None]), axis=-1))


def courses(
    robot: Robot, pose: Pose, state: Equilibrium | None, sag_scale: float, cables: CableState | None = None
) -> Array:
    """Points of the cables from the entry of the pulley to the other end [m], shape (m, points_per_cable, 3)."""
    # In an equilibrium the free cables are catenaries with their sag scaled by a factor. Otherwise they leave their
    # pulleys along the chords, as catenaries with the states `cables`, or straight.
    cables, wrapped = cables if state is None else state.cables, wraps(robot, pose, state)
    ends = chords(robot, pose, wrapped[:, -1])
    free = straight(ends) if cables is None else catenaries(ends, cables, sag_scale)
    free = np.where(on_platform(robot)[:, None, None], free[:, ::-1], free)
    return free if wrapped.shape[1] == 1 else np.concatenate((wrapped, free), axis=1)


def resampled(points: Array, count: int) -> Array:
    """`points` (m, P, 3), interpolated at `count` equal steps, shape (m, count, 3). NaN separates pieces of a line."""
    place = np.linspace(0.0, points.shape[1] - 1.0, count)
    first = np.minimum(place.astype(np.intp), points.shape[1] - 2)
    rest = (place - first)[:, None]
    mixed = (1.0 - rest) * points[:, first] + rest * points[:, first + 1]
    return np.where(np.isnan(mixed), points[:, np.round(place).astype(np.intp)], mixed)  # up to the end of a piece


def segments(points: Array, *, dashed: bool, shown: NDArray[np.bool_] | None = None) -> Array:
    """Consecutive points (m, P, 3) as segments (m (P - 1), 2, 3). At NaN, their length is zero."""
    pairs = np.stack((points[:, :-1], points[:, 1:]), axis=2)
    gaps = np.isnan(pairs).any(axis=(2, 3))
    pairs[gaps] = np.repeat(points[:, :1], points.shape[1] - 1, axis=1)[gaps][:, None]
    if dashed:
        pairs[:, 1::2, 1] = pairs[:, 1::2, 0]
    if shown is not None:
        hidden = ~(shown[:, :-1] & shown[:, 1:])
        pairs[hidden, 1] = pairs[hidden, 0]
    return np.asarray(pairs.reshape(-1, 2, 3))


_BEAM = 0.0045  # thickness of the frame's beams, as a share of the robot's size
_DASH = 0.02  # length of a dash of an assumed frame, as a share of the robot's size
_WINCH = 0.009  # radius of a winch, as a share of the robot's size
_THINNEST = 0.08  # smallest thickness of a platform, relative to its largest edge
_SIDES = 20  # number of sides of a drum
_WHEEL: Final = ((0.8, 0.97), (0.1, 0.26))  # radii of rim and hub, relative to the radius of the pulley
_WHEEL_WIDTH, _SPOKE, _WHEEL_SIDES = 0.2, 0.055, 48
BOX_EDGES: Final = tuple(  # corners of a box, as in `box_corners`, that differ in a single coordinate
    (a, b) for a, b in combinations(range(8), 2) if (a ^ b).bit_count() == 1
)


class Solid(NamedTuple):
    """A closed surface."""

    vertices: Array  # corners [m], shape (v, 3)
    faces: Indices  # triangles, as indices of corners, counter-clockwise from outside, shape (f, 3)

    @staticmethod
    def frame(robot: Robot) -> Solid:
        """The twelve beams of the robot's box; they are dashed if the box is assumed."""
        corners, thick = box_corners(*bounds(robot)), _BEAM * size_of(robot)
        dash = _DASH * size_of(robot) if is_frame_assumed(robot) else np.inf
        return _merged([beam for a, b in BOX_EDGES for beam in _beams(corners[a], corners[b], thick, dash)])

    @classmethod
    def winches(cls, robot: Robot, *, aboard: bool = False) -> Solid:
        """Known drums of the frame, with a mark at every anchor without a visible pulley, or those of the platform."""
        radius, own = _WINCH * size_of(robot), on_platform(robot) == aboard
        marked = robot.frame_anchors[own & (pulley_radius(robot) < radius) & (not aboard)]
        up = np.array([0.0, 0.0, radius])
        parts = [cls.rod(np.stack((place - up, place + up)), radius) for place in np.unique(marked, axis=0)]
        known = None if robot.winches is None else robot.winches.drum_radius
        if known is not None:
            parts += [cls.rod(ends, thick) for ends, thick in zip(drum_axes(robot)[own], known[own], strict=True)]
        return _merged(parts) if parts else cls(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))

    @staticmethod
    def platform(robot: Robot) -> Solid:
        """The platform in its own frame: a box of its size, or the hull of its anchors."""
        anchors = robot.platform_anchors
        low, high = anchors.min(axis=0), anchors.max(axis=0)
        if robot.platform_size is not None:
            return _cuboid(0.5 * (low + high), robot.platform_size)
        extent = high - low
        thinnest = max(_THINNEST * float(extent.max()), 0.002 * size_of(robot))
        flat = _cuboid(0.5 * (low + high), np.maximum(extent, thinnest))
        if extent.min() < thinnest:
            return flat
        try:
            return _hull(anchors)
        except QhullError:  # the anchors are in an inclined plane
            return flat

    @classmethod
    def wheel(cls) -> Solid:
        """A pulley of radius 1 in the plane of x and z; its center is the origin."""
        from trimesh.creation import annulus  # an optional dependency that figures do not require

        rim, hub = (annulus(*radii, _WHEEL_WIDTH, sections=_WHEEL_SIDES).triangles.reshape(-1, 3) for radii in _WHEEL)
        angle = np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False)
        out = np.stack((np.cos(angle), np.sin(angle), np.zeros_like(angle)), axis=1)
        spokes = [cls.rod(np.array([_WHEEL[1][1] * way, _WHEEL[0][0] * way]), _SPOKE) for way in out]
        corners = [Solid(ring, np.arange(len(ring)).reshape(-1, 3)) for ring in (rim, hub)]
        lying = _merged([*corners, *spokes])
        x, y, z = lying.vertices.T
        return cls(np.stack((x, -z, y), axis=1), lying.faces)

    @staticmethod
    def rod(ends: Array, radius: float) -> Solid:
        """A cylinder between the two points `ends`, shape (2, 3)."""
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        left = np.cross(along, [1.0, 0.0, 0.0] if abs(along[0]) < 0.9 else [0.0, 1.0, 0.0])
        left /= np.linalg.norm(left)
        angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)[:, None]
        ring = radius * (np.cos(angle) * left + np.sin(angle) * np.cross(along, left))
        return _hull(np.concatenate((ends[0] + ring, ends[1] + ring)))

    @classmethod
    def tube(cls, points: Array, radius: float, sides: int = 6) -> Solid:
        """A thin tube along a line of `points` (P, 3), open at its ends. Repeated points are omitted."""
        new = np.concatenate(([True], np.linalg.norm(np.diff(points, axis=0), axis=1) > 0.0))
        points = points[new] if new.sum() > 1 else points
        forward = np.gradient(points, axis=0)
        forward /= np.linalg.norm(forward, axis=1, keepdims=True)
        helper = np.where(np.abs(forward[:, 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        left = np.cross(helper, forward)
        left /= np.linalg.norm(left, axis=1, keepdims=True)
        up = np.cross(forward, left)
        angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)[:, None, None]
        rings = points + radius * (np.cos(angle) * left + np.sin(angle) * up)  # (sides, P, 3)
        count = len(points)
        here = np.arange(sides)[:, None] * count + np.arange(count - 1)
        there = np.roll(np.arange(sides), -1)[:, None] * count + np.arange(count - 1)
        quads = np.stack((here, there, there + 1, here + 1), axis=-1).reshape(-1, 4)
        return cls(rings.reshape(-1, 3), np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]])))

    @classmethod
    def ball(cls) -> Solid:
        """A ball of radius 1."""
        from trimesh.creation import icosphere  # imported only when needed, because it takes a fifth of the start time

        mesh = icosphere(subdivisions=2)
        return cls(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64))

    def ray_distance(self, start: Array, direction: Array) -> float | None:
        """Distance along a ray to the surface, in lengths of `direction`; None without an intersection.

        Source:
            Moeller & Trumbore, J. Graphics Tools 2, 1997.
        """
        first, second, third = np.moveaxis(self.vertices[self.faces], 1, 0)
        one, two, gap = second - first, third - first, start - first
        across = np.cross(direction, two)
        volume = np.einsum("fi,fi->f", one, across)
        flat = np.abs(volume) <= 1e-14 * np.abs(one).max() * np.abs(two).max() * np.abs(direction).max()
        volume = np.where(flat, np.nan, volume)
        other = np.cross(gap, one)
        u, v = np.einsum("fi,fi->f", gap, across) / volume, other @ direction / volume
        far = np.einsum("fi,fi->f", two, other) / volume
        hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 0.0)
        return float(far[hit].min()) if hit.any() else None


def size_of(robot: Robot) -> float:
    """Diagonal of the robot's box [m]."""
    low, high = bounds(robot)
    return float(np.linalg.norm(high - low))


def box_corners(low: Array, high: Array) -> Array:
    """Corners of a box [m], shape (8, 3); z varies fastest."""
    return np.array(list(product(*zip(low, high, strict=True))))


def grouped(points: Array, near: float) -> list[list[int]]:
    """Groups of the indices of points (m, d) at a distance of at most `near` from the first point of their group."""
    groups: list[list[int]] = []
    for i, point in enumerate(points):
        home = next((group for group in groups if np.linalg.norm(points[group[0]] - point) <= near), None)
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    return groups


def is_frame_assumed(robot: Robot) -> bool:
    """True if the frame is assumed."""
    return robot.frame_size is None or "frame_size" in robot.assumed


def round_below(length: float) -> float:
    """The largest round number (1, 2 or 5 times a power of ten) that is not larger than a length > 0."""
    power = 10.0 ** floor(log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length * (1.0 + 1e-12))


def _beams(start: Array, end: Array, thick: float, dash: float) -> list[Solid]:
    """A beam from `start` to `end`, or dashes and gaps with lengths of about `dash`, with a dash at each end."""
    pieces = 2 * round(0.5 * float(np.linalg.norm(end - start)) / dash) + 1
    cuts = start + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (end - start)
    return [_cuboid(0.5 * (a + b), np.abs(b - a) + thick) for a, b in zip(cuts[:-1:2], cuts[1::2], strict=True)]


def wheels(
    robot: Robot, pose: Pose, state: Equilibrium | None = None, length: Array | None = None
) -> tuple[Array, Array]:
    """Centers (m, 3) [m] and rotations of the pulleys, quaternions, scalar first, shape (m, 4)."""
    # A wheel is in the plane of swivel axis and cable: x points from the axis to its center, z along the axis. It turns
    # as cable passes over it, at the unstrained lengths `length` (m,) [m] off the drums.
    exits, radius = exits_of(state), pulley_radius(robot)
    axis, away = cable_ends(robot, pose).axis, outward(robot, pose, exits)
    lost = ~away.any(axis=1)  # a cable along its axis, or an eyelet there
    away[lost] = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])[lost]
    swivel = Rotation.from_matrix(np.stack((away, np.cross(axis, away), axis), axis=2))
    passed = np.zeros_like(radius) if length is None else np.nan_to_num(length - dead_cable(robot))
    angle = np.divide(passed, radius, out=np.zeros_like(radius), where=radius > 0.0)
    turned = swivel * Rotation.from_rotvec(angle[:, None] * [0.0, 1.0, 0.0])
    return pulley_centers(robot, pose, exits), turned.as_quat(scalar_first=True)


def _cuboid(middle: Array, edges: Array) -> Solid:
    return _hull(box_corners(middle - 0.5 * edges, middle + 0.5 * edges))


def _merged(parts: list[Solid]) -> Solid:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return Solid(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def _hull(points: Array) -> Solid:
    """The convex hull; its triangles have separate corners, for flat shading."""
    hull = ConvexHull(points)
    corners = points[hull.simplices]  # (f, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("fi,fi->f", normal, hull.equations[:, :3]) < 0.0
    corners[inward] = corners[inward][:, ::-1]
    return Solid(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


THINNEST: Final = 0.03  # smallest axis of a drawn ellipsoid, relative to its longest axis


def error_ellipsoids(covariance: Array) -> tuple[Indices, Array, Array]:
    """Error ellipsoids of the points with known nonzero errors, from `covariance` (N, 3, 3) [m^2]."""
    # indices of these points (k,), standard errors along the axes [m], (k, 3), and the axes, one per column, (k, 3, 3)
    which = np.flatnonzero(np.isfinite(covariance).all(axis=(1, 2)) & covariance.any(axis=(1, 2))).astype(np.int64)
    squares, axes = np.linalg.eigh(covariance[which])
    return which, np.sqrt(np.maximum(squares, 0.0)), axes


def placed_balls(lengths: Array, axes: Array) -> tuple[Array, Array]:
    """Quaternions (k, 4), scalar first, and semi-axes (k, 3) of balls with `lengths` (k, 3) along `axes` (k, 3, 3)."""
    # thin ellipsoids become thicker, so that they are visible
    axes = np.where(np.linalg.det(axes)[:, None, None] < 0.0, axes * [-1.0, 1.0, 1.0], axes)
    turns = Rotation.from_matrix(axes).as_quat()[:, [3, 0, 1, 2]]
    return turns, np.maximum(lengths, THINNEST * lengths.max(axis=1, keepdims=True))


def readable(radius: Array, size: float) -> float:
    """A round factor that makes the largest radius about as large as a size [m]; 1 without ellipsoids."""
    largest = float(radius.max(initial=0.0))
    return max(round_below(size / largest), 1.0) if largest > 0.0 else 1.0
