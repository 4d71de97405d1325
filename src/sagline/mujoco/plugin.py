"""The engine plug-in `sagline.cables` of MuJoCo: the translated kernels and `cables.c`, compiled on this machine."""

from __future__ import annotations

import ctypes
import os
import re
import sys
from hashlib import sha256
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any, Final

from sagline.core.arguments import file_path
from sagline.core.errors import FileError
from sagline.files.c_source import reached_parts, translated_kernels
from sagline.files.compilers import compile_library
from sagline.files.writing import atomic_files, create_folder
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry
from sagline.kernels.dynamics import drives
from sagline.kernels.library import SUFFIX
from sagline.kernels.sources import base_folder

NAME: Final = "sagline.cables"  # of the plug-in in MuJoCo
LIBRARY: Final = f"sagline_cables{SUFFIX}"
CALLED: Final = ("loads_bare", "loads_over_pulleys", "models_catenary_end")  # kernels that cables.c calls
NUMBERS: Final = {"codes": codes, "drives": drives, "geometry": geometry, "tables": tables}


def mujoco_module() -> Any:
    """The module mujoco; FileError if the package is not installed."""
    try:
        return import_module("mujoco")
    except ModuleNotFoundError:
        raise FileError.not_installed("mujoco", "Models for MuJoCo need it", "mujoco") from None


def build_plugin(folder: str | os.PathLike[str]) -> Path:
    """Compile the plug-in `sagline.cables` for the installed MuJoCo and for this kind of machine.

    Another program loads the library with `mj_loadPluginLibrary`, or from its folder of plug-ins. A file in MJCF can
    then name the plug-in. In Python, `attach` and `model_of` compile and load the plug-in themselves.

    Args:
        folder: Folder for the library; it is created if it does not exist. An existing library is replaced.

    Returns:
        Path of the library.

    Raises:
        FileError: If mujoco is not installed, no C compiler is found, or the file cannot be written.

    Examples:
        >>> import sagline as sl
        >>> library = sl.mujoco.build_plugin("plugins")
        >>> library.stem
        'sagline_cables'
    """
    place = file_path(folder, "folder", folder=True)
    return _built(place, _source())


def load_plugin() -> None:
    """Make the plug-in `sagline.cables` known to MuJoCo in this process. It is compiled at its first use.

    Raises:
        FileError: If mujoco is not installed, no C compiler is found, or the file cannot be written.

    Examples:
        >>> import sagline as sl
        >>> sl.mujoco.load_plugin()
    """
    mujoco = mujoco_module()
    engine = ctypes.CDLL(str(_engine()))
    engine.mjp_getPlugin.restype = ctypes.c_void_p
    if engine.mjp_getPlugin(NAME.encode(), None):  # MuJoCo accepts each name once
        return
    mujoco.mj_loadPluginLibrary(str(library()))


def library() -> Path:
    """The library in the cache of this user, compiled if it is missing."""
    source = _source()
    key = sha256(f"{_engine()} {mujoco_module().__version__} {source}".encode()).hexdigest()
    place = base_folder().parent / "mujoco" / key[:16]
    return place / LIBRARY if (place / LIBRARY).is_file() else _built(place, source)


def _engine() -> Path:
    """The library of the engine, which the installed package contains."""
    folder = Path(mujoco_module().__file__).parent
    return next(each for each in sorted(folder.iterdir()) if re.match(r"(lib)?mujoco\.(so\.|.*dylib$|dll$)", each.name))


def _source() -> str:
    """C source of the plug-in."""
    kernels = reached_parts(translated_kernels()["double"], CALLED)
    words = {f"{name}.{key}": str(value) for name, module in NUMBERS.items() for key, value in vars(module).items()}
    words["pair"] = re.findall(r"static (\w+) models_catenary_end\(", kernels)[0]
    text = files("sagline.mujoco").joinpath("cables.c").read_text(encoding="utf-8")
    own = re.sub(r"@([\w.]+)@", lambda found: words[found[1]], text)
    return f"#include <mujoco/mujoco.h>\n#include <string.h>\n\n{kernels}\n{own}"


def _built(folder: Path, source: str) -> Path:
    """Compile a source to the library in a folder."""
    engine = _engine()
    link = ("-Wl,--no-as-needed",) if sys.platform == "linux" else ()
    with atomic_files(create_folder(folder), [LIBRARY]) as (partial,):
        text = partial.with_suffix(".c")
        text.write_text(source, encoding="utf-8")
        compile_library(text, partial, folder / LIBRARY, "-O3", *link, f"-I{engine.parent / 'include'}", str(engine))
        text.unlink()
    return folder / LIBRARY
