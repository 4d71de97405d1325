"""Common interface of the cable models, and states of cables with status codes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.cables.cable import Cable
from sagline.core.arguments import batch_length, check_memory, instance, part_of, whole_number
from sagline.core.arrays import Array, Codes, broadcast_shape, checked, kernel_input, locked, number
from sagline.core.errors import CableGeometryError, InvalidValueError
from sagline.core.results import Result, Status
from sagline.kernels import batch_from_length, batch_from_tension, closures, codes, largest_sags, shape_points, tables

if TYPE_CHECKING:
    from sagline.kernels.cable.terms import Terms


class CableStatus(Status):
    """Status of a cable after a computation; `text` states its meaning and the next step."""

    SOLVED = codes.CABLE_SOLVED, "solved"
    SLACK = codes.CABLE_SLACK, "slack: the cable has no chord tension; a shorter length makes it taut"
    NO_TENSION = (
        codes.CABLE_NO_TENSION,
        "the length of a straight cable does not determine its tension; use another model, or give the tension",
    )
    BELOW_VALIDITY = (
        codes.CABLE_BELOW_VALIDITY,
        "the empirical model is not valid here, because the lowest point of the cable is inside the span; "
        "raise the tension above w D/(2 |sin phi|), or use Catenary()",
    )
    TOO_SLACK = codes.CABLE_TOO_SLACK, "the chord tension is below 0.1 % of the cable's weight; raise the tension"
    NOT_CONVERGED = codes.CABLE_NOT_CONVERGED, "the iteration did not converge; please report this cable's data"


_ARRAYS = ["span", "rise", "unstrained_length", "horizontal_tension", "vertical_force", "chord_tension", "status"]


@dataclass(frozen=True, slots=True)
class CableModel:
    """Base class of cable models: a code and two parameters for the kernels.

    Attributes:
        code: Code that selects the equations in the kernels (`sagline.kernels.codes`).
        weightless: True if the model ignores the cable's weight.
    """

    code: ClassVar[int]
    weightless: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Refuse objects of the base class itself, which is not a cable model."""
        if type(self) is CableModel:
            step = "Choose one of the models, Catenary() for instance."
            raise InvalidValueError("CableModel()", "the abstract base class", "a cable model", step)

    @property
    def parameters(self) -> tuple[float, float]:
        """Parameters k_h and k_p of the empirical model; zero for all other models."""
        return 0.0, 0.0

    def terms(self, gravity: float) -> Terms:
        """Parameters of the model for kernels.

        Args:
            gravity: Gravitational acceleration [m/s^2].

        Returns:
            Code, k_h, k_p and gravity.

        Raises:
            InvalidValueError: If `gravity` is negative or not a number.
        """
        return self.code, *self.parameters, number(gravity, "gravity", "m/s^2", low=0.0)

    def from_tension(
        self, cable: Cable, span: ArrayLike, rise: ArrayLike, chord_tension: ArrayLike, gravity: float = 9.81
    ) -> CableState:
        """Compute lengths and forces of cables that have the chord tensions `chord_tension`.

        All arguments broadcast to one shape (...).

        Args:
            cable: Material.
            span: Horizontal distance between the ends [m], >= 0.
            rise: Height of the platform end above the frame end [m].
            chord_tension: tau = T_x/cos phi [N], >= 0.
            gravity: Gravitational acceleration [m/s^2], >= 0.

        Returns:
            State with fields of shape (...).

        Raises:
            CableGeometryError: If `span` is negative, or `span` and `rise` are both zero.
            InvalidValueError: If a tension or `gravity` is negative or not finite; if the shapes do not broadcast.

        Examples:
            The state of a cable at one tension, then at three tensions:

            >>> import sagline as sl
            >>> model = sl.Catenary()
            >>> cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)
            >>> state = model.from_tension(cable, span=12.0, rise=-4.0, chord_tension=100.0)
            >>> print(f"{state.unstrained_length:.4f} m")
            12.6237 m
            >>> state = model.from_tension(cable, 12.0, -4.0, [50.0, 100.0, 200.0])
            >>> print((1e3 * state.sag).round(1), "mm")
            [262.7 131.2  65.4] mm

        Source:
            Irvine 1981, ch. 2; docs/model.md, sections 2 (P3) and 3.
        """
        instance(cable, Cable, "cable")
        tension = checked(chord_tension, "chord_tension", "N", low=0.0)
        buffer = np.empty((tables.BUFFERS, tables.CHUNK))
        names = "chord_tension", "unstrained_length"
        return self._solve(cable, span, rise, gravity, names, tension, batch_from_tension, buffer)

    def from_length(
        self, cable: Cable, span: ArrayLike, rise: ArrayLike, unstrained_length: ArrayLike, gravity: float = 9.81
    ) -> CableState:
        """Compute forces of cables that have the unstrained lengths `unstrained_length`.

        All arguments broadcast to one shape (...).

        Args:
            cable: Material.
            span: Horizontal distance between the ends [m], >= 0.
            rise: Height of the platform end above the frame end [m].
            unstrained_length: L [m], > 0.
            gravity: Gravitational acceleration [m/s^2], >= 0.

        Returns:
            State with fields of shape (...).

        Raises:
            CableGeometryError: If `span` is negative, or `span` and `rise` are both zero.
            InvalidValueError: If a length is not positive; if `gravity` is negative; if shapes do not broadcast.

        Source:
            Irvine 1981, ch. 2; docs/model.md, sections 2 (P2) and 3.
        """
        instance(cable, Cable, "cable")
        length = checked(unstrained_length, "unstrained_length", "m", above=0.0)
        names = "unstrained_length", "chord_tension"
        return self._solve(cable, span, rise, gravity, names, length, batch_from_length)

    def _solve(
        self,
        cable: Cable,
        span: ArrayLike,
        rise: ArrayLike,
        gravity: float,
        names: tuple[str, str],
        given: Array,
        kernel: Callable[..., None],
        *work: Array,
    ) -> CableState:
        """State of cables from the values `given`. `names`: the given quantity and the result of `kernel`."""
        span = _checked_span(span)
        rise = checked(rise, "rise", "m")
        gravity = number(gravity, "gravity", "m/s^2", low=0.0)
        item = "span, rise, tension or length, and cable"
        shape = broadcast_shape(item, span.shape, rise.shape, given.shape, cable.linear_density.shape)
        size = math.prod(shape)
        check_memory(item, 80.0 * size, "Give fewer cables at once.")
        if (span.size == 0 or span.min() == 0.0) and not np.all((span != 0.0) | (rise != 0.0)):
            step = "Move one end: a cable between equal points has no chord."
            raise CableGeometryError("span and rise", "both 0 m", "two different ends", step)
        fields = (span, rise, cable.linear_density, cable.axial_stiffness, given)
        found: tuple[NDArray[Any], ...] = (*(np.empty(size) for _ in range(3)), np.empty(size, dtype=np.int8))
        kernel(self.terms(gravity), tuple(_flat(field, shape) for field in fields), found, *work)
        known: dict[str, NDArray[Any]] = {names[0]: given, "span": span, "rise": rise}
        solved = dict(zip((names[1], "horizontal_tension", "vertical_force", "status"), found, strict=True))
        arrays: dict[str, Any] = {name: _shaped(values, shape) for name, values in (known | solved).items()}
        return CableState(model=self, cable=cable, gravity=gravity, **arrays)

    def profile(self, cable: Cable, state: CableState, points: int = 50) -> Array:
        """Compute points along a cable of this model, in the vertical plane of the cable.

        Args:
            cable: Material.
            state: State with ends, length and forces of the cable, shape (...).
            points: Number of points at equal steps of unstrained length, >= 2.

        Returns:
            Horizontal and vertical coordinates relative to the frame end [m], shape (..., points, 2).

        Raises:
            InvalidValueError: If `points` is less than two; if `cable` or `state` has the wrong type.
        """
        placed = replace(instance(state, CableState, "state"), model=self, cable=instance(cable, Cable, "cable"))
        return placed.points(whole_number(points, "points", 2))


