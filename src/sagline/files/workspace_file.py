"""Workspaces in NetCDF: surface, grid, limiting criteria, loads, obstacles, and the robot."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from attrs import fields

from sagline.cables.models import models_by_name
from sagline.core.arguments import choice
from sagline.core.arrays import locked, number
from sagline.files.netcdf import Format, choice_attributes, choice_of
from sagline.files.robot_file import parse_robot
from sagline.files.variables import Quantity, check_indices, check_variables, fields_of, variables_of_result
from sagline.interference.obstacles import Box, Capsule, Mesh, Sphere
from sagline.kinematics.inverse_rows import CODES, Given
from sagline.robot.pose import Pose, PoseBox
from sagline.tension.methods import methods_by_name
from sagline.workspaces import criteria
from sagline.workspaces.criterion import Criterion
from sagline.workspaces.levels import Nearest
from sagline.workspaces.region import Orientations
from sagline.workspaces.surface import Components, Surface
from sagline.workspaces.workspace import Workspace
from sagline.workspaces.wrench_sets import WrenchSet

if TYPE_CHECKING:
    from xarray import Dataset

_CRITERIA: Final[tuple[type[Criterion], ...]] = (
    *(criteria.LeastMargin, criteria.MaximumSag, criteria.PositionError, criteria.LeastStiffness),
    *(criteria.LeastFrequency, criteria.Clearance, criteria.InFrame),
)
CRITERIA: Final = {kind.__name__: kind for kind in _CRITERIA}
NODES: Final = ("x", "y", "z")  # coordinates of the nodes of the grid
FINE: Final = ("fine_x", "fine_y", "fine_z")  # coordinates of the finer grid on which components are separated

ACCELERATION: Final = ("acceleration_part",)
COMPONENT, WRENCH, ELLIPSOID = ("component",), ("wrench_part",), ("ellipsoid", "wrench_part", "column")
SEPARATE: Final = "true if the component is proved to be separate"
QUANTITIES: Final = (
    *(Quantity(name, (name,), "m", f"{name} of the nodes of the grid") for name in NODES),
    Quantity("level", NODES, "1", "least value of the criteria over their scales, >= 0 inside", infinite=True),
    Quantity("vertex_position", ("vertex", "axis"), "m", "vertices of the surface", "surface.vertices"),
    Quantity("face", ("side", "corner"), "", "vertices of each triangle, outward", "surface.faces", values=int),
    Quantity("limiting", ("vertex",), "", "limiting criterion at the vertex, -1 for the box", values=int),
    Quantity("limiting_cable", ("vertex",), "", "limiting cable at the vertex, -1 for none", values=int),
    Quantity("margin", ("vertex",), "N", "margin of the loads at the vertex", infinite=True),
    Quantity("component_volume", ("component",), "", "volume of each component, in volume_units", "components.volume"),
    Quantity("vertex_component", ("vertex",), "", "component of each vertex", "components.vertices", values=int),
    *(Quantity(fine, (fine,), "m", f"{fine[-1]} of the finer nodes", f"components.{fine[-1]}") for fine in FINE),
    Quantity("component_nodes", FINE, "", "component of each finer node, -1 outside", "components.nodes", values=int),
    Quantity("component_separate", COMPONENT, "", SEPARATE, "components.separate", values=bool),
    Quantity("rotation", ("turn", "quaternion_part"), "1", "rotations of the platform", "orientations.quaternion"),
    Quantity("wrench_center", ("wrench_part",), "N, N m", "center of the wrench set", "wrenches.center"),
    Quantity("wrench_segment", ("segment", *WRENCH), "N, N m", "half vector of each segment", "wrenches.segments"),
    Quantity("wrench_ellipsoid", ELLIPSOID, "N, N m", "semi-axes of each ellipsoid", "wrenches.ellipsoids"),
    Quantity("corner_wrench", ("polytope_corner", "wrench_part"), "N, N m", "corners of polytopes", "wrenches.corners"),
    Quantity("polytope_size", ("polytope",), "", "number of corners of each polytope", "wrenches.sizes", values=int),
    Quantity("largest_acceleration", ACCELERATION, "m/s2, rad/s2", "largest accelerations", "wrenches.accelerations"),
)
UNITS = ("m³", "m²")
KINDS: Final[dict[str, type[Any]]] = {kind.__name__: kind for kind in (Box, Capsule, Sphere, Mesh)}


def _check_workspace(data: Dataset, cables: int) -> None:
    """Refuse a data set that is not a workspace of a robot with this number of cables."""
    choice(data.attrs["volume_units"], "volume_units", UNITS)
    choice(data.attrs["need"], "need", ("all", "any"))
    for name in ("volume", "volume_error", "box_tilt"):
        number(data.attrs[name], name, "", low=0.0)
    sizes = {str(name): size for name, size in data.sizes.items()} | {"corner": 3, "column": 6, "acceleration_part": 2}
    check_variables(data, QUANTITIES, sizes)
    count = sum(f"criterion_{k}" in data.attrs for k in range(len(data.attrs)))
    ranges = {
        "face": (0, sizes["vertex"]),
        "limiting": (-1, count),
        "limiting_cable": (-1, cables),
        "vertex_component": (0, sizes["component"]),
        "component_nodes": (-1, sizes["component"]),
    }
    check_indices(data, ranges)


def _criteria_attributes(chosen: Sequence[Criterion]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Attributes for criteria, and variables for their obstacles. Raises InvalidValueError for unknown criteria."""
    attributes: dict[str, Any] = {}
    variables: dict[str, Any] = {}
    for k, one in enumerate(chosen):
        key = f"criterion_{k}"
        attributes |= choice_attributes(key, one, CRITERIA)
        if isinstance(one, criteria.PositionError):
            del attributes[f"{key}_model"]
            attributes |= choice_attributes(f"{key}_of_model", one.model, models_by_name())
        if isinstance(one, criteria.Clearance):
            obstacles: Any = one.obstacles  # the check has converted this field to a tuple
            attributes[f"{key}_obstacles"] = len(obstacles)
            for j, obstacle in enumerate(obstacles):
                own, parts = _obstacle(f"{key}_obstacle_{j}", obstacle)
                attributes |= own
                variables |= parts
    return attributes, variables


