"""C of the entries that `sagline export-c` writes, as data of the package: `python -m tools.translate.portable`.

Each struct, table and function is a part with the names that it defines. `sagline.files.c_source` copies the parts that
a robot needs. Sizes and indices have 32 bits, and the data of the robot and of the pose are constant.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from tools.translate import signatures as s
from tools.translate.program import Program
from tools.translate.text import HEAD, HELPERS, MATH
from tools.translate.types import NONE, ArrayType, Type, plain_tuple

KERNELS: Final = "sagline.kernels."
COMMENT: Final = re.compile(r"/\*.*?\*/", re.DOTALL)
NUMBER: Final = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)")
FUNCTION: Final = re.compile(rf"\b({'|'.join([*MATH, 'ceil', 'fabs', 'floor', 'fmod', 'pow', 'rint'])})\(")
FILE: Final = Path("src/sagline/files/c/kernels.json")
K1, K2, K3 = (ArrayType(each.element, each.rank, constant=True) for each in (s.F1, s.F2, s.F3))
DISTRIBUTION: Final = plain_tuple(s.INT, s.FLOAT, s.INT, K1, K1)
INVERSE: Final = (s.MODEL, DISTRIBUTION, s.LIMITS, plain_tuple(K2, K2, K3), K2, K2, s.F1, s.MEMORY)
ANSWERS: Final = (s.ANSWERS, s.INT, s.INT)
FORWARD: Final = (s.BOOL, plain_tuple(K2, K2, K3, K2, K2, K2), s.CHAIN, s.MEMORY, s.FOUND)
# constants of the kernels that follow from the rounding of numbers, for single precision
SINGLE: Final = {
    "algebra.bounds.TOLERANCE": 2e-6,
    "algebra.eigenvalues.STILL": 1e-7,
    "algebra.factors.LEAST_PIVOT": 1e-6,
    "algebra.factors.RANK": 2e-5,
    "algebra.linear_program.PIVOT": 1e-5,
    "algebra.linear_program.ROUNDING": 2e-7,
    "algebra.nearest_point.DEPENDENT": 1e-5,
    "balance.setting.SHORTEST_CHORD": 1e-6,
    "cable.catenary.SMALL_HALLEY_STEP": 1e-4,
    "cable.catenary.SMALL_NEWTON_STEP": 1e-4,
    "cable.catenary.SPLIT": 4097.0,
    "cable.forces.MISSED": 1e-6,
    "cable.over_pulleys.TINY": 1e-30,
    "cable.states.LIMIT_PRECISION": 1e-6,
    "cable.states.SAME_SAG_FORCE": 2e-7,
    "forward.forward.FLAT": 1e-5,
    "forward.newton.BALANCED": 1e-3,
    "forward.newton.LAST_DIGIT": 5e-7,
    "forward.newton.NOISE": 2e-6,
    "forward.newton.SMALLEST_RADIUS": 1e-6,
    "inverse.iterations.SAG_ROUNDING": 5e-7,
    "inverse.iterations.SLOPE_STEP": 1e-2,
    "inverse.iterations.TENSION_CONVERGED": 1e-5,
    "tension.centers.CENTERED": 1e-9,
    "tension.centers.THIN": 1e-5,
    "tension.norms.STILL": 1e-6,
    "tension.norms.TIED": 1e-5,
    "tension.on_polygon.PARALLEL": 1e-6,
    "tension.on_polygon.TIED": 1e-5,
    "tension.other_methods.DEPENDENT": 1e-5,
    "tension.polygon.FLAT": 1e-6,
}
ENTRIES: Final[tuple[tuple[str, str, tuple[Type, ...]], ...]] = (
    ("inverse_poses", "inverse_nearest", (*INVERSE, NONE, *ANSWERS)),
    ("inverse_poses", "inverse_by_method", (*INVERSE, s.BOOL, *ANSWERS)),
    ("forward_poses", "forward_bare", (s.FORWARD, *FORWARD)),
    ("forward_poses", "forward_over_pulleys", (s.FORWARD_PULLEYS, *FORWARD)),
)


def parts() -> Iterator[tuple[list[str], str]]:
    """Names and text of each part, in the order in which C needs them; no names for what every source begins with."""
    program = Program()
    for entry, symbol, types in ENTRIES:
        program.export(s.functions()[entry], types, symbol)
    yield [], HEAD.removesuffix(HELPERS).partition("*/\n\n")[2]
    for paragraph in HELPERS.strip().split("\n\n"):
        yield re.findall(r"^(?:SL_HELPER|#define)\b.*?(\w+)\(", paragraph, re.MULTILINE), paragraph + "\n"
    for name, text in program.parts():
        yield [name], text


@contextmanager
def single_constants() -> Iterator[None]:
    """The constants of the kernels for single precision, in all modules that use them."""
    s.functions()
    places = [module for name, module in sys.modules.items() if name.startswith(KERNELS)]
    old = {key: getattr(sys.modules[KERNELS + key.rpartition(".")[0]], key.rpartition(".")[2]) for key in SINGLE}
    uses = [
        (module, key) for key, value in old.items() for module in places
        if vars(module).get(key.rpartition(".")[2]) is value
    ]  # fmt: skip
    for module, key in uses:
        setattr(module, key.rpartition(".")[2], SINGLE[key])
    try:
        yield
    finally:
        for module, key in uses:
            setattr(module, key.rpartition(".")[2], old[key])


def in_single(text: str) -> str:
    """The same text with numbers and functions of single precision; comments stay."""
    comments, code = COMMENT.findall(text), COMMENT.split(text)
    found = [FUNCTION.sub(r"\1f(", NUMBER.sub(r"\1F", part.replace("double", "float"))) for part in code]
    return "".join(each for pair in zip(found, [*comments, ""], strict=True) for each in pair)


def is_stale(root: Path) -> bool:
    """True if the data are missing, or older than a kernel or the translator."""
    sources = [*(root / "src/sagline/kernels").rglob("*.py"), *(root / "tools/translate").glob("*.py")]
    file = root / FILE
    return not file.exists() or file.stat().st_mtime < max(each.stat().st_mtime for each in sources)


def build(root: Path) -> None:
    """Write the data of the package below a source tree."""
    double = list(parts())
    with single_constants():
        single = [(names, in_single(text)) for names, text in parts()]
    found = {
        name: [(names, text.replace("int64_t", "int32_t")) for names, text in part]
        for name, part in (("double", double), ("float", single))
    }
    (root / FILE).write_text(json.dumps(found, indent=0), encoding="utf-8")


if __name__ == "__main__":
    build(Path(sys.argv[1] if sys.argv[1:] else "."))
