"""What a file in NetCDF is of: a plan, a simulation, and what to say where it is neither."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline.core.errors import FileError
from sagline.files.seal import Seal

OTHERS: Final = {
    "sagline_format": ("a plan", "Read it with load_plan, or look at it: sagline view ROBOT FILE."),
    "sagline_simulation_format": ("a simulation", "Read it with load_simulation, or play it: sagline view ROBOT FILE."),
    "sagline_execution_format": ("an execution", "Open it with xarray.open_dataset; its plan is its group 'plan'."),
    "sagline_workspace_format": ("a workspace", "Read it with load_workspace."),
    "sagline_calibration_format": ("a calibration", "Read it with load_calibration."),
    "sagline_frequency_map_format": ("a frequency map", "Open it with xarray.open_dataset."),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Content:
    """One kind of content, in a reader's words.

    Attributes:
        name: What it is called: "plan".
        made: What a file of it is: "run of sagline track".
        give: Which file to give: "Give the .nc file that sagline track wrote."
        again: What to do about a damaged file.
        key: The attribute that has its format.
        version: Newest version of the format; raised whenever an older sagline could misread the file.
    """

    name: str
    made: str
    give: str
    again: str
    key: str
    version: int

    def format_of(self, path: Path, attributes: Mapping[str, Any]) -> int:
        """The format of a file.

        Args:
            path: The file.
            attributes: Of its data set.

        Returns:
            The format, from 1 on.

        Raises:
            FileError: If it is of something else, or of a format that this sagline does not read.
        """
        found = attributes.get(self.key)
        if found is None:
            raise FileError(path, *self._instead(attributes))
        if not isinstance(found, int | np.integer) or found < 1:
            step = "Write it again; it was edited, or damaged."
            raise FileError(path, f"is of format {found!r}, which never was", step, item=self.key)
        if found > self.version:
            raise FileError(
                path,
                f"is of format {found}, written by {attributes.get('source')}; this is sagline {version('sagline')}, "
                f"which reads up to {self.version}",
                "Install a newer sagline.",
                item=self.key,
            )
        return int(found)

    def _instead(self, attributes: Mapping[str, Any]) -> tuple[str, str]:
        """What a file is of instead, and what to do with it."""
        for key, (what, step) in OTHERS.items():
            if key in attributes:
                return f"is {what} of sagline, no {self.name}", step
        return f"is no {self.name} of sagline, it names no {self.key}", "Check that this is the file you mean."

    def check_sealed(self, path: Path, found: Seal) -> None:
        """Refuse a file without a digest.

        Args:
            path: The file.
            found: What its end says.

        Raises:
            FileError: If it has none.
        """
        if found is Seal.MISSING:
            raise FileError(path, "is not as it was written: its digest is missing", self.again, item="digest")

    def attributes(self, title: str) -> dict[str, Any]:
        """What every file of it says of itself.

        Args:
            title: Of this file.
        """
        return {"title": title, "source": f"sagline {version('sagline')}", self.key: self.version}
