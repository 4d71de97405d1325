"""Poses of the platform (position of its origin, rotation from platform to world), and boxes of poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from attrs import field, fields, frozen
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import batch_length, check_memory, instance, part_of
from sagline.core.arrays import Array, broadcast_shape, checked, locked, number, refuse_first
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, reduced, rule

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

# Largest rounding error of the length of a normalized vector of 3 or 4 numbers.
_ROUNDING = 4.0 * np.finfo(np.float64).eps


def unit(vectors: Array) -> Array:
    """Unit vectors along `vectors` (last axis); NaN for a zero vector."""
    # A vector is unchanged if its length differs from 1 only by rounding errors, because loading and copying normalize
    # vectors again, and must not change values. If all lengths are 1, the given array itself is returned.
    length = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))[..., np.newaxis]
    if (np.abs(length - 1.0) <= _ROUNDING).all():
        return vectors
    scaled: Array = vectors / np.where(np.abs(length - 1.0) <= _ROUNDING, 1.0, length)
    return scaled


@frozen(eq=False, weakref_slot=False)
class PoseBox:
    """Box of poses: positions of the platform origin in a box, with rotations up to a tilt angle about any axis.

    Attributes:
        low: Lowest position of the platform origin [m], shape (3,).
        high: Highest position of the platform origin [m], shape (3,), at least `low`.
        tilt: Largest angle of rotation [rad], 0 to pi.

    Raises:
        InvalidValueError: If a number is not finite, if a corner does not have three numbers, if `high` is below `low`,
            or if `tilt` is more than pi.
    """

    low: Array = field(converter=given, metadata=rule("m", shape=(3,)))
    high: Array = field(converter=given, metadata=rule("m", shape=(3,)))
    tilt: float = 0.0

    def __attrs_post_init__(self) -> None:
        """Check the three fields."""
        for about in fields(PoseBox)[:2]:
            item = f"test_box: {about.name}"
            object.__setattr__(self, about.name, checked(getattr(self, about.name), item, **about.metadata))
        low, high = self.low, self.high
        for name, corner in (("low", low), ("high", high)):
            if corner.ndim != 1:
                step = "Give one x, y, z."
                raise InvalidValueError(f"test_box: {name}", f"of shape {corner.shape}", "shape (3,)", step)
        refuse_first(low > high, "test_box: high", high, "m", ">= low, {limit:g} m", "Exchange low and high.", low)
        angle = number(self.tilt, "test_box: tilt", "rad", low=0.0)
        if angle > np.pi:
            value, step = f"{angle:.6g} rad", "Give the angle in radians; the largest rotation is half a turn."
            raise InvalidValueError("test_box: tilt", value, "0 to pi rad", step)
        object.__setattr__(self, "tilt", angle)

    __reduce__ = reduced


def level_grid(box: PoseBox, counts: Sequence[int]) -> Pose:
    """Level poses on an even grid in a box; an axis of no extent or with one point has one point, in its middle."""
    axes = [
        np.linspace(low, high, count) if count > 1 and high > low else np.array([0.5 * (low + high)])
        for low, high, count in zip(box.low, box.high, counts, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Pose.from_euler(places, 0.0, 0.0, 0.0)


_MATRIX_TOLERANCE = 1e-9  # largest element of Q Q^T - 1 for a matrix Q that is accepted as a rotation
_QUATERNION_TOLERANCE = 1e-6  # tolerance of a quaternion's length, sufficient for quaternions with seven digits


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """One pose of the platform frame, or a batch of poses.

    Attributes:
        position: Position of the platform frame's origin in the world [m], shape (3,) or (N, 3).
        quaternion: Rotation from platform to world as a unit quaternion (x, y, z, w), shape (4,) or (N, 4).
    """

    position: Array
    quaternion: Array

    def __init__(
        self, position: ArrayLike, rotation: Rotation | ArrayLike | None = None, z: ArrayLike | None = None
    ) -> None:
        """Pose from a position and a rotation.

        `Pose(x, y, z)` is a pose without rotation; x, y and z are numbers, or arrays of shape (N,).

        Args:
            position: Position of the platform frame's origin [m], shape (3,) or (N, 3).
            rotation: scipy Rotation, or rotation matrices of shape (3, 3) or (N, 3, 3); None for no rotation.
            z: Coordinate z [m] of a pose without rotation; the arguments `position` and `rotation` are then x and y.

        Raises:
            InvalidValueError: If a number is not finite, if a matrix is not a rotation, or if the lengths N differ.

        Examples:
            >>> import sagline as sl
            >>> print(sl.Pose(1, 0.5, 2).position, sl.Pose([(0, 0, 1), (0, 0, 2)]).shape)
            [1.  0.5 2. ] (2,)
        """
        if z is not None:
            each = [checked(value, name, "m") for name, value in (("x", position), ("y", rotation), ("z", z))]  # type: ignore[arg-type]
            shape = broadcast_shape("x, y, z", *(one.shape for one in each))
            position, rotation = np.stack([np.broadcast_to(one, shape) for one in each], axis=-1), None
        place = checked(position, "position", "m", shape=(3,))
        self._fill(place, np.array((0.0, 0.0, 0.0, 1.0)) if rotation is None else _quaternion_of(rotation))

    @classmethod
    def from_euler(cls, position: ArrayLike, alpha: ArrayLike, beta: ArrayLike, gamma: ArrayLike) -> Pose:
        """Create a pose from Z-Y-X Euler angles: alpha about z, then beta about the new y, then gamma about the new x.

        Args:
            position: Position of the platform frame's origin [m], shape (3,) or (N, 3).
            alpha: Angle about z [rad], a number or shape (N,).
            beta: Angle about y [rad], a number or shape (N,).
            gamma: Angle about x [rad], a number or shape (N,).

        Returns:
            Pose, single or a batch of N.

        Raises:
            InvalidValueError: If a number is not finite, or if the arguments have different lengths N.

        Source:
            The article's equation (9); scipy's 'ZYX'.
        """
        named = (("alpha", alpha), ("beta", beta), ("gamma", gamma))
        halves = [0.5 * checked(angle, name, "rad") for name, angle in named]
        try:
            z, y, x = np.broadcast_arrays(*halves)
        except ValueError:
            raise _counts_differ("alpha, beta, gamma", [half.shape for half in halves]) from None
        (sz, sy, sx), (cz, cy, cx) = (np.sin((z, y, x)), np.cos((z, y, x)))
        parts = (
            cz * cy * sx - sz * sy * cx,
            cz * sy * cx + sz * cy * sx,
            sz * cy * cx - cz * sy * sx,
            cz * cy * cx + sz * sy * sx,
        )
        return cls._adopt(checked(position, "position", "m", shape=(3,)), np.stack(parts, axis=-1))

    @classmethod
    def from_quaternion(cls, position: ArrayLike, quaternion: ArrayLike) -> Pose:
        """Create a pose from a unit quaternion (x, y, z, w), scalar last.

        Args:
            position: Position of the platform frame's origin [m], shape (3,) or (N, 3).
            quaternion: Unit quaternion, shape (4,) or (N, 4); a length that differs from 1 by 1e-6 is accepted.

        Returns:
            Pose, single or a batch of N.

        Raises:
            InvalidValueError: If a number is not finite, if a quaternion has another length, or if the lengths N
                differ.
        """
        given = checked(quaternion, "quaternion", "", shape=(4,))
        length = np.linalg.norm(given, axis=-1)
        _refuse(np.abs(length - 1.0) > _QUATERNION_TOLERANCE, "quaternion", "length", length, "length 1 to 1e-6")
        return cls._adopt(checked(position, "position", "m", shape=(3,)), given)

    @classmethod
    def _adopt(cls, position: Array, quaternion: Array) -> Pose:
        """Pose from arrays that sagline created. The arrays are not copied, and only their shapes are checked."""
        pose = object.__new__(cls)
        pose._fill(position, quaternion)
        return pose

    def _fill(self, position: Array, quaternion: Array) -> None:
        shapes = [position.shape[:-1], quaternion.shape[:-1]]
        try:
            shape = np.broadcast_shapes(*shapes)
        except ValueError:
            raise _counts_differ("position and rotation", shapes) from None
        check_memory("pose", 56.0 * math.prod(shape), "Give fewer poses.")
        if len(shape) > 1:
            allowed, step = "one pose, or a batch of shape (N,)", "Flatten the leading axes."
            raise InvalidValueError("pose", f"a batch of shape {shape}", allowed, step)
        for name, array in (("position", position), ("quaternion", unit(quaternion))):
            whole = np.ascontiguousarray(np.broadcast_to(array, (*shape, array.shape[-1])))
            object.__setattr__(self, name, locked(whole))

    @property
    def rotation(self) -> Rotation:
        """Rotation from platform to world, as a scipy Rotation."""
        from scipy.spatial.transform import Rotation  # the import would take a third of the load time of sagline

        return Rotation.from_quat(self.quaternion)

    @property
    def matrix(self) -> Array:
        """Rotation matrix from platform to world, shape (..., 3, 3); NaN for a pose without a solution."""
        x, y, z, w = np.moveaxis(self.quaternion, -1, 0)
        rows = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
            (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
            (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
        )
        return locked(np.stack([np.stack(row, axis=-1) for row in rows], axis=-2))

    def transform(self, points: ArrayLike) -> Array:
        """Transform points from the platform frame to the world.

        Every pose transforms every point. If each pose has its own points, transform pose by pose:
        `pose[i].transform(points[i])`.

        Args:
            points: Coordinates in the platform frame [m], shape (..., 3).

        Returns:
            Coordinates in the world [m]: shape (..., 3) for a single pose, (N, ..., 3) for a batch of N; NaN for a pose
            without a solution.

        Raises:
            InvalidValueError: If a coordinate is not finite, or the last axis is not x, y, z.

        Examples:
            >>> import numpy as np
            >>> import sagline as sl
            >>> pose = sl.Pose.from_euler([1, 2, 3], alpha=np.pi / 2, beta=0, gamma=0)
            >>> pose.transform([[1, 0, 0], [0, 1, 0]]).round(12)
            array([[1., 3., 3.],
                   [0., 2., 3.]])
        """
        given = checked(points, "points", "m", shape=(3,))
        check_memory("points", 16.0 * given.size * math.prod(self.shape), "Transform fewer points or poses at once.")
        turned = given.reshape(-1, 3) @ np.swapaxes(self.matrix, -1, -2)
        return locked((turned + self.position[..., None, :]).reshape(*self.shape, *given.shape))

    @property
    def shape(self) -> tuple[int, ...]:
        """() for a single pose, (N,) for a batch."""
        return self.position.shape[:-1]

    def __len__(self) -> int:
        """Number of poses in a batch."""
        return batch_length(self.shape, "single pose")

    def __getitem__(self, index: int | slice | NDArray[Any]) -> Pose:
        """One pose of a batch, or a part of the batch; a slice shares the memory of the batch where possible.

        Args:
            index: A number (negative: from the end), a slice, or an array of numbers or of N booleans.

        Raises:
            NoBatchError: If the pose is a single pose; the error is also a TypeError.
            NoSuchEntryError: If a pose does not exist (also an IndexError).
        """
        part = part_of(index, self.shape, "single pose")
        return Pose._adopt(self.position[part], self.quaternion[part])

    def __iter__(self) -> Iterator[Pose]:
        """Iterate over the poses of a batch."""
        return (self[i] for i in range(len(self)))

    def __reduce__(self) -> tuple[Any, tuple[Array, Array]]:
        """Pickle the pose as a call of a constructor, which checks the loaded arrays and makes them read-only."""
        return Pose.from_quaternion, (self.position, self.quaternion)


PoseLike = Pose | Sequence[Pose] | ArrayLike  # an array contains positions [m] of poses without rotation


def pose_of(value: PoseLike, item: str = "pose") -> Pose:
    """Convert a list of poses to a batch, and positions [m], shape (3,) or (N, 3), to poses without rotation."""
    if not (isinstance(value, list | tuple) or hasattr(value, "__array__")):
        return instance(value, Pose, item)
    if isinstance(value, list | tuple) and value and all(isinstance(one, Pose) for one in value):
        return Pose._adopt(*(np.vstack([getattr(one, name) for one in value]) for name in Pose.__slots__))
    return Pose(checked(value, item, "m", shape=(3,)))


def single_pose(value: PoseLike, item: str = "pose") -> Pose:
    """Checked single pose; a position [m], shape (3,), is converted to a pose without rotation."""
    pose = pose_of(value, item)
    if pose.shape:
        raise InvalidValueError(item, f"a batch of {len(pose)}", "a single pose", f"Give one of them: {item}[0].")
    return pose


def _quaternion_of(rotation: Any) -> Array:
    if hasattr(rotation, "as_quat") and not isinstance(rotation, type):
        return checked(rotation.as_quat(), "rotation", "", shape=(4,))
    matrix = checked(rotation, "rotation", "", shape=(3, 3))
    excess = np.abs(matrix @ np.swapaxes(matrix, -1, -2) - np.eye(3)).max(axis=(-1, -2))
    _refuse(excess > _MATRIX_TOLERANCE, "rotation", "largest element of Q Q^T - 1", excess, "an orthonormal matrix")
    determinant = np.linalg.det(matrix)
    _refuse(determinant < 0.0, "rotation", "determinant", determinant, "determinant +1, a rotation without reflection")
    from scipy.spatial.transform import Rotation

    quaternion: Array = Rotation.from_matrix(matrix).as_quat()
    return quaternion


def _refuse(wrong: NDArray[np.bool_], item: str, measure: str, values: Array, allowed: str) -> None:
    if not wrong.any():
        return
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    where = item if not index else f"{item} {index[0]}"
    step = "Build it with scipy's Rotation, which checks the matrix."
    raise InvalidValueError(f"{where}: {measure}", f"{values[index]:.12g}", allowed, step)


def _counts_differ(item: str, shapes: list[tuple[int, ...]]) -> InvalidValueError:
    value, allowed = f"of batch shapes {' and '.join(map(str, shapes))}", "equal counts, or a single pose"
    return InvalidValueError(item, value, allowed, "Give one value for each pose.")
