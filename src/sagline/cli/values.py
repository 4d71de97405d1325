"""Numbers, loads and boxes of the command line: "20 kg", "2 %", "±100 N, ±20 N m", "-2..2, -1..1, 1..3 m"."""

from __future__ import annotations

import re
from math import prod
from typing import Any, Final, cast

import numpy as np

import sagline as sl
from sagline.core.arrays import FARTHEST, checked
from sagline.files.quantity import in_si, wrench_of_text
from sagline.files.quantity import pose_of_text as pose_of_text

MOST_POSES = 1_000_000  # largest number of poses on a grid
HEAVIEST = 1e12  # [kg], larger than on any machine, and far below the overflow of numbers

_KINDS: Final = {"force": "N", "moment": "N m", "linear": "m/s^2", "angular": "rad/s^2"}  # kinds of loads and units
_SIGN: Final = re.compile(r"\s*(?:±|\+/-|\+-)\s*")
_SPAN: Final = re.compile(r"(.*?)(?:\.\.|\bto\b)(.*)", re.DOTALL)
_UNIT: Final = re.compile(r"(?!e[-+]?[0-9])[a-zµ].*", re.IGNORECASE | re.DOTALL)  # an exponent (e3) is not a unit
_POINTS: Final = re.compile(r"([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})")
_STEP: Final = "Give forces, moments and accelerations with units: --loads '±100 N, ±20 N m'."
_LONGEST: Final = 200  # largest number of characters of the text of a set of loads or of a box


def quantity(text: str, item: str, unit: str, *, low: float = -np.inf, above: float = -np.inf) -> float:
    """A number in SI units from "20" or "20 kg"; it is at least `low` and greater than `above`."""
    number = cast(float, in_si(text, unit, item))
    if abs(number) > HEAVIEST:
        raise sl.InvalidValueError(item, repr(text), f"up to {HEAVIEST:g} {unit}", f"Correct {item}.")
    return float(checked(number, item, unit, shape=(), low=low, above=above))


def ratio(text: str, item: str) -> float:
    """A nonnegative ratio from "0.02" or "2 %"."""
    number, percent = text.strip().removesuffix("%"), text.strip().endswith("%")
    return quantity(number, item, "", low=0.0) / (100.0 if percent else 1.0)


def wrenches_of(text: str, item: str) -> sl.WrenchSet:
    """A set of loads: "±100 N, ±20 N m", "±2 m/s^2", or one wrench from "fx,fy,fz[,mx,my,mz]"."""
    # a single force, moment or acceleration holds for all axes; three forces or moments hold for x, y and z
    if len(text) > _LONGEST or not _SIGN.match(text):
        if "±" in text or len(text) > _LONGEST:
            raise sl.InvalidValueError(item, repr(text), "all with ±, or all without", _STEP)
        return sl.WrenchPolytope([cast(Any, wrench_of_text(text, item, _STEP))])
    found: dict[str, list[float]] = {kind: [] for kind in _KINDS}
    for part in text.split(","):
        kind, size = _load_of(part, item)
        found[kind].append(size)
    for kind, sizes in found.items():
        most = (0, 1, 3) if kind in ("force", "moment") else (0, 1)
        if len(sizes) not in most:
            allowed = f"{' or '.join(map(str, most[1:]))} of the unit {_KINDS[kind]}"
            raise sl.InvalidValueError(item, f"{text!r} with {len(sizes)}", allowed, _STEP)
    box = {kind: found[kind] if len(found[kind]) > 1 else sum(found[kind]) for kind in ("force", "moment")}
    whole: sl.WrenchSet = sl.WrenchBox(box["force"], box["moment"])
    if found["linear"] or found["angular"]:
        whole = whole + sl.Accelerations(sum(found["linear"]), sum(found["angular"]))
    return whole


def _load_of(part: str, item: str) -> tuple[str, float]:
    """The kind of a load (force, moment, acceleration) and its size in SI units."""
    sign = _SIGN.match(part)
    if sign is not None and _UNIT.search(part) is not None:
        for kind, unit in _KINDS.items():
            try:
                size = in_si(part[sign.end() :], unit, item)
            except sl.InvalidValueError:
                continue
            if isinstance(size, float) and 0.0 <= size < np.inf:
                return kind, size
    units = ", ".join(_KINDS.values())
    raise sl.InvalidValueError(item, repr(part.strip()), f"± and a number with one of the units {units}", _STEP)


def points_of(text: str, item: str) -> tuple[int, ...]:
    """Point counts of a grid along x, y and z, from "20x15x8"."""
    found = _POINTS.fullmatch(text.strip())
    points = tuple(map(int, found.groups())) if found else (0,)
    if not 0 < prod(points) <= MOST_POSES:
        step = f"Give the points along x, y and z: {item} 20x15x8."
        raise sl.InvalidValueError(item, repr(text), f"NXxNYxNZ, 1 to {MOST_POSES:,} poses", step)
    return points


def box_of(text: str, item: str) -> sl.PoseBox:
    """A box of level poses from "-2..2, -1..1, 1..3 m". A single number in place of a span makes it flat."""
    step = f'Give x, y and z, each from..to: {item} "-2..2, -1..1, 1..3 m".'
    parts = text.replace("−", "-").split(",")
    if len(parts) != 3 or len(text) > _LONGEST:
        raise sl.InvalidValueError(item, repr(text), "three spans between commas", step)
    unit = _UNIT.search(_ends_of(parts[2])[1])
    ends = []
    for part in parts:
        own = _ends_of(part)
        last = _UNIT.search(own[1]) or unit
        shared = " m" if last is None else f" {last[0]}"
        ends.append([quantity(end if _UNIT.search(end) else end + shared, item, "m") for end in own])
    low, high = np.array(ends).T
    if (low > high).any() or np.abs(ends).max() > FARTHEST:
        raise sl.InvalidValueError(item, repr(text), f"from low to high, up to {FARTHEST:g} m", step)
    return sl.PoseBox(low, high)


def _ends_of(part: str) -> tuple[str, str]:
    span = _SPAN.fullmatch(part.strip())
    return (span[1].strip(), span[2].strip()) if span else (part.strip(), part.strip())
