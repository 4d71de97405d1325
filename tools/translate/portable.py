"""C of the entries that exported sources contain, as data of the package: `python -m tools.translate.portable`.

Each struct, table and function is a part with the names that it defines. `sagline.files.c_source` copies the parts that
a robot needs. Sizes and indices have 32 bits, and the data of the robot and of the pose are constant.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from typing import Any, Final

from sagline.kernels import codes, tables
from sagline.kernels.cable.geometry import CABLE_ROWS
from tools.translate import signatures as s
from tools.translate.bounds import Bounds
from tools.translate.extents import (
    CABLES,
    FLAG,
    FLOAT,
    FREEDOMS,
    NOTHING,
    Array,
    Int,
    Other,
    Polynomial,
    Record,
    Value,
    exactly,
)
from tools.translate.program import Program
from tools.translate.text import HEAD, HELPERS, MATH
from tools.translate.types import NONE, ArrayType, Type, plain_tuple

Terms = list[tuple[int, int, int]]  # powers of freedoms and redundant cables, coefficient
KERNELS: Final = "sagline.kernels."
COMMENT: Final = re.compile(r"/\*.*?\*/", re.DOTALL)
NUMBER: Final = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)")
FUNCTION: Final = re.compile(rf"\b({'|'.join([*MATH, 'ceil', 'fabs', 'floor', 'fmod', 'pow', 'rint'])})\(")
FILE: Final = Path("src/sagline/files/c/kernels.json")
K1, K2, K3 = (ArrayType(each.element, each.rank, constant=True) for each in (s.F1, s.F2, s.F3))
DISTRIBUTION: Final = plain_tuple(s.INT, s.FLOAT, s.INT, K1, K1)
INVERSE: Final = (s.MODEL, DISTRIBUTION, s.LIMITS, plain_tuple(K2, K2, K3), K2, K2, s.F1, s.MEMORY)
ANSWERS: Final = (s.ANSWERS, s.INT, s.INT)
LOADS: Final = (plain_tuple(s.FLOAT, s.FLOAT), K2, K1, K2, s.F1, s.F2, s.F2, s.F2, s.F2)
FORWARD: Final = (s.BOOL, plain_tuple(K2, K2, K3, K2, K2, K2), s.CHAIN, s.MEMORY, s.FOUND)
# constants of the kernels that follow from the rounding of numbers, for single precision
SINGLE: Final = {
    "algebra.bounds.TOLERANCE": 2e-6,
    "algebra.factors.STILL": 1e-7,
    "algebra.factors.LEAST_PIVOT": 1e-6,
    "algebra.factors.RANK": 2e-5,
    "algebra.programs.PIVOT": 1e-5,
    "algebra.programs.ROUNDING": 2e-7,
    "algebra.programs.DEPENDENT": 1e-5,
    "tables.SHORTEST_CHORD": 1e-6,
    "cable.states.SMALLEST": 1e-30,
    "cable.models.SMALL_HALLEY_STEP": 1e-4,
    "cable.models.SMALL_NEWTON_STEP": 1e-4,
    "cable.models.SPLIT": 4097.0,
    "cable.forces.MISSED": 1e-6,
    "cable.forces.TINY": 1e-30,
    "cable.states.LIMIT_PRECISION": 1e-6,
    "cable.states.SAME_EXIT": 1e-5,
    "forward.forward.FLAT": 1e-5,
    "forward.newton.BALANCED": 1e-3,
    "forward.newton.LAST_DIGIT": 5e-7,
    "forward.newton.NOISE": 2e-6,
    "forward.newton.SMALLEST_RADIUS": 1e-6,
    "inverse.poses.SAG_ROUNDING": 5e-7,
    "inverse.poses.SLOPE_STEP": 1e-2,
    "inverse.poses.TENSION_CONVERGED": 1e-5,
    "tension.other_methods.CENTERED": 1e-9,
    "tension.other_methods.THIN": 1e-5,
    "tension.nearest.STILL": 1e-6,
    "tension.nearest.TIED": 1e-5,
    "tension.on_polygon.PARALLEL": 1e-6,
    "tension.on_polygon.TIED": 1e-5,
    "tension.other_methods.DEPENDENT": 1e-5,
    "tension.polygon.FLAT": 1e-6,
}
OMITTED: Final = {"tables.SWIVELS": False, "tables.MOVES": False}  # code that no exported source needs
ENTRIES: Final[tuple[tuple[str, str, tuple[Type, ...]], ...]] = (
    ("inverse_poses", "inverse_nearest", (*INVERSE, NONE, NONE, *ANSWERS)),
    ("inverse_poses", "inverse_by_method", (*INVERSE, s.BOOL, NONE, *ANSWERS)),
    ("forward_poses", "forward_bare", (s.FORWARD, *FORWARD)),
    ("forward_poses", "forward_over_pulleys", (s.FORWARD_PULLEYS, *FORWARD)),
)
RUN: Final = (*s.RUN[:2], plain_tuple(K2, K1, K1, K2), K2, *s.RUN[4:], s.INT, s.INT)
SIMULATION: Final[tuple[tuple[str, str, tuple[Type, ...]], ...]] = (  # of `sagline.fmu`, in double precision only
    ("begin_period", "begin_period", s.SIGNATURES["begin_period"][""]),
    ("run_massless", "run_bare", (plain_tuple(*s.DYNAMIC_MODEL, NONE), *RUN)),
    ("run_massless", "run_over_pulleys", (plain_tuple(*s.DYNAMIC_MODEL, s.BOOL), *RUN)),
    ("platform_state", "platform_state", s.SIGNATURES["platform_state"][""]),
)
ENGINES: Final[tuple[tuple[str, str, tuple[Type, ...]], ...]] = (  # of `sagline.mujoco`, in double precision only
    ("cable_loads", "loads_bare", (plain_tuple(*s.DYNAMIC_MODEL, NONE), *LOADS)),
    ("cable_loads", "loads_over_pulleys", (plain_tuple(*s.DYNAMIC_MODEL, s.BOOL), *LOADS)),
)


def parts(entries: tuple[tuple[str, str, tuple[Type, ...]], ...]) -> Iterator[tuple[list[str], str]]:
    """Names and text of each part, in the order of C; the common beginning of all sources has no names."""
    program = Program()
    for entry, symbol, types in entries:
        program.export(s.functions()[entry], types, symbol)
    yield [], HEAD.removesuffix(HELPERS).partition("*/\n\n")[2]
    for paragraph in HELPERS.strip().split("\n\n"):
        yield re.findall(r"^(?:SL_HELPER|#define)\b.*?(\w+)\(", paragraph, re.MULTILINE), paragraph + "\n"
    for name, text in program.parts():
        yield [name], text


@contextmanager
def constants(values: Mapping[str, float]) -> Iterator[None]:
    """Other values of constants of the kernels, in all modules that use them."""
    s.functions()
    places = [module for name, module in sys.modules.items() if name.startswith(KERNELS)]
    old = {key: getattr(sys.modules[KERNELS + key.rpartition(".")[0]], key.rpartition(".")[2]) for key in values}
    uses = [
        (module, key) for key, value in old.items() for module in places
        if vars(module).get(key.rpartition(".")[2]) is value
    ]  # fmt: skip
    for module, key in uses:
        setattr(module, key.rpartition(".")[2], values[key])
    try:
        yield
    finally:
        for module, key in uses:
            setattr(module, key.rpartition(".")[2], old[key])


def in_single(text: str) -> str:
    """The same text with numbers and functions of single precision; comments do not change."""
    comments, code = COMMENT.findall(text), COMMENT.split(text)
    found = [FUNCTION.sub(r"\1f(", NUMBER.sub(r"\1F", part.replace("double", "float"))) for part in code]
    return "".join(each for pair in zip(found, [*comments, ""], strict=True) for each in pair)


def is_stale(root: Path) -> bool:
    """True if the data are missing, or older than a kernel or the translator."""
    sources = [*(root / "src/sagline/kernels").rglob("*.py"), *(root / "tools/translate").glob("*.py")]
    file = root / FILE
    return not file.exists() or file.stat().st_mtime < max(each.stat().st_mtime for each in sources)


def bounds() -> dict[str, dict[int, dict[str, Terms]]]:
    """Operations and work memory of each entry by the code of the method (0 for forward), as polynomials."""
    free, cables, one = exactly(FREEDOMS), exactly(CABLES), exactly(1)
    robot = (_floats(free, exactly(6)), _floats(one, exactly(5)), _floats(one, cables, exactly(tables.CABLE_COLUMNS)))
    pose, wrench, body = _floats(one, exactly(tables.POSE_COLUMNS)), _floats(one, exactly(6)), _floats(cables)
    memory = _record(Array((Int(),), True, "numbers"), Array((Int(),), False, "counters"))
    codes_, results = Array((one, cables), False), _floats(exactly(tables.RESULT_ROWS), one, cables)
    answers = _record(results, codes_, _floats(one, exactly(2)), _floats(one, free), Array((one,), False))
    model, limits = (exactly(codes.CATENARY), FLOAT, FLOAT), _record(Int(), FLOAT)
    chain = _record(_floats(exactly(CABLE_ROWS), cables), _floats(free, free), _floats(exactly(tables.LAST_COLUMNS)))
    samples = _record(*robot, _floats(one, cables), pose, wrench)
    found = _record(pose, results, codes_, _floats(one, exactly(tables.FORWARD_NUMBERS)), Array((one,), False))
    inverse, forward = s.functions()["inverse_poses"], s.functions()["forward_poses"]
    every: dict[str, dict[int, dict[str, Terms]]] = {}
    for symbol, last, otherwise in (("inverse_nearest", 2, NOTHING), ("inverse_by_method", 11, FLAG)):
        for code in range(last + 1):
            method = _record(exactly(code), FLOAT, Int(), body, body)
            given = (
                _record(*model),
                method,
                limits,
                _record(*robot),
                pose,
                wrench,
                body,
                memory,
                otherwise,
                NOTHING,
                answers,
            )
            every.setdefault(symbol, {})[code] = _bounds_of(inverse, (*given, exactly(0), one))
    for symbol, behind in (("forward_bare", NOTHING), ("forward_over_pulleys", Other("flag", True))):
        given_ = (_record(*model, behind), Other("flag", False), samples, chain, memory, found)
        every[symbol] = {0: _bounds_of(forward, given_)}
    return every


def _bounds_of(entry: FunctionType, arguments: tuple[Value, ...]) -> dict[str, Terms]:
    """Bounds of one entry in the form of the data."""
    found = Bounds()
    _, operations = found.call(entry, arguments)
    return {name: _terms(each) for name, each in {**found.memory, "operations": operations}.items()}


def _terms(bound: Polynomial) -> Terms:
    return [(i, j, value) for (i, j), value in bound.terms]


def _floats(*sizes: Int) -> Array:
    return Array(sizes, True)


def _record(*items: Value) -> Record:
    return Record(("",) * len(items), items)


def build(root: Path) -> None:
    """Write the data of the package below a source tree."""
    with constants(OMITTED):
        double = list(parts((*ENTRIES, *SIMULATION, *ENGINES)))
    with constants({**SINGLE, **OMITTED}):
        single = [(names, in_single(text)) for names, text in parts(ENTRIES)]
    found: dict[str, Any] = {
        name: [(names, text.replace("int64_t", "int32_t")) for names, text in part]
        for name, part in (("double", double), ("float", single))
    }
    found["bounds"] = bounds()
    file = root / FILE
    unfinished = file.with_name(f"{file.name}.{os.getpid()}")
    unfinished.write_text(json.dumps(found, indent=0), encoding="utf-8")
    os.replace(unfinished, file)


if __name__ == "__main__":
    build(Path(sys.argv[1] if sys.argv[1:] else "."))
