"""Invalid values in place of a valid argument, for each kind of argument, with the expected verdict."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pint
from matplotlib.figure import Figure

import sagline as sl
from sagline.core.results import Result, Tabular

REFUSED, SAME, EITHER = "refused", "the same answer", "refused or answered"
UNITS: pint.UnitRegistry[Any] = pint.UnitRegistry()


class Bad(NamedTuple):
    """A value and its expected verdict."""

    label: str
    value: Any
    verdict: str


class Foreign:
    """An array of another library, with the array protocol of NumPy."""

    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return np.array(self.values, dtype=dtype)


class Unconvertible:
    """An object that raises an error in every conversion."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        raise RuntimeError("these numbers are on another machine\nand stay there")

    def __repr__(self) -> str:
        raise RuntimeError("no text either")


def bad_values(kind: str, valid: Any, optional: bool) -> Iterator[Bad]:
    """All values for one argument.

    Args:
        kind: Kind of the argument: the name of one of the functions below.
        valid: A valid value.
        optional: True if the argument can be None.

    Yields:
        Values, each with its verdict.
    """
    yield Bad("None", None, EITHER if optional else REFUSED)
    for label, value in (
        ("an object", object()),
        ("a stubborn object", Unconvertible()),
        ("bytes", b"1.0"),
        ("a number with an imaginary part", 1.0 + 2.0j),
        ("a class", sl.Straight),
        ("an ellipsis", ...),
        ("a set", {"a", "b"}),
        ("nested lists", [[[["a"]]]]),
        ("an array without axes", np.array("a")),
        ("a long text", "nothing" * 100),
        ("a text that does not print", "\x1b[31m\n\ud800"),
    ):
        if not (kind in ("text",) and isinstance(value, str)) and not (kind == "file" and isinstance(value, str)):
            yield Bad(label, value, EITHER if kind == "index" and value is ... else REFUSED)
    for bad in KINDS[kind](valid):
        yield Bad(bad.label, bad.value, EITHER) if _is_also_taken(bad.value, valid) else bad


def _is_also_taken(value: Any, valid: Any) -> bool:
    """True for positions in place of poses, and for a result with a state in place of an equilibrium."""
    if isinstance(valid, sl.Pose | sl.Path):
        return isinstance(value, list | tuple | np.ndarray)
    return isinstance(valid, sl.Equilibrium) and isinstance(getattr(value, "state", None), sl.Equilibrium)


def _array(valid: Any) -> Iterator[Bad]:
    """Numbers of any shape."""
    v = np.asarray(valid, dtype=np.float64)
    first = v.reshape(-1)[:1]
    spoiled = {name: v.copy() for name in ("nan", "inf", "minus inf", "1e308", "minus 1e308", "1e200")}
    for (name, array), number in zip(spoiled.items(), (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e200), strict=True):
        array.reshape(-1)[:1] = number
        yield Bad(name, array, EITHER if name in ("nan", "inf") else REFUSED)
    masked = np.ma.MaskedArray(v, mask=np.zeros(v.shape, dtype=bool))
    yield Bad("nothing masked", masked.copy(), SAME)
    masked.mask.reshape(-1)[:1] = True
    yield Bad("something masked", np.ma.MaskedArray(v, mask=masked.mask), REFUSED if v.size else EITHER)
    listed = v.tolist()
    yield from (
        Bad("complex", v + 1j, REFUSED),
        Bad("complex, real", v.astype(complex), REFUSED),
        Bad("text of numbers", v.astype(str), REFUSED),
        Bad("objects of text", v.astype(str).astype(object), REFUSED),
        Bad("all None", np.full(v.shape, None), REFUSED),
        Bad("ragged", [[1.0], [1.0, 2.0]], REFUSED),
        Bad("a list in itself", _endless(), REFUSED),
        Bad("dates", v.astype("int64").astype("datetime64[s]"), REFUSED),
        Bad("durations", v.astype("int64").astype("timedelta64[s]"), REFUSED),
        Bad("records", np.zeros(v.shape, dtype=[("a", float)]), REFUSED),
        Bad("a generator", (x for x in v.reshape(-1)), REFUSED),
        Bad("a dictionary", OrderedDict(a=1.0), REFUSED),
        Bad("too large an integer", 10**400, REFUSED),
        Bad("beyond the range of doubles", np.full(v.shape, np.longdouble("1e4000")), EITHER),
        Bad("millimeters", UNITS.Quantity(v, "mm"), REFUSED),
        Bad("more than memory", np.broadcast_to(v, (10**13, *v.shape)), REFUSED),
        Bad("a range more than memory", range(10**15), REFUSED),
        Bad("a list", listed, SAME),
        Bad("in Fortran's order", np.array(v, order="F"), SAME),
        Bad("big-endian", v.astype(">f8"), SAME),
        Bad("long doubles", v.astype(np.longdouble), SAME),
        Bad("objects", v.astype(object), SAME),
        Bad("another library's", Foreign(v), SAME),
        Bad("every second", np.repeat(v, 2, axis=-1)[..., ::2] if v.ndim else v, SAME),
        Bad("decimals", np.array([Decimal(repr(x)) for x in v.reshape(-1).tolist()]).reshape(v.shape), SAME),
        Bad("booleans", v.astype(bool), EITHER),
        Bad("a truth value", True, EITHER),
        Bad("nothing", [], EITHER),
        Bad("nothing in many axes", np.empty((0, 3, 0)), EITHER),
        Bad("negative", -v, EITHER),
        Bad("zero", 0.0 * v, EITHER),
        Bad("tiny", 1e-320 * np.ones(v.shape), EITHER),
        Bad("huge", 1e40 * v, EITHER),
        Bad("one axis more", v[None], EITHER),
        Bad("five axes more", v[None, None, None, None, None], EITHER),
        Bad("one entry more", np.concatenate((v.reshape(-1), first)), EITHER),
        Bad("turned", v.T[::-1] if v.ndim else v, EITHER),
        Bad("twice", np.stack((v, v)), EITHER),
    )


