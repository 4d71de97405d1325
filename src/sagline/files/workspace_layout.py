"""What a file with a workspace holds."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sagline.files.variables import Quantity
from sagline.workspaces.criteria.clearance import Clearance
from sagline.workspaces.criteria.criterion import Criterion
from sagline.workspaces.criteria.frame import InFrame
from sagline.workspaces.criteria.frequency import LeastFrequency
from sagline.workspaces.criteria.margin import LeastMargin
from sagline.workspaces.criteria.position_error import PositionError
from sagline.workspaces.criteria.sag import MaximumSag
from sagline.workspaces.criteria.stiffness import LeastStiffness

CRITERIA: Final[dict[str, type[Criterion]]] = {
    kind.__name__: kind
    for kind in (LeastMargin, MaximumSag, PositionError, LeastStiffness, LeastFrequency, Clearance, InFrame)
}
NODES: Final = ("x", "y", "z")  # of the grid
FINE: Final = ("fine_x", "fine_y", "fine_z")  # of the grid that tells components apart

QUANTITIES: Final = (
    *(Quantity(name, name, (name,), "m", f"{name} of the nodes of the grid") for name in NODES),
    Quantity("level", "level", NODES, "1", "least value of the criteria over their scales, >= 0 inside", infinite=True),
    Quantity("vertex_position", "surface.vertices", ("vertex", "axis"), "m", "vertices of the surface"),
    Quantity("face", "surface.faces", ("side", "corner"), "", "vertices of each triangle, outward", values=int),
    Quantity("limiting", "limiting", ("vertex",), "", "criterion that decides there, -1 for the box", values=int),
    Quantity("limiting_cable", "limiting_cable", ("vertex",), "", "cable that decides, -1 for none", values=int),
    Quantity("margin", "margin", ("vertex",), "N", "margin of the loads there", infinite=True),
    Quantity("component_volume", "components.volume", ("component",), "", "of each component, in units of volume"),
    Quantity("vertex_component", "components.vertices", ("vertex",), "", "component of each vertex", values=int),
    *(Quantity(fine, f"components.{fine[-1]}", (fine,), "m", f"{fine[-1]} of finer nodes") for fine in FINE),
    Quantity("component_nodes", "components.nodes", FINE, "", "component of each node, -1 outside", values=int),
    Quantity("rotation", "orientations.quaternion", ("turn", "quaternion_part"), "1", "rotations of the platform"),
    Quantity("wrench_center", "wrenches.center", ("wrench_part",), "N, N m", "a wrench of the set"),
    Quantity("wrench_segment", "wrenches.segments", ("segment", "wrench_part"), "N, N m", "half of each segment"),
    Quantity("wrench_ellipsoid", "wrenches.ellipsoids", ("ellipsoid", "wrench_part", "column"), "N, N m", "semi-axes"),
    Quantity("corner_wrench", "wrenches.corners", ("polytope_corner", "wrench_part"), "N, N m", "corners of polytopes"),
    Quantity("polytope_size", "wrenches.sizes", ("polytope",), "", "corners of each polytope", values=int),
    Quantity(
        "largest_acceleration",
        "wrenches.accelerations",
        ("acceleration_part",),
        "m/s2, rad/s2",
        "largest accelerations",
    ),
)
TYPES: Final[dict[str, Any]] = {"limiting": np.int8, "vertex_component": np.int32, "component_nodes": np.int32}
