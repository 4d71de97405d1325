"""Plans in NetCDF: every quantity with its unit, the robot, the cable model and the version of sagline."""

from __future__ import annotations

import os
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Final

import numpy as np

from sagline.cables.model import CableState, CableStatus
from sagline.cables.models import models_by_name
from sagline.core.errors import FileError, InvalidValueError
from sagline.files import variables as v
from sagline.files.netcdf import Format, choice_attributes, choice_of, index_coordinate, robot_of
from sagline.files.variables import SOLVED, SOMEWHERE, STEP, Quantity
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import BALANCED, PoseStatus
from sagline.motion.path import Path
from sagline.robot.batch import Robots, has_routing
from sagline.robot.equilibrium import Contact, Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import with_anchors
from sagline.tension.methods import methods_by_name

if TYPE_CHECKING:
    from xarray import Dataset

CABLE, AXIS, WRENCH, TWIST = ("cable",), ("axis",), ("wrench_part",), ("twist_part",)
CABLES, CONTACT = "state.cables.", "state.contact."  # results for the free cables, and for the cables on their pulleys
CHANGE: Final = "change of the force that makes the pose feasible"
UNBALANCED: Final = "norms of unbalanced force and moment in the free motions"
EXTERNAL: Final = "external and inertial wrench about the center of mass in world axes, without gravity"
VERTICAL: Final = "vertical force T_z on the cable at the platform end, up positive"
FREE: Final = "tension along the chord of the free cable, from its exit point"
WOUND: Final = "direction of friction: 1 winding in, -1 paying out, 0 standing"
LACKING: Final = "vector y that proves a pose infeasible: the cables supply too little force along y at any tensions"
BRACKET: Final = f"proved lower bound and sufficient value of the smallest {CHANGE}"
SEARCHED: Final = "true if the tensions come from the search at the border of feasibility, not from the tension method"
QUANTITIES = (
    Quantity("unstrained_length", CABLE, "m", "unstrained length L off the drum", known=SOLVED, low=0.0),
    Quantity("chord_tension", CABLE, "N", "tension along the chord, T_x / cos phi", known=SOLVED, low=0.0),
    Quantity("horizontal_tension", CABLE, "N", "horizontal tension T_x", CABLES, SOLVED, 0.0),
    Quantity("vertical_force", CABLE, "N", VERTICAL, CABLES, SOLVED),
    Quantity("span", CABLE, "m", "horizontal distance from frame end to platform end", CABLES, low=0.0),
    Quantity("rise", CABLE, "m", "height of the platform end above the frame end", CABLES),
    Quantity("cable_status", CABLE, "", "status of each cable's calculation", f"{CABLES}status", codes=CableStatus),
    Quantity("pose_status", (), "", "status of each pose's calculation", "status", codes=PoseStatus),
    Quantity("shortfall", (), "N", f"smallest {CHANGE}", known=SOMEWHERE, low=0.0, infinite=True),
    Quantity("wrench_residual", ("residual_part",), "N, N m", UNBALANCED, known=SOLVED, low=0.0),
    Quantity("blocking", CABLE, "", "true if the cable's limits oppose the needed wrench", values=bool),
    Quantity("wrench", WRENCH, "N, N m", EXTERNAL, "state."),
    Quantity("position", AXIS, "m", "position of the platform origin in the world", "state.pose."),
    Quantity("quaternion", ("quaternion_part",), "1", "rotation from platform to world, scalar last", "state.pose."),
)

# variables of a plan with pulleys or drums
MACHINE = (
    Quantity("free_length", CABLE, "m", "unstrained length of the free cable", known=SOLVED, low=0.0),
    Quantity("free_chord_tension", CABLE, "N", FREE, f"{CABLES}chord_tension", SOLVED, 0.0),
    Quantity("wrap_angle", CABLE, "rad", "angle over which the cable lies on its pulley", known=SOLVED, low=0.0),
    Quantity("wrapped_length", CABLE, "m", "unstrained length on the pulley", CONTACT, SOLVED, 0.0),
    Quantity("dead_length", CABLE, "m", "unstrained length between pulley and drum", CONTACT, SOLVED, 0.0),
    Quantity("chord_sine", CABLE, "1", "sine of the slope of the chord that touches the pulley", CONTACT, SOLVED),
)