def _tensions(valid: Any) -> Iterator[Bad]:
    """Nonnegative numbers."""
    for bad in _array(valid):
        yield bad._replace(verdict=REFUSED) if bad.label == "negative" else bad


def _sample(valid: Any) -> Iterator[Bad]:
    """Numbers of a control loop: a status reports values out of range."""
    for bad in _array(valid):
        if "inf" in bad.label or "1e" in bad.label:
            yield bad._replace(verdict=EITHER)
        else:
            yield bad


def _number(valid: Any) -> Iterator[Bad]:
    """A single number."""
    for bad in _array(valid):
        if bad.label in ("one axis more", "five axes more", "one entry more", "twice") or bad.label == "nan":
            yield bad._replace(verdict=REFUSED)
        elif bad.label != "turned":
            yield bad


def _endless() -> list[Any]:
    values: list[Any] = []
    values.append(values)
    return values


def _whole(valid: Any) -> Iterator[Bad]:
    """A whole number."""
    wrong: tuple[Any, ...] = (
        2.5,
        float(valid),
        "3",
        True,
        np.True_,
        -1,
        np.nan,
        [valid],
        np.array([valid]),
        Decimal(3),
    )
    for value in (*wrong, -(10**30)):
        yield Bad(f"{value!r}", value, REFUSED)
    yield Bad("more than memory", 10**14, REFUSED)
    yield Bad("more digits than a text may have", 10**5000, REFUSED)
    same: tuple[Any, ...] = (np.int64(valid), np.uint8(valid), np.array(valid))
    for value in same:
        yield Bad(f"a whole number of numpy: {value!r}", value, SAME)


def _flag(valid: Any) -> Iterator[Bad]:
    """True or False."""
    wrong: tuple[Any, ...] = ("no", "", 0, 1, 0.0, [], [valid], np.array(valid), np.array([valid]), np.nan)
    for value in wrong:
        yield Bad(f"{value!r}", value, REFUSED)
    yield Bad("a truth value of numpy", np.bool_(valid), SAME)


def _flag_or_whole(valid: Any) -> Iterator[Bad]:
    """True or False, or a whole number."""
    wrong: tuple[Any, ...] = ("no", "", 2.5, 0.0, -1, [], [valid], np.array(valid), np.array([valid]), np.nan, 10**9)
    for value in wrong:
        yield Bad(f"{value!r}", value, REFUSED)


