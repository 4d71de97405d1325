"""C compilers of this machine. They compile exported sources and, in the source tree, the kernels of the package."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from sagline.core.errors import FileError

FLAGS: Final = (
    "-std=c99", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off", "-fvisibility=hidden", "-shared",
)  # fmt: skip
ZIG: Final = [sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline", "-s"]


def compilers() -> list[list[str]]:
    """Commands of the C compilers that can be used, the preferred one first."""
    named = [shlex.split(os.environ["CC"])] if os.environ.get("CC") else []
    found = [[path] for name in ("cc", "gcc", "clang") if (path := shutil.which(name))]
    return named + found[:1] + ([ZIG] if find_spec("ziglang") else [])


def library_command(compiler: list[str], source: Path, library: Path, *options: str) -> list[str]:
    """Command that compiles a source to a shared library, with the same digits as the kernels of the package."""
    before, after = ((), ()) if sys.platform == "win32" else (("-fPIC",), ("-lm",))
    return [*compiler, *FLAGS, *before, *options, str(source), "-o", str(library), *after]


def compile_library(source: Path, library: Path, file: Path, *options: str) -> None:
    """Compile a source with the first compiler that can. FileError, with the name of the result `file`, if none can."""
    chosen = options or ("-O2",)
    reasons = ["no C compiler is found"]
    for compiler in compilers():
        try:
            done = subprocess.run(library_command(compiler, source, library, *chosen), capture_output=True, text=True)
        except OSError as error:
            reasons.append(f"{shlex.join(compiler)}: {error}")
            continue
        if done.returncode == 0:
            return
        reasons.append(f"{shlex.join(compiler)}: {(done.stderr.splitlines() or ['no message'])[0]}")
    step = "Install gcc or clang, or the Python package ziglang."
    raise FileError(file, f"cannot be compiled ({reasons[-1]})", step)
