"""Workspaces in NetCDF: surface, grid, what limits them where, loads and criteria, and the robot inside."""

from __future__ import annotations

import json
import os
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.cables.models import MODELS
from sagline.core.arrays import locked
from sagline.files.criteria_attributes import criteria_attributes, criteria_of
from sagline.files.dataset import labeled_dataset
from sagline.files.format import Format
from sagline.files.plan_file import choice_attributes, choice_of
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import Quantity
from sagline.files.workspace_checks import check_workspace
from sagline.files.workspace_layout import QUANTITIES, TYPES
from sagline.robot.pose import Pose
from sagline.robot.pose_box import PoseBox
from sagline.tension.methods import METHODS
from sagline.workspaces.components import Components
from sagline.workspaces.nearest import Nearest
from sagline.workspaces.orientations import Orientations
from sagline.workspaces.space import Workspace
from sagline.workspaces.surface import Surface
from sagline.workspaces.wrench_sets import WrenchSet

if TYPE_CHECKING:
    from xarray import Dataset


def load_workspace(file: os.PathLike[str] | str) -> Workspace:
    """Read a workspace that its `save` wrote: the same workspace to the last bit.

    Args:
        file: The NetCDF file.

    Returns:
        The workspace.

    Raises:
        FileError: If the file is missing, cut off, no NetCDF file, no workspace, of a newer format, or not as it was
            written: its digest, shapes and units are checked.

    Examples:
        >>> import sagline as sl
        >>> sl.workspace(sl.load_robot("ipanema-1"), cells=8).save("workspace.nc")
        >>> print(sl.load_workspace("workspace.nc").robot.name)
        ipanema-1
    """
    return FORMAT.load(file)


def pack(space: Workspace) -> Dataset:
    """Data set of a workspace."""
    variables: dict[str, Any] = {one.name: (one.parts, _wide(one, one.of(space)), one.attributes) for one in QUANTITIES}
    attributes, obstacles = criteria_attributes(space.criteria)
    return labeled_dataset(variables | obstacles, _attributes(space) | attributes)


def _wide(quantity: Quantity, values: Any) -> Any:
    """Indices of any size as those of 64 bits."""
    return np.asarray(values).astype(np.int64) if quantity.values is int else values


def _attributes(space: Workspace) -> dict[str, Any]:
    attributes = {
        **FORMAT.attributes(f"Workspace of {space.robot.name}"),
        "volume": space.volume,
        "volume_error": space.volume_error,
        "volume_units": space.unit,
        "box_low": space.box.low,
        "box_high": space.box.high,
        "box_units": "m",
        "box_tilt": space.box.tilt,
        "box_tilt_units": "rad",
        "need": space.orientations.need,
        "open_faces": ", ".join(space.open_faces),
        **choice_attributes("model", space.model, MODELS),
        **choice_attributes("tension", space.tension, METHODS),
        "robot": dump_robot(space.robot),
    }
    if space.moment_arm is not None:
        attributes |= {"moment_arm": space.moment_arm, "moment_arm_units": "m"}
    if space.nearest is not None:
        near = space.nearest
        attributes["nearest"] = json.dumps(
            {
                "position": near.pose.position.tolist(),
                "quaternion": near.pose.quaternion.tolist(),
                "level": near.level,
                "margin": near.margin,
                "criterion": near.criterion,
                "cables": list(near.cables),
                "reason": near.reason,
            }
        )
    return attributes


def unpack(path: FilePath, data: Dataset) -> Workspace:
    """The workspace of a data set; its path is for messages."""
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, robot")
    check_workspace(data, robot.cable_count)

    def values(name: str) -> Any:
        found = np.asarray(data[name].values, order="C")
        return locked(found.astype(TYPES[name]) if name in TYPES else found)

    attributes = data.attrs
    loads, components = (
        [one.name for one in QUANTITIES if one.place.startswith(part)] for part in ("wrenches.", "components.")
    )
    arm = attributes.get("moment_arm")
    return Workspace(
        robot=robot,
        box=PoseBox(attributes["box_low"], attributes["box_high"], float(attributes["box_tilt"])),
        wrenches=WrenchSet(*map(values, loads)),
        orientations=Orientations._of(values("rotation"), attributes["need"]),
        criteria=criteria_of(path, data),
        model=choice_of(path, data.attrs, "model", MODELS),
        tension=choice_of(path, data.attrs, "tension", METHODS),
        moment_arm=None if arm is None else float(arm),
        unit=attributes["volume_units"],
        volume=float(attributes["volume"]),
        volume_error=float(attributes["volume_error"]),
        components=Components(*map(values, components)),
        surface=Surface(values("vertex_position"), values("face")),
        limiting=values("limiting"),
        limiting_cable=values("limiting_cable"),
        margin=values("margin"),
        open_faces=tuple(attributes["open_faces"].split(", ")) if attributes["open_faces"] else (),
        x=values("x"),
        y=values("y"),
        z=values("z"),
        level=values("level"),
        nearest=_nearest(attributes["nearest"]) if "nearest" in attributes else None,
    )


def _nearest(text: str) -> Nearest:
    found = json.loads(text)
    pose = Pose._adopt(np.array(found.pop("position")), np.array(found.pop("quaternion")))
    return Nearest(pose=pose, **{**found, "cables": tuple(found["cables"])})


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


FORMAT: Final = Format(
    kind=Workspace,
    name="workspace",
    made="workspace of sagline",
    give="Give the .nc file that sagline workspace wrote, or a workspace's save.",
    again="Save the workspace again, or take the file from where it came.",
    key="sagline_workspace_format",
    version=1,
    pack=pack,
    unpack=unpack,
)
save = FORMAT.save