def _entry(valid: Any) -> Iterator[Bad]:
    """A whole number; -1 is the last entry."""
    yield from (bad for bad in _whole(valid) if bad.label != "-1")


def _methods(valid: Any) -> Iterator[Bad]:
    """One or several tension distribution methods."""
    yield from _object(valid)
    for other in ([valid, 3], [None], [[valid]], {0: valid}, [], ()):
        yield Bad(f"{other!r:.40}", other, REFUSED)
    yield Bad("one in a list", [valid], EITHER)


def _wholes(valid: Any) -> Iterator[Bad]:
    """A given number of positive whole numbers."""
    first = list(valid)
    wrong: tuple[Any, ...] = (
        3, "9x7x5", np.array(3), [], first[:-1], [*first, 1], [-1, *first[1:]], [0, *first[1:]], [2.5, *first[1:]],
        ["2", *first[1:]], [True, *first[1:]], [first] * 3, {1: 2, 2: 3, 3: 4}, [10**9] * len(first), [None] * 3,
        [np.nan, *first[1:]],
    )  # fmt: skip
    for value in wrong:
        yield Bad(f"{value!r:.40}", value, REFUSED)
    same: tuple[Any, ...] = (first, np.array(first))
    for value in same:
        yield Bad(f"the same: {value!r}", value, SAME)


def _cables(valid: Any) -> Iterator[Bad]:
    """Indices of cables without repetition."""
    wrong: tuple[Any, ...] = (
        3,
        "0",
        np.array(0),
        [],
        [-1],
        [0, 0],
        [0.0],
        ["0"],
        [True],
        [[0]],
        {0: 1},
        [10**30],
        [None],
    )
    for value in wrong:
        yield Bad(f"{value!r}", value, REFUSED)
    for value in (tuple(valid), np.array(valid)):
        yield Bad(f"the same: {value!r}", value, SAME)


def _groups(valid: Any) -> Iterator[Bad]:
    """Indices of cables in groups."""
    wrong: tuple[Any, ...] = (
        3,
        "01",
        np.array(0),
        (),
        ((),),
        ((0, 1),),
        (*valid, (0,)),
        ((0, 0),),
        (("0",),),
        ((0.0,),),
    )
    for value in (*wrong, ((9,),), ((-1,),), (None,), {0: 1}, ([[0]],)):
        yield Bad(f"{value!r}", value, REFUSED)


def _several(valid: Any) -> Iterator[Bad]:
    """A sequence of objects of one kind."""
    yield from (bad for bad in _object(list(valid)) if bad.label not in ("its class", "its name", "an empty list"))
    yield Bad("one", valid[0], EITHER)
    for other in ([*valid, 3], [None], [[valid[0]]], {0: valid[0]}, type(valid[0]), [type(valid[0])]):
        yield Bad(f"{other!r:.40}", other, REFUSED)
    yield Bad("a tuple", tuple(valid), SAME)


def _texts(valid: Any) -> Iterator[Bad]:
    """One or several texts of a small language."""
    for value in (3, True, "nothing", [3], [None], {"a": 1}, [[valid]], np.array(3.0), [valid, "nothing"]):
        yield Bad(f"{value!r}", value, REFUSED)


def _address(_: Any) -> Iterator[Bad]:
    """The address of a scheduler."""
    for value in (3, True, "", "host", "tcp://", "tcp://host", "tcp://host:0", "tcp://host:99999", ["tcp://host:1"]):
        yield Bad(f"{value!r}", value, REFUSED)


def _table(valid: Any) -> Iterator[Bad]:
    """A table in time: times and rows of values."""
    time, rows = (np.asarray(part, dtype=np.float64) for part in valid)
    wrong: tuple[Any, ...] = (
        3.0, "a", np.array(3.0), (time,), (time, rows, rows), (rows, time), (time[::-1], rows), (time, rows[:-1]),
        (time, rows[:, :-1]), (np.full(2, np.nan), rows), (time, np.full(rows.shape, np.inf)), ([], []),
        (time, "a"), {"time": time}, (time, None), (0.0 * time, rows), (time[:, None], rows),
    )  # fmt: skip
    for value in wrong:
        yield Bad(f"{value!r:.40}", value, REFUSED)