# variable of a plan with friction
WINDING = Quantity("winding", CABLE, "1", WOUND, CONTACT, low=-1.0)

# variable of a plan with a swivel axis that is not vertical
AZIMUTH = Quantity("azimuth", CABLE, "rad", "azimuth of the vertical plane of the free cable", CONTACT, SOLVED)

# proofs of infeasibility; older files do not have them
PROOF = (
    Quantity("farkas", WRENCH, "1, 1/m", LACKING, known=SOMEWHERE),
    Quantity("needed", WRENCH, "N, N m", "wrench J tau that the chord tensions must supply", known=SOMEWHERE),
    Quantity("bracket", ("bracket_part",), "N", BRACKET, known=SOMEWHERE, low=0.0, infinite=True),
    Quantity("relief", AXIS, "N", "smallest additional force that makes the pose feasible", known=SOMEWHERE),
    Quantity("at_border", (), "", SEARCHED, values=bool),
)

# variable of a plan along a path
TIME = Quantity("time", (), "s", "time from the start of the path", "path.")
MOTION = (
    Quantity("twist", TWIST, "m/s, rad/s", "velocity of the platform origin, angular velocity", "path."),
    Quantity("twist_rate", TWIST, "m/s^2, rad/s^2", "acceleration of the origin, angular acceleration", "path."),
)
# variable of a path with known jerk
JERK = Quantity("jerk", TWIST, "m/s^3, rad/s^3", "rate of twist_rate", "path.")
RESTS = "rests"  # attribute of a path with known rests


def _check_plan(data: Dataset, cables: int) -> None:
    """Refuse a data set that is not a plan of a robot with this number of cables."""
    status = data.variables["pose_status"]
    rows = tuple(str(name) for name in status.dims)
    if rows not in ((), ("pose",)):
        raise InvalidValueError("pose_status: dimensions", rows, "none, or pose", STEP)
    machine = MACHINE if MACHINE[0].name in data.variables else ()
    motion = (TIME, *MOTION) if TIME.name in data.variables else ()
    optional = (one for one in (WINDING, *PROOF, JERK) if one.name in data.variables)
    quantities = sorted((*QUANTITIES, *machine, *motion, *optional), key=lambda one: one.codes is None)  # codes first
    solved = np.isin(status.values, BALANCED)
    v.check_variables(data, quantities, {"cable": cables, "pose": status.size}, rows, solved)
    v.check_anchors(data, cables)


def save_plan(plan: Plan, file: os.PathLike[str] | str) -> None:
    """Write a plan to a NetCDF file atomically.

    The dimensions are pose (absent for a single pose) and cable. The times of a path are a coordinate of the dimension
    pose. Infeasible poses are included, with status, shortfall, blocking cables and proof; their lengths and forces are
    NaN. A digest of all values and attributes follows the NetCDF data. The digest detects later changes of the file.

    Args:
        plan: A plan of one robot, with fixed or moving anchors.
        file: The file, for example "run.nc". An existing regular file is replaced; any other target is refused.

    Raises:
        InvalidValueError: If `plan` has several robots (one per pose). If the cable model or the tension method is not
            part of sagline. If `plan` has values that `inverse` never returns.
        FileError: If the file cannot be written; an existing file is then unchanged.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose((1.0, 0.5, 2.0))
        >>> sl.save_plan(sl.inverse(robot, pose), "run.nc")
        >>> bool(sl.load_plan("run.nc").feasible)
        True
    """
    FORMAT.save(plan, file)


