"""A sweep as a data set of xarray, whose arrays stay on the disk."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sagline.files.sweep_folder import GROUP
from sagline.files.variables import PARTS

if TYPE_CHECKING:
    from xarray import Dataset

    from sagline.sweep.result import Sweep


def dataset_of(sweep: Sweep) -> Dataset:
    """All variables of a sweep, with labels.

    Args:
        sweep: The sweep.

    Returns:
        Data set with the dimensions robot, pose, wrench and cable; nothing is read before it is used.
    """
    import xarray

    place = sweep.folder / GROUP
    data: Dataset = xarray.open_zarr(place, chunks=None, consolidated=False, zarr_format=3, mask_and_scale=False)
    labels = {"robot": [robot.name for robot in sweep.request.robots], "cable": range(sweep.request.cable_count)}
    labels |= {part: list(PARTS[part]) for part in ("axis", "quaternion_part", "wrench_part")}
    return data.assign_coords({name: list(values) for name, values in labels.items() if name in data.dims})