def _recorder(_: Any) -> Iterator[Bad]:
    """A receiver of cycles."""
    wrong: tuple[Any, ...] = (3, True, "log", [], np.array(3.0))
    for value in wrong:
        yield Bad(f"{value!r}", value, REFUSED)


def _cable(valid: Any) -> Iterator[Bad]:
    """The index of a cable."""
    yield from _whole(valid)
    yield Bad("one too many", 8, REFUSED)


def _seed(valid: Any) -> Iterator[Bad]:
    """A seed: a whole number of any size."""
    yield from (bad for bad in _whole(valid) if not bad.label.startswith("more"))


def _index(valid: Any) -> Iterator[Bad]:
    """An index along a batch of three."""
    wrong: tuple[Any, ...] = (
        (0, 1), 1.5, "a", 3, -4, 10**30, [3], [0.5], [[0]], [True], np.zeros(4, bool), np.zeros((3, 1), bool), "0",
        slice("a", None), slice(0, 1, 0), np.array([0.0]), np.datetime64("2020-01-01"), True, ["0"], {0: 1},
        (i for i in (0,)),
    )  # fmt: skip
    for value in wrong:
        yield Bad(f"{value!r}", value, REFUSED)
    for value in (np.int64(valid), np.array(valid), -3):
        yield Bad(f"the same: {value!r}", value, SAME)
    for value in ([], slice(5, 9), np.array([], dtype=int), [0, -1], np.ones(3, bool), slice(None, None, -1)):
        yield Bad(f"{value!r}", value, EITHER)


def _word(valid: Any) -> Iterator[Bad]:
    """One of a set of words."""
    for value in (3, "", valid.upper() + "x", [valid], (valid,), np.array([valid, valid]), valid.encode(), True):
        yield Bad(f"{value!r}", value, REFUSED)
    yield Bad("a text of numpy", np.str_(valid), SAME)


def _words(valid: Any) -> Iterator[Bad]:
    """Several words of a set, without repetition."""
    for value in (3, [], list(valid) * 2, "linear_density", [3], [None], [[valid[0]]], ["mass"], {valid[0]: 1}):
        yield Bad(f"{value!r}", value, REFUSED)
    yield Bad("a tuple", tuple(valid), SAME)


def _text(valid: Any) -> Iterator[Bad]:
    """Any text."""
    wrong: tuple[Any, ...] = (3, True, [valid], np.array(valid), Path("name"))
    for value in wrong:
        yield Bad(f"{value!r}", value, REFUSED)
    for text in ("", "a" * 3000, "\x1b[31m\n\ud800", "../../evil"):
        yield Bad(f"{text!r:.20}", text, EITHER)


def _file(valid: Any) -> Iterator[Bad]:
    """The name of a file."""
    values: tuple[Any, ...] = (
        3,
        True,
        "",
        " ",
        "\0",
        "nothing/at/all.x",
        "a" * 3000,
        ".",
        Path("."),
        [str(valid)],
        Path,
    )
    for value in values:
        yield Bad(f"{value!r:.20}", value, REFUSED)
    yield Bad("a path", Path(valid), SAME)


def _folder(valid: Any) -> Iterator[Bad]:
    """The name of a folder; the folder and its parents are created."""
    yield from (bad for bad in _file(valid) if not isinstance(bad.value, Path) and "." not in bad.label)


def _callback(_: Any) -> Iterator[Bad]:
    """A function that receives the progress."""
    for value in (True, 3, "print", [print], 0):
        yield Bad(f"{value!r}", value, REFUSED)


def _mapping(valid: Any) -> Iterator[Bad]:
    """Names with their values."""
    key, value = next(iter(valid.items()))
    for wrong in (3, True, [(key, value)], {key: object()}, {key: b"a"}, [key]):
        yield Bad(f"{wrong!r:.40}", wrong, REFUSED)
    yield Bad("in order", OrderedDict(valid), SAME)


