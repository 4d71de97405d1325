"""`python -m tools.build`: build what the package contains in addition to Python, if it is not up to date.

Building needs a C compiler: the compiler in the environment variable CC, `cc`, or the compiler of the package ziglang.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
# flags of the two files; gcc 12 contracts one expression in spite of -ffp-contract=off
LEVELS: Final = (("-O2",), ("-O3", "-march=x86-64-v3", "-mno-fma"))
ZIG_LEVELS: Final = (("-O3",),)  # only the file for every processor: zig cannot detect the kind of processor


class BuildError(Exception):
    """The kernels cannot be built; the text gives the reason."""


def build() -> None:
    """Build the library of the kernels, for every processor and x86-64-v3, the module for pages, and C for controllers.

    Raises:
        BuildError: If no compiler is found, or none compiles.
    """
    os.environ["SAGLINE_BACKEND"] = "python"  # the translator reads the sources
    from sagline.files.compilers import compilers
    from sagline.kernels.library import FILES, FOLDER
    from sagline.kernels.sources import digest, digest_of_kernels
    from tools.translate import portable, wasm
    from tools.translate.library import library_text

    files = [FOLDER / name for name in FILES[: 2 if is_x86() else 1]]
    stamp = ROOT / "build" / "kernels.stamp"
    translator = [Path(__file__), *(ROOT / "tools" / "translate").glob("*.[pc]*")]
    state = f"{digest_of_kernels()} {digest(ROOT, translator)} {[shlex.join(each) for each in compilers()]}"
    made = [files[0], ROOT / portable.FILE, *([ROOT / wasm.MODULE] if find_spec("ziglang") else [])]
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == state and all(file.is_file() for file in made):
        return
    for folder in (FOLDER, stamp.parent):
        folder.mkdir(exist_ok=True)
    for old in FOLDER.iterdir():
        old.unlink()
    stamp.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory() as temporary, ThreadPoolExecutor(1) as pool:
        source = Path(temporary) / "kernels.c"
        source.write_text(library_text(digest_of_kernels()), encoding="utf-8")
        others = [portable.build, *([wasm.build] if find_spec("ziglang") else [])]
        waiting = [pool.submit(each, ROOT) for each in others]  # one after the other, while the compiler runs
        _compile(source, files)
        for each in waiting:
            each.result()
    stamp.write_text(state, encoding="utf-8")


def is_x86() -> bool:
    """True if the processor is of the family x86-64."""
    return platform.machine().lower() in ("x86_64", "amd64")


def _compile(source: Path, files: list[Path]) -> None:
    """Compile the files at the same time, with the first compiler that can compile them."""
    from sagline.files.compilers import ZIG, compilers, library_command

    reasons = []
    for command in compilers():
        start = time.monotonic()
        print(f"building the kernels with {shlex.join(command)} (about a minute) ...", flush=True)
        levels = ZIG_LEVELS if command is ZIG else LEVELS if len(files) > 1 else (("-O3",),)
        made = {source.with_suffix(f".{k}{file.suffix}"): file for k, file in enumerate(files[: len(levels)])}
        try:
            calls = [
                subprocess.Popen(
                    library_command(command, source, out, *level),
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                )
                for level, out in zip(levels, made, strict=True)
            ]
        except OSError as error:
            reasons.append(f"{shlex.join(command)}: {error}")
            continue
        texts = [call.communicate()[0] for call in calls]
        failed = [text[:1000] or "no message" for text, call in zip(texts, calls, strict=True) if call.returncode]
        if not failed:
            for out, file in made.items():
                unfinished = file.with_name(f"{file.name}.{os.getpid()}")
                shutil.copyfile(out, unfinished)
                os.replace(unfinished, file)
            names = ", ".join(file.name for file in made.values())
            print(f"built {names} in {time.monotonic() - start:.0f} s", flush=True)
            return
        reasons.append(f"{shlex.join(command)}: {failed[0]}")
    raise BuildError("\n".join(reasons) or "no C compiler is found: install one (gcc or clang), or set CC")


def main() -> int:
    """Build. Exit code 2, with the reason on standard error, if the build is not possible."""
    sys.path[:0] = [str(ROOT), str(ROOT / "src")]
    from tools.translate.types import TranslationError

    try:
        build()
    except (BuildError, TranslationError, subprocess.CalledProcessError) as error:
        lines = [str(error), *getattr(error, "__notes__", ())]
        text = "The kernels were not built; numba or, about 500 times slower, plain Python runs them."
        print("\n".join([text, *lines]), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
