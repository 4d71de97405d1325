"""Motion patterns and the free motions that they allow; checks of a robot's fields, which return checked values."""

from __future__ import annotations

from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.cable import Cable
from sagline.core.arguments import instance
from sagline.core.arrays import SMALLEST, Array, checked, exactly, locked, refuse_first
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import unit

MotionPattern = Literal["3R3T", "3T", "1R2T", "2T"]
MOTION_PATTERNS: Final[tuple[str, ...]] = get_args(MotionPattern)
PLANAR: Final = frozenset({"1R2T", "2T"})
ROTATING: Final = frozenset({"3R3T", "1R2T"})
_SPATIAL: Final = {"3R3T": locked(np.eye(6)), "3T": locked(np.eye(3, 6))}


def freedom_matrix(pattern: MotionPattern, plane_normal: Array | None) -> Array:
    """Orthonormal rows (n, 6), one per free motion; a row selects a component of a wrench or twist in world axes."""
    # A planar pattern needs `plane_normal`, the unit normal (3,) of its plane. The first two rows are the translations
    # e1 and e2 with e1 x e2 = plane_normal; e1 is horizontal, and e2 points upward as steeply as the plane allows.
    if plane_normal is None:
        return _SPATIAL[pattern]
    rows = np.zeros((3, 6))
    rows[:2, :3] = _plane_axes(plane_normal)
    rows[2, 3:] = plane_normal
    return locked(rows if pattern == "1R2T" else rows[:2])


def _plane_axes(normal: Array) -> Array:
    # vector with the length sin(angle between normal and vertical)
    horizontal = np.cross((0.0, 0.0, 1.0), normal)
    length = float(np.linalg.norm(horizontal))
    if length < 1e-12:  # all directions of a horizontal plane are horizontal: choose x
        horizontal = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
        length = float(np.linalg.norm(horizontal))
    first = horizontal / length
    return np.stack([first, np.cross(normal, first)])


_SYMMETRY = 1e-9  # largest difference between elements [i, j] and [j, i], relative to the largest element
# Tolerance of the triangle inequality for moments with three digits. A thin plate satisfies it with equality.
_ROUNDED = 0.01


def anchors(frame: ArrayLike, platform: ArrayLike) -> tuple[Array, Array]:
    """Checked frame and platform anchors [m], (m, 3) each. No two cables have the same pair of anchors."""
    pair = []
    for value, item in ((frame, "frame_anchors"), (platform, "platform_anchors")):
        array = checked(value, item, "m", shape=(None, 3))
        if array.ndim != 2 or len(array) == 0:
            allowed, step = "shape (m, 3), m >= 1", "Give one point per cable."
            raise InvalidValueError(item, f"of shape {array.shape}", allowed, step)
        pair.append(array)
    if len(pair[0]) != len(pair[1]):
        allowed = f"as many as frame_anchors, {len(pair[0])}"
        step = "Give each cable a point on the frame and a point on the platform."
        raise InvalidValueError("platform_anchors", f"{len(pair[1])} points", allowed, step)
    _refuse_twins(np.hstack(pair))
    return pair[0], pair[1]


def _refuse_twins(ends: Array) -> None:
    if len({row.tobytes() for row in ends + 0.0}) == len(ends):  # + 0.0 changes -0.0 to 0.0
        return
    _, first, which = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    twin_of = first[which.reshape(-1)]
    twins = np.flatnonzero(twin_of != np.arange(len(ends)))
    if twins.size:
        second = int(twins[0])
        value = f"between the same two points as cable {int(twin_of[second])}"
        step = f"Remove one of them, or correct frame_anchors[{second}] or platform_anchors[{second}]."
        raise InvalidValueError(f"cable {second}", value, "cables that differ in at least one end", step)


def cables(given: Cable, count: int) -> Cable:
    """Checked material of the cables with fields of shape (m,) and positive linear densities."""
    instance(given, Cable, "cables")
    fields = {name: per_cable(field, f"cables: {name}", count) for name, field in given.known().items()}
    step = "Give the mass per length of the cable; to neglect its weight, use the model Elastic or Straight."
    density = fields["linear_density"]
    # np.abs avoids the text -0 in the message
    refuse_first(density == 0.0, "cables: linear_density", np.abs(density), "kg/m", "> 0 kg/m", step)
    return given if given.linear_density.shape == (count,) else given.replace(**fields)


