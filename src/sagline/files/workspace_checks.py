"""Whether a file's workspace hangs together: its shapes, units and indices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arguments import choice
from sagline.core.arrays import number
from sagline.files.variable_checks import check_indices, check_labels, check_variable
from sagline.files.workspace_layout import QUANTITIES

if TYPE_CHECKING:
    from xarray import Dataset

UNITS = ("m³", "m²")


def check_workspace(data: Dataset, cables: int) -> None:
    """Refuse a data set that is no workspace, whatever its file looked like.

    Args:
        data: The data set.
        cables: How many its robot has.

    Raises:
        KeyError: If a variable or attribute is missing.
        InvalidValueError: If one is not what the layout says; the message names its first wrong value.
    """
    choice(data.attrs["volume_units"], "volume_units", UNITS)
    choice(data.attrs["need"], "need", ("all", "any"))
    for name in ("volume", "volume_error", "box_tilt"):
        number(data.attrs[name], name, "", low=0.0)
    check_labels(data)
    sizes = {str(name): size for name, size in data.sizes.items()} | {"corner": 3, "column": 6, "acceleration_part": 2}
    for quantity in QUANTITIES:
        check_variable(quantity, data.variables[quantity.name], (), sizes, np.array(True))
    criteria = sum(f"criterion_{k}" in data.attrs for k in range(len(data.attrs)))
    for name, low, high in (
        ("face", 0, sizes["vertex"]),
        ("limiting", -1, criteria),
        ("limiting_cable", -1, cables),
        ("vertex_component", 0, sizes["component"]),
        ("component_nodes", -1, sizes["component"]),
    ):
        check_indices(name, data.variables[name].values, low, high)
