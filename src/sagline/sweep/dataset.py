"""A sweep as a data set of xarray, whose arrays stay on the disk."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sagline.files.variables import PARTS
from sagline.sweep.folder import GROUP
from sagline.sweep.request import Request

if TYPE_CHECKING:
    from xarray import Dataset


def dataset_of(folder: Path, request: Request) -> Dataset:
    """All variables of a sweep, with labels.

    Args:
        folder: Where it is.
        request: What was asked.

    Returns:
        Data set with the dimensions robot, pose, wrench and cable; nothing is read before it is used.
    """
    import xarray

    data: Dataset = xarray.open_zarr(
        folder / GROUP, chunks=None, consolidated=False, zarr_format=3, mask_and_scale=False
    )
    labels = {"robot": [robot.name for robot in request.robots], "cable": list(range(request.cable_count))}
    labels |= {part: list(PARTS[part]) for part in ("axis", "quaternion_part", "wrench_part")}
    return data.assign_coords({name: values for name, values in labels.items() if name in data.dims})
