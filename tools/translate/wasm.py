"""WebAssembly of the kernels that the pages of `sagline share` and docs/explore.md call."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Final

from tools.translate.program import translate
from tools.translate.signatures import entries

PREFIX: Final = "sagline_"
ENTRIES: Final = (
    "inverse_poses", "decide_poses", "forward_poses", "forward_poses_pulleys", "cable_courses",
    "batch_from_tension", "shape_points", "largest_sags",
)  # fmt: skip
FLAGS: Final = ("-std=c99", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off")
SMALL: Final = "-Os"  # a quarter smaller than -O2, and as fast
MODULE: Final = Path("src/sagline/share/page/kernels.wasm")


@cache
def source() -> str:
    """C of the entries."""
    symbols = {PREFIX + name for name in ENTRIES}
    return translate(each for each in entries() if each[2] in symbols)


def compile_c(text: str, target: str, out: Path, *options: str) -> None:
    """Compile C by the compiler in the package ziglang, with the C library of a target; write the file atomically."""
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".kernels") as folder:
        code, made = Path(folder) / "kernels.c", Path(folder) / out.name
        code.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, *FLAGS, *options]
        subprocess.run([*command, str(code), "-o", str(made), "-lm"], check=True)
        os.replace(made, out)


def build(root: Path) -> None:
    """Write the module of a source tree."""
    exports = [f"-Wl,--export={PREFIX}{name}" for name in ENTRIES]
    compile_c(source(), "wasm32-wasi", root / MODULE, SMALL, "-mexec-model=reactor", "-Wl,--strip-all", *exports)


if __name__ == "__main__":
    build(Path(__file__).resolve().parents[2])
