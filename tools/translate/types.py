"""Types of the subset: scalars, arrays, tuples and None; their common types, and the error of the translator."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final


class TranslationError(Exception):
    """A construct outside the subset.

    Attributes:
        file: Python source.
        line: Line of the source.
        construct: The construct, with its types where they matter.
        instead: The form to write instead.
    """

    def __init__(self, file: str, line: int, construct: str, instead: str) -> None:
        """Make the message from its four parts."""
        super().__init__(f"{file}:{line}: {construct}. {instead}")
        self.file, self.line, self.construct, self.instead = file, line, construct, instead


class JoinError(Exception):
    """Two types without a common type."""


class Scalar(IntEnum):
    """Type of a number. The larger of two types holds both values of an operation."""

    BOOL = 0
    INT = 1
    FLOAT = 2
    COMPLEX = 3


class Element(Enum):
    """Type of an array's elements: type in C, type of the number that is read, name."""

    FLAG = ("bool", Scalar.BOOL, "Flag")
    BYTE = ("int8_t", Scalar.INT, "Byte")
    INT = ("int64_t", Scalar.INT, "Int")
    FLOAT = ("double", Scalar.FLOAT, "Float")
    COMPLEX = ("double _Complex", Scalar.COMPLEX, "Complex")

    @property
    def c(self) -> str:
        """Type in C."""
        return self.value[0]

    @property
    def scalar(self) -> Scalar:
        """Type of the number that is read."""
        return self.value[1]


@dataclass(frozen=True)
class Nothing:
    """Type of None."""


@dataclass(frozen=True)
class ArrayType:
    """An array: a pointer and its sizes, in C order; strides only for views that are not contiguous.

    Attributes:
        element: Type of the elements.
        rank: Number of axes.
        strided: True for a view with a stride for each axis.
        constant: True if no element may be written.
    """

    element: Element
    rank: int
    strided: bool = False
    constant: bool = False


@dataclass(frozen=True)
class TupleType:
    """A tuple or NamedTuple: a struct.

    Attributes:
        name: Class of a NamedTuple with its module; "" for a plain tuple.
        fields: Names of the fields.
        types: Types of the fields.
    """

    name: str
    fields: tuple[str, ...]
    types: tuple[Type, ...]


Type = Scalar | ArrayType | TupleType | Nothing
NONE: Final = Nothing()
C_SCALARS: Final = {
    Scalar.BOOL: "bool",
    Scalar.INT: "int64_t",
    Scalar.FLOAT: "double",
    Scalar.COMPLEX: "double _Complex",
}


def plain_tuple(*types: Type) -> TupleType:
    """Type of a tuple without names."""
    return TupleType("", tuple(f"f{k}" for k in range(len(types))), types)


def join(first: Type | None, second: Type) -> Type:
    """Smallest type that holds values of both; None means that there is no value yet."""
    if first is None or first == second:
        return second
    if isinstance(first, Scalar) and isinstance(second, Scalar):
        return max(first, second)
    if isinstance(first, ArrayType) and isinstance(second, ArrayType):
        if (first.element, first.rank) == (second.element, second.rank):
            strided, constant = first.strided or second.strided, first.constant or second.constant
            return ArrayType(first.element, first.rank, strided, constant)
    elif isinstance(first, TupleType) and isinstance(second, TupleType) and len(first.types) == len(second.types):
        types = tuple(join(one, other) for one, other in zip(first.types, second.types, strict=True))
        if first.name == second.name:
            return TupleType(first.name, first.fields, types)
        return plain_tuple(*types)
    raise JoinError(f"{words(first)} and {words(second)}")


def words(type_: Type) -> str:
    """Name of a type for messages."""
    if isinstance(type_, Scalar):
        return type_.name.lower()
    if isinstance(type_, ArrayType):
        return f"array of {type_.element.name.lower()}, {type_.rank}-d"
    if isinstance(type_, TupleType):
        return type_.name.rpartition(".")[2] or f"tuple ({', '.join(words(each) for each in type_.types)})"
    return "None"


def holds_array(type_: Type) -> bool:
    """True for an array, and for a tuple that contains one."""
    return isinstance(type_, ArrayType) or (isinstance(type_, TupleType) and any(map(holds_array, type_.types)))