def load_plan(file: os.PathLike[str] | str) -> Plan:
    """Read a plan from a file of `save_plan`; all numbers are restored exactly.

    Args:
        file: The NetCDF file.

    Returns:
        The plan. If an older file does not contain proofs, `farkas` and the fields after it are None.

    Raises:
        FileError: If the file is missing, not a plan, of a newer format, or changed after it was written.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (1, 1, 2)], speed=1.0)
        >>> sl.inverse(sl.load_robot("cogiro"), path).save("run.nc")
        >>> plan = sl.load_plan("run.nc")
        >>> print(plan.state.robot.name, plan.unstrained_length.shape)
        cogiro (283, 8)
    """
    return FORMAT.load(file)


def plan_dataset(plan: Plan) -> Dataset:
    """Create the data set of a plan of one robot. The robot is stored as an attribute."""
    robot, rows = plan.robot, ("pose",) * len(plan.state.pose.shape)
    cables = robot.cable_count
    machine = () if plan.state.contact is None else MACHINE
    variables = v.variables_of_result(plan, (*QUANTITIES, *machine, WINDING, AZIMUTH, *PROOF, *MOTION, JERK), rows)
    variables |= v.variables_of_result(plan, v.ANCHORS)
    coordinates = {"cable": index_coordinate("cable", cables), **v.variables_of_result(plan, (TIME,), rows)}
    if plan.path is not None and plan.path.rests is not None:
        variables[RESTS] = (("rest",), plan.path.rests, {"units": "s", "long_name": "times of rest of the platform"})
    choices = choice_attributes("model", plan.state.cables.model, models_by_name())
    choices |= choice_attributes("tension", plan.tension, methods_by_name())
    choices[FORMAT.key] = FORMAT.version - (plan.anchors is None)
    data = FORMAT.dataset(f"Cable lengths and tensions of {robot.name}", robot, choices, variables, coordinates)
    _check_plan(data, cables)
    return data


def plan_of_dataset(path: FilePath, data: Dataset, item: str = "robot") -> Plan:
    """Create a plan from a data set of `plan_dataset`. Messages contain `path` and `item`."""
    robot = robot_of(path, data, item)
    _check_plan(data, robot.cable_count)
    behind = MACHINE[0].name in data.variables
    if behind != has_routing(robot):
        said, has = ("is", "none of its") if behind else ("is not", "some of its")
        raise FileError(path, f"{said} of cables over pulleys, but {has} robot's are", FORMAT.again)
    found = v.fields_of(data, (*QUANTITIES, *MACHINE, WINDING, AZIMUTH, TIME, *MOTION, JERK))
    state, motion, anchors = found["state"], found.get("path"), v.anchors_of(data)
    pose = Pose.from_quaternion(**state["pose"])
    spans = {"chord_tension": found["chord_tension"], **state["cables"]}  # values of the free span
    cables = CableState(
        model=choice_of(path, data.attrs, "model", models_by_name()),
        cable=robot.cables,
        gravity=robot.gravity,
        unstrained_length=found["free_length" if behind else "unstrained_length"],
        **spans,
    )
    contact = None
    if behind:
        contact = Contact(wrap_angle=found["wrap_angle"], chord_tension=found["chord_tension"], **state["contact"])
    if motion is not None:
        motion = Path(pose=pose, **motion, rests=v.values_of(data, RESTS) if RESTS in data.variables else None)
    placed: Robots = robot
    if anchors is not None and motion is not None:
        placed = with_anchors(robot, anchors._of(robot, motion.time))
    return Plan(
        state=Equilibrium(placed, pose, state["wrench"], cables, contact),
        path=motion,
        tension=choice_of(path, data.attrs, "tension", methods_by_name()),
        **{name: found[name] for name in ("status", "shortfall", "wrench_residual", "blocking")},
        **v.fields_of(data, PROOF),
        anchors=anchors,
    )


FORMAT: Final = Format(
    kind=Plan,
    name="plan",
    made="run of sagline track",
    give="Give the .nc file that sagline track wrote.",
    again="Run sagline track again, or get the original file.",
    key="sagline_format",
    version=3,  # version 2 added the digest; version 3, moving anchors, which other plans do not need
    pack=plan_dataset,
    unpack=plan_of_dataset,
)