def inertia(given: ArrayLike | None, pattern: str, normal: Array | None) -> Array:
    """Checked inertia about the center of mass [kg m^2], (3, 3): symmetric, without negative principal moments."""
    # The moment about each axis of free rotation must be positive. A body with three free rotations must also satisfy
    # the triangle inequality: each principal moment is at most the sum of the two other moments. Moments about axes
    # without free rotation may be zero, because other tools write zeros. If no rotation is free, `given` may be None,
    # which means zeros.
    if given is None and pattern in ROTATING:
        step = f"The motion pattern {pattern} has a rotation; give the inertia."
        raise InvalidValueError("inertia", "missing", "a symmetric matrix of shape (3, 3)", step)
    matrix = exactly(np.zeros((3, 3)) if given is None else given, "inertia", "kg m^2", (3, 3))
    skew = np.abs(matrix - matrix.T)
    if skew.max() > _SYMMETRY * np.abs(matrix).max():
        row, column = (int(i) for i in np.argwhere(skew == skew.max())[0])
        allowed = f"the same as inertia[{column}, {row}], {matrix[column, row]:g} kg m^2"
        step = "An inertia matrix is symmetric; correct one of the two elements."
        raise InvalidValueError(f"inertia[{row}, {column}]", f"{matrix[row, column]:g} kg m^2", allowed, step)
    _check_moments(np.linalg.eigvalsh(matrix).astype(np.float64), everywhere=pattern in ROTATING and normal is None)
    if pattern in ROTATING and normal is not None and not (about := float(normal @ matrix @ normal)) > 0.0:
        value = f"a matrix with {about:g} kg m^2 about plane_normal"
        step = "Give the moment about the platform's axis of rotation."
        raise InvalidValueError("inertia", value, "> 0 kg m^2", step)
    return matrix


def _check_moments(moments: Array, *, everywhere: bool) -> None:
    """Refuse impossible principal `moments` [kg m^2], sorted by size; everywhere: True if all rotations are free."""
    least = 0.0 if everywhere else np.nextafter(-_SYMMETRY * abs(moments[2]), -1.0)
    step = "the inertia about the center of mass, in the platform frame."
    if moments[0] <= least:
        value, allowed = f"a matrix with the principal moment {moments[0]:g} kg m^2", ">" if everywhere else ">="
        raise InvalidValueError("inertia", value, f"principal moments {allowed} 0 kg m^2", f"Give {step}")
    if everywhere and moments[2] > (1.0 + _ROUNDED) * (moments[0] + moments[1]):
        value = f"a matrix with the principal moments {', '.join(f'{moment:g}' for moment in moments)} kg m^2"
        step, allowed = f"Such a body does not exist; give {step}", "none larger than the sum of the other two"
        raise InvalidValueError("inertia", value, allowed, step)


def plane_normal(given: ArrayLike | None, pattern: str) -> Array | None:
    """Unit vector along the nonzero vector `given`, normal to the plane of motion; None for a pattern in space."""
    if (given is None) == (pattern in PLANAR):
        has = "not given" if given is None else "given"
        allowed = "a vector of three numbers" if given is None else "nothing"
        step = "Correct plane_normal or motion_pattern."
        raise InvalidValueError("plane_normal", f"{has} for motion_pattern {pattern}", allowed, step)
    if given is None:
        return None
    normal = exactly(given, "plane_normal", "", (3,))
    if np.abs(normal).max() < SMALLEST:
        raise InvalidValueError("plane_normal", "the zero vector", "a direction", "Give the normal of the plane.")
    return locked(unit(normal))


def limits_of_each_cable(low: ArrayLike, high: ArrayLike, count: int) -> tuple[Array, Array]:
    """Checked tension limits [N], (m,) each: nonnegative, and no lower limit is larger than the upper limit."""
    lower = per_cable(checked(low, "tension_min", "N", low=0.0), "tension_min", count)
    upper = per_cable(checked(high, "tension_max", "N", low=0.0, infinite=True), "tension_max", count)
    allowed, step = "<= tension_max[{i}], {limit:g} N", "Lower this limit, or raise the other one."
    refuse_first(lower > upper, "tension_min", lower, "N", allowed, step, upper)
    return lower, upper


def per_cable(array: Array, item: str, count: int) -> Array:
    """Values (m,), one per cable, from an array with one value per cable or with a single value for all cables."""
    if array.shape not in ((), (1,), (count,)):
        raise InvalidValueError(item, f"of shape {array.shape}", f"shape () or ({count},)", "Give one value per cable.")
    return array if array.shape == (count,) else locked(np.full(count, array))


def size(given: ArrayLike | None, item: str) -> Array | None:
    """Checked edge lengths (3,) of a box that is drawn [m], or None."""
    return None if given is None else exactly(given, item, "m", (3,), above=0.0)