def _object(valid: Any) -> Iterator[Bad]:
    """An object of a type of sagline."""
    kind = type(valid)
    yield Bad("its class", kind, REFUSED)
    yield Bad("its name", kind.__name__, REFUSED)
    yield Bad("two in a list", [valid, 3], REFUSED)
    yield Bad("an empty list", [], REFUSED)
    yield Bad("0", 0, REFUSED)
    yield Bad("an empty text", "", REFUSED)
    yield Bad("False", False, REFUSED)
    yield Bad("(1, 1, 2)", (1, 1, 2), REFUSED)
    yield Bad("an array", np.ones((3, 3)), REFUSED)
    yield Bad("a number of numpy", np.float64(3.0), REFUSED)
    hollow = np.empty((), dtype=object)
    hollow[()] = valid
    yield Bad("an object in an array without axes", hollow, REFUSED)
    for other in strangers():
        related = {*type(other).__bases__} & {*kind.__bases__} - {object, Result, Tabular}  # another model or method
        if not isinstance(other, kind) and not related:
            yield Bad(f"a {type(other).__name__}", other, REFUSED)


def _objects(valid: Any) -> Iterator[Bad]:
    """One object, several objects or none."""
    yield from (bad for bad in _object(valid) if bad.label != "an empty list")


def _one(valid: Any) -> Iterator[Bad]:
    """An object; a sequence of objects is invalid."""
    yield from _object(valid)
    yield Bad("one in a list", [valid], REFUSED)


def _place(valid: Any) -> Iterator[Bad]:
    """A state in place of a pose or of a position."""
    for bad in _one(valid):
        if isinstance(bad.value, tuple):
            yield bad._replace(verdict=EITHER)
        elif not isinstance(bad.value, sl.Pose):
            yield bad


def _motion(valid: Any) -> Iterator[Bad]:
    """A pose or a path."""
    yield from (bad for bad in _one(valid) if not isinstance(bad.value, sl.Pose | sl.Path))


def _out(valid: Any) -> Iterator[Bad]:
    """An array for the results."""
    size = len(valid)
    locked = np.empty(size)
    locked.flags.writeable = False
    for label, value in (
        ("write-locked", locked),
        ("integers", np.empty(size, dtype=np.int64)),
        ("complex", np.empty(size, dtype=complex)),
        ("single precision", np.empty(size, dtype=np.float32)),
        ("too short", np.empty(size - 1)),
        ("too long", np.empty(size + 1)),
        ("one number", np.array(1.0)),
        ("a list", [0.0] * size),
        ("a number", 3.0),
    ):
        yield Bad(label, value, REFUSED)


def _ax(valid: Any) -> Iterator[Bad]:
    """Flat axes of matplotlib."""
    yield from _one(valid)
    yield Bad("a figure", valid.figure, REFUSED)
    yield Bad("deep axes", Figure().add_subplot(projection="3d"), REFUSED)
    yield Bad("round axes", Figure().add_subplot(projection="polar"), REFUSED)


def _points(valid: Any) -> Iterator[Bad]:
    """Tensions by name."""
    name, tensions = next(iter(valid.items()))
    yield from (bad for bad in _mapping(valid))
    for label, value in (("too few", tensions[:3]), ("a batch", np.stack((tensions, tensions))), ("one number", 1.0)):
        yield Bad(label, {name: value}, REFUSED)
    yield Bad("not known", {name: np.full(len(tensions), np.nan)}, EITHER)
    yield Bad("none at all", {}, EITHER)


def strangers() -> list[Any]:
    """One object of each type of sagline, created once."""
    if not _STRANGERS:
        robot = sl.load_robot("cogiro")
        pose = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
        plan = sl.inverse(robot, pose)
        path = sl.quintic_path([(0, 0, 1.5), (1, 1, 2)], durations=1.0, rate=3.0)
        _STRANGERS.extend((robot, robot.cables, pose, plan, plan.state, plan.state.cables, path, sl.confirm(plan)))
        _STRANGERS.extend((sl.Catenary(), sl.MinimumNorm(), sl.PoseBox([0, 0, 0], [1, 1, 1]), sl.Winch()))
    return _STRANGERS


_STRANGERS: list[Any] = []
KINDS = {
    name.removeprefix("_"): function
    for name, function in globals().items()
    if function in (_flag, _flag_or_whole, _wholes, _cables, _groups, _several, _texts, _address, _table,
                    _recorder, _tensions, _folder, _entry, _methods,
                    _array, _number, _whole, _cable, _seed, _index, _word, _words, _text, _file, _callback, _mapping,
                    _object, _objects, _one, _place, _motion, _out, _ax, _points, _sample)
}  # fmt: skip