def _checked_span(span: ArrayLike) -> Array:
    try:
        return checked(span, "span", "m", low=0.0)
    except InvalidValueError as error:
        raise CableGeometryError(*error.args) from None


def _flat(field: Array, shape: tuple[int, ...]) -> Array:
    """Operand with one axis, from an array with one value per cable or with a single value for all cables."""
    return field.reshape(1) if field.size == 1 else kernel_input(field, shape).reshape(-1)


def _shaped(field: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Read-only array of a field in the shape of the batch, (...)."""
    whole = field.size == math.prod(shape)
    return locked(field.reshape(shape) if whole else np.broadcast_to(field, shape))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CableState(Result):
    """State of cables that a cable model has computed: ends, forces and lengths.

    Every array has the shape (...), with one entry per cable. Forces act on the cable at its platform end. A state can
    be indexed along its first axis with a number, a slice, or an array of numbers or booleans. A slice shares the
    memory of the original state.

    Attributes:
        model: Cable model that has computed the state.
        cable: Material; its fields broadcast with shape (...).
        gravity: Gravitational acceleration [m/s^2].
        span: Horizontal distance from frame end to platform end [m].
        rise: Height of the platform end above the frame end [m].
        unstrained_length: L [m].
        horizontal_tension: T_x [N], >= 0.
        vertical_force: T_z [N], up positive.
        chord_tension: tau = T_x/cos phi [N].
        status: Codes of `CableStatus`. Only cables with the code SOLVED, SLACK or BELOW_VALIDITY have forces and
            lengths; all other cables have NaN.
    """

    model: CableModel
    cable: Cable
    gravity: float
    span: Array
    rise: Array
    unstrained_length: Array
    horizontal_tension: Array
    vertical_force: Array
    chord_tension: Array
    status: Codes

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape (...) of every array."""
        return self.unstrained_length.shape

    def __len__(self) -> int:
        """Number of entries along the first axis."""
        return batch_length(self.shape, "state of a single cable")

    def __getitem__(self, index: int | slice | NDArray[Any]) -> CableState:
        """State of the cables that `index` selects along the first axis."""
        # index: A number (negative numbers count from the end), a slice, or an array of numbers or booleans.
        # Raises NoBatchError if the state has only a single cable; the error is also a TypeError.
        # Raises NoSuchEntryError if an entry does not exist; the error is also an IndexError.
        part = part_of(index, self.shape, "state of a single cable")
        arrays: dict[str, Any] = {name: locked(getattr(self, name)[part, ...]) for name in _ARRAYS}
        return replace(self, cable=self.cable._part(part, self.shape), **arrays)

    def __iter__(self) -> Iterator[CableState]:
        """Iterate over the entries along the first axis."""
        return (self[i] for i in range(len(self)))

    @property
    def chord(self) -> Array:
        """Chord D: distance between the two ends [m]."""
        return np.hypot(self.span, self.rise)

    @property
    def adjusting_length(self) -> Array:
        """Adjusting length d = L - D of the article [m]."""
        return self.unstrained_length - self.chord

    @property
    def cable_weight(self) -> Array:
        """Weight of the whole cable [N]; zero in the weightless models."""
        if self.model.weightless:
            return np.zeros(self.shape)
        return self.cable.linear_density * self.gravity * self.unstrained_length

    @property
    def frame_end_tension(self) -> Array:
        """Tension at the frame end [N], where load cells of winches measure."""
        return np.hypot(self.horizontal_tension, self.vertical_force - self.cable_weight)

    @property
    def platform_end_tension(self) -> Array:
        """Tension at the platform end [N]."""
        return np.hypot(self.horizontal_tension, self.vertical_force)

    @property
    def sag(self) -> Array:
        """Largest vertical distance between chord and cable [m]; for a vertical chord, depth below the lower end."""
        return self._evaluate(largest_sags)

    @property
    def closure_residual(self) -> Array:
        """Closure error [m]: error with which the state satisfies the equations of its cable model."""
        return self._evaluate(closures)

    def points(self, count: int) -> Array:
        """Compute points along the cable in its vertical plane.

        Args:
            count: Number of points at equal steps of unstrained length, >= 2.

        Returns:
            Horizontal and vertical coordinates [m], frame end first, shape (..., count, 2).

        Raises:
            InvalidValueError: If `count` is less than two, or the points do not fit into memory.
        """
        whole_number(count, "points", 2)
        check_memory("points", 16.0 * self.unstrained_length.size * count, "Choose fewer points.")
        return locked(self._evaluate(shape_points, count, 2))

    def _evaluate(self, kernel: Callable[..., None], *shape: int) -> Array:
        """Results (..., *shape) of `kernel` for all cables of the state."""
        given = (self.span, self.rise, self.cable.linear_density, self.cable.axial_stiffness, self.unstrained_length)
        forces = (self.horizontal_tension, self.vertical_force, self.chord_tension)
        columns = tuple(kernel_input(field, self.shape).reshape(-1) for field in (*given, *forces))
        out = np.empty((self.unstrained_length.size, *shape))
        kernel(self.model.terms(self.gravity), columns, out)
        return out.reshape((*self.shape, *shape))
