"""A workspace as a data set over positions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.workspaces.space import Workspace

if TYPE_CHECKING:
    from xarray import Dataset


def field_of(space: Workspace) -> Dataset:
    """Level, margin, deciding criterion and cable at the nodes of a workspace's grid.

    Args:
        space: The workspace.

    Returns:
        Data set with dimensions x, y and z [m].
    """
    from xarray import Dataset

    shape = space.level.shape
    found = space.levels().details(np.stack(np.meshgrid(*space.axes, indexing="ij"), axis=-1).reshape(-1, 3))
    titles = ", ".join(f"{k}: {one.title}" for k, one in enumerate(space.criteria))
    about = {
        "level": {"units": "1", "long_name": "least value of the criteria over their scales, >= 0 inside"},
        "margin": {"units": "N", "long_name": "margin of the loads"},
        "criterion": {"long_name": f"criterion that decides ({titles})"},
        "cable": {"long_name": "cable that decides, -1 for none"},
    }
    values = {name: (("x", "y", "z"), getattr(found, name).reshape(shape), about[name]) for name in about}
    axes = {name: (name, axis, {"units": "m"}) for name, axis in zip("xyz", space.axes, strict=True)}
    return Dataset(values, axes, {"title": f"Workspace of {space.robot.name}"})
