"""Hook of the build: a wheel contains the library of compiled kernels, if a C compiler can build it."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from typing import Any, Final

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

LATER: Final = os.environ.get("SAGLINE_BUILD") == "later"  # `make env` builds in its own environment


class Hook(BuildHookInterface[Any]):
    """Builds the library before the files of a wheel are collected."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the library; a wheel that contains it is for this platform and any version of Python."""
        if LATER:
            return
        # another process, because the translator imports the package
        command = [sys.executable, "-m", "tools.build"]
        if subprocess.run(command, cwd=self.root, stdout=sys.stderr, check=False).returncode == 0:
            build_data["pure_python"] = False
            platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
            build_data["tag"] = f"py3-none-{platform}"
