"""`python -m tools.javascript [FOLDER]`: the package for JavaScript, in the format of npm, into dist or FOLDER.

The package contains the two files that shared pages use, sagline.mjs and kernels.wasm, the license, and package.json.
"""

from __future__ import annotations

import gzip
import io
import json
import sys
import tarfile
from pathlib import Path
from typing import Any, Final

from sagline import __version__
from sagline.share.packing import MODULE, SCRIPT, check_module

ROOT: Final = Path(__file__).parents[1]


def description() -> dict[str, Any]:
    """Content of package.json."""
    return {
        "name": "sagline",
        "version": __version__,
        "description": "Kinematics of cable-driven parallel robots whose cables sag",
        "license": "MIT",
        "type": "module",
        "exports": {".": "./sagline.mjs", "./kernels.wasm": "./kernels.wasm"},
        "files": ["sagline.mjs", "kernels.wasm"],
        "sideEffects": False,
    }


def pack(folder: Path) -> Path:
    """Write the package into a folder; equal contents give equal bytes."""
    check_module()
    content = {
        "package.json": json.dumps(description(), indent=2).encode() + b"\n",
        "sagline.mjs": SCRIPT.read_bytes(),
        "kernels.wasm": MODULE.read_bytes(),
        "LICENSE": (ROOT / "LICENSE").read_bytes(),
    }
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"sagline-{__version__}.tgz"
    with (
        file.open("wb") as raw,
        gzip.GzipFile(fileobj=raw, mode="wb", mtime=0, filename="") as packed,
        tarfile.open(fileobj=packed, mode="w") as archive,
    ):
        for name, data in content.items():
            about = tarfile.TarInfo(f"package/{name}")
            about.size, about.mode = len(data), 0o644
            archive.addfile(about, io.BytesIO(data))
    return file


if __name__ == "__main__":
    made = pack(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist")
    print(f"{made}: {made.stat().st_size / 1e3:.0f} kB")