def _criteria_of(path: Path, data: Dataset) -> tuple[Criterion, ...]:
    """Restore criteria from `_criteria_attributes`, in the same order. Messages contain `path`."""
    found: list[Criterion] = []
    while (key := f"criterion_{len(found)}") in data.attrs:
        known: dict[str, Any] = {}
        if data.attrs[key] == criteria.PositionError.__name__:
            known["model"] = choice_of(path, data.attrs, f"{key}_of_model", models_by_name())
        if data.attrs[key] == criteria.Clearance.__name__:
            count = int(data.attrs[f"{key}_obstacles"])
            known["obstacles"] = tuple(_obstacle_of(data, f"{key}_obstacle_{j}") for j in range(count))
        found.append(choice_of(path, data.attrs, key, CRITERIA, **known))
    return tuple(found)


def _obstacle(key: str, obstacle: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Convert an obstacle: its texts and numbers to attributes, and its arrays to variables."""
    attributes: dict[str, Any] = {key: type(obstacle).__name__}
    variables: dict[str, Any] = {}
    for field in fields(type(obstacle)):
        value = getattr(obstacle, field.name)
        if isinstance(value, np.ndarray):
            name = f"{key}_{field.name}"
            variables[name] = (tuple(f"{name}_{axis}" for axis in range(value.ndim)), value)
        else:
            attributes[f"{key}_{field.name}"] = value
    return attributes, variables


def _obstacle_of(data: Dataset, key: str) -> Any:
    kind = KINDS[data.attrs[key]]
    values = {}
    for field in fields(kind):
        name = f"{key}_{field.name}"
        values[field.name] = data[name].values if name in data.variables else data.attrs[name]
    return kind(**values)


def load_workspace(file: os.PathLike[str] | str) -> Workspace:
    """Read a workspace from a file of `Workspace.save`; all numbers are restored exactly.

    Args:
        file: The NetCDF file.

    Returns:
        The workspace.

    Raises:
        FileError: If the file is missing, not a workspace, of a newer format, or changed after it was written.

    Examples:
        >>> import sagline as sl
        >>> sl.workspace(sl.load_robot("ipanema-1"), cells=8).save("workspace.nc")
        >>> print(sl.load_workspace("workspace.nc").robot.name)
        ipanema-1
    """
    return FORMAT.load(file)


def _pack(space: Workspace) -> Dataset:
    box = space.box
    attributes = {
        **{"volume": space.volume, "volume_error": space.volume_error, "volume_units": space.unit},
        **{"box_low": box.low, "box_high": box.high, "box_units": "m", "box_tilt": box.tilt, "box_tilt_units": "rad"},
        "need": space.orientations.need,
        "hull": space.hull,
        "open_faces": ", ".join(space.open_faces),
        **choice_attributes("model", space.model, models_by_name()),
        **choice_attributes("tension", space.tension, methods_by_name()),
    }
    if space.moment_arm is not None:
        attributes |= {"moment_arm": space.moment_arm, "moment_arm_units": "m"}
    if space.given is not None:
        attributes["given"] = ", ".join(space.given)
    if (near := space.nearest) is not None:
        said = {"position": near.pose.position.tolist(), "quaternion": near.pose.quaternion.tolist()}
        said |= {name: getattr(near, name) for name in ("level", "margin", "criterion", "cables", "reason")}
        attributes["nearest"] = json.dumps(said)
    of_criteria, obstacles = _criteria_attributes(space.criteria)
    variables = variables_of_result(space, QUANTITIES) | obstacles
    return FORMAT.dataset(f"Workspace of {space.robot.name}", space.robot, attributes | of_criteria, variables)


def _unpack(path: FilePath, data: Dataset) -> Workspace:
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, robot")
    if "component_separate" not in data.variables:  # a file of an older version of sagline has no proofs
        data = data.assign(component_separate=("component", np.zeros(data.sizes["component"], dtype=np.bool_)))
    _check_workspace(data, robot.cable_count)

    found, attributes = fields_of(data, QUANTITIES), data.attrs
    found["limiting"] = locked(found["limiting"].astype(np.int8))
    found["components"] |= {name: locked(found["components"][name].astype(np.int32)) for name in ("vertices", "nodes")}
    arm, open_faces = attributes.get("moment_arm"), attributes["open_faces"]
    return Workspace(
        robot=robot,
        box=PoseBox(attributes["box_low"], attributes["box_high"], float(attributes["box_tilt"])),
        wrenches=WrenchSet(**found.pop("wrenches")),
        orientations=Orientations._of(found.pop("orientations")["quaternion"], attributes["need"]),
        criteria=_criteria_of(path, data),
        model=choice_of(path, data.attrs, "model", models_by_name()),
        tension=choice_of(path, data.attrs, "tension", methods_by_name()),
        moment_arm=None if arm is None else float(arm),
        hull=attributes.get("hull", "exact"),
        unit=attributes["volume_units"],
        volume=float(attributes["volume"]),
        volume_error=float(attributes["volume_error"]),
        components=Components(**found.pop("components")),
        surface=Surface(**found.pop("surface")),
        open_faces=tuple(open_faces.split(", ")) if open_faces else (),
        nearest=_nearest(attributes["nearest"]) if "nearest" in attributes else None,
        given=_given(attributes["given"]) if "given" in attributes else None,
        **found,
    )


def _given(text: str) -> tuple[Given, ...]:
    """Names of the given values of an underconstrained platform from the text of the file."""
    return tuple(cast(Given, choice(name, "given", CODES)) for name in text.split(", "))


def _nearest(text: str) -> Nearest:
    found = json.loads(text)
    pose = Pose._adopt(np.array(found.pop("position")), np.array(found.pop("quaternion")))
    return Nearest(pose=pose, **{**found, "cables": tuple(found["cables"])})


def field_of(space: Workspace) -> Dataset:
    """Level, margin, limiting criterion and cable at the nodes of the grid, with dimensions x, y and z [m]."""
    from xarray import Dataset

    shape = space.level.shape
    found = space.levels().details(np.stack(np.meshgrid(*space.axes, indexing="ij"), axis=-1).reshape(-1, 3))
    titles = ", ".join(f"{k}: {one.title}" for k, one in enumerate(space.criteria))
    about = {
        "level": {"units": "1", "long_name": "least value of the criteria over their scales, >= 0 inside"},
        "margin": {"units": "N", "long_name": "margin of the loads"},
        "criterion": {"long_name": f"limiting criterion ({titles})"},
        "cable": {"long_name": "limiting cable, -1 for none"},
    }
    values = {name: (("x", "y", "z"), getattr(found, name).reshape(shape), about[name]) for name in about}
    axes = {name: (name, axis, {"units": "m"}) for name, axis in zip("xyz", space.axes, strict=True)}
    return Dataset(values, axes, {"title": f"Workspace of {space.robot.name}"})


FORMAT: Final = Format(
    kind=Workspace,
    name="workspace",
    made="workspace of sagline",
    give="Give a .nc file of sagline workspace, or of Workspace.save.",
    again="Save the workspace again, or get the original file.",
    key="sagline_workspace_format",
    pack=_pack,
    unpack=_unpack,
)
save, pack = FORMAT.save, FORMAT.pack
