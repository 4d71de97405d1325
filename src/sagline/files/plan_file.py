"""Plans in NetCDF: every quantity with its unit, and the robot, the model and the version inside."""

from __future__ import annotations

import os
import warnings
from dataclasses import fields
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.cables.model import CableState, CableStatus
from sagline.cables.models import MODELS
from sagline.core.arrays import locked
from sagline.core.errors import FileError, InvalidValueError, SaglineWarning
from sagline.files.format import Format
from sagline.files.netcdf import choice_attributes, choice_of, labeled_dataset, numbered
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import STEP, Known, Quantity, check_labels, check_variable
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.robot.contact import Contact
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.several import anything_behind
from sagline.tension.methods import METHODS

if TYPE_CHECKING:
    from xarray import Dataset

QUANTITIES = (
    Quantity(
        "unstrained_length",
        "unstrained_length",
        ("cable",),
        "m",
        "unstrained length L to wind",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "chord_tension",
        "chord_tension",
        ("cable",),
        "N",
        "tension along the chord, T_x / cos phi",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "horizontal_tension",
        "state.cables.horizontal_tension",
        ("cable",),
        "N",
        "horizontal tension T_x",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "vertical_force",
        "state.cables.vertical_force",
        ("cable",),
        "N",
        "vertical force T_z on the cable at its platform end, up positive",
        known=Known.SOLVED,
    ),
    Quantity(
        "span", "state.cables.span", ("cable",), "m", "horizontal distance from frame end to platform end", low=0.0
    ),
    Quantity("rise", "state.cables.rise", ("cable",), "m", "height of the platform end above the frame end"),
    Quantity("cable_status", "state.cables.status", ("cable",), "", "how each cable's calculation ended", CableStatus),
    Quantity("pose_status", "status", (), "", "how each pose's calculation ended", PoseStatus),
    Quantity(
        "shortfall",
        "shortfall",
        (),
        "N",
        "smallest change of the force that would make the pose feasible",
        known=Known.SOMEWHERE,
        low=0.0,
        infinite=True,
    ),
    Quantity(
        "wrench_residual",
        "wrench_residual",
        ("residual_part",),
        "N, N m",
        "norms of the unbalanced force and moment in the free motions",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "blocking",
        "blocking",
        ("cable",),
        "",
        "whether the cable's limits stand against the needed wrench",
        values=bool,
    ),
    Quantity(
        "wrench",
        "state.wrench",
        ("wrench_part",),
        "N, N m",
        "external and inertial wrench about the center of mass in world axes, without gravity",
    ),
    Quantity("position", "state.pose.position", ("axis",), "m", "position of the platform origin in the world"),
    Quantity(
        "quaternion",
        "state.pose.quaternion",
        ("quaternion_part",),
        "1",
        "rotation from platform to world, scalar last",
    ),
)

# of a plan whose cables have something behind them
MACHINE = (
    Quantity(
        "free_length",
        "free_length",
        ("cable",),
        "m",
        "unstrained length of the hanging cable",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "free_chord_tension",
        "state.cables.chord_tension",
        ("cable",),
        "N",
        "tension along the chord of the hanging cable, from where it leaves its pulley",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "wrap_angle",
        "wrap_angle",
        ("cable",),
        "rad",
        "angle over which the cable lies on its pulley",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "wrapped_length",
        "state.contact.wrapped_length",
        ("cable",),
        "m",
        "unstrained length on the pulley",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "dead_length",
        "state.contact.dead_length",
        ("cable",),
        "m",
        "unstrained length between pulley and drum",
        known=Known.SOLVED,
        low=0.0,
    ),
    Quantity(
        "chord_sine",
        "state.contact.chord_sine",
        ("cable",),
        "1",
        "sine of the slope of the chord that touches the pulley",
        known=Known.SOLVED,
    ),
)

# of one whose friction counts
WINDING = Quantity(
    "winding",
    "state.contact.winding",
    ("cable",),
    "1",
    "direction of friction: 1 winding in, -1 paying out, 0 standing",
    low=-1.0,
)

# of a plan that has them: one of a file written before they were kept has none. A proof more is a line here.
PROOF = (
    Quantity(
        "farkas",
        "farkas",
        ("wrench_part",),
        "1, 1/m",
        "vector y that proves a pose infeasible: along it the cables give less than is needed, at any tensions",
        known=Known.SOMEWHERE,
    ),
    Quantity(
        "needed",
        "needed",
        ("wrench_part",),
        "N, N m",
        "wrench J tau that the chord tensions must supply",
        known=Known.SOMEWHERE,
    ),
    Quantity(
        "bracket",
        "bracket",
        ("bracket_part",),
        "N",
        "what is proved and what suffices of the smallest change of the force that would make the pose feasible",
        known=Known.SOMEWHERE,
        low=0.0,
        infinite=True,
    ),
    Quantity(
        "relief",
        "relief",
        ("axis",),
        "N",
        "smallest force that, added to the wrench, makes the pose feasible",
        known=Known.SOMEWHERE,
    ),
    Quantity(
        "at_border",
        "at_border",
        (),
        "",
        "whether the tensions were searched for at the border of feasibility, where the way of sharing had no say",
        values=bool,
    ),
)

# of a path only
TIME = Quantity("time", "path.time", (), "s", "time from the start of the path")
MOTION = (
    Quantity("twist", "path.twist", ("twist_part",), "m/s, rad/s", "velocity of the platform origin, angular velocity"),
    Quantity(
        "twist_rate",
        "path.twist_rate",
        ("twist_part",),
        "m/s^2, rad/s^2",
        "acceleration of the platform origin, angular acceleration",
    ),
)
# of a path whose jerk is known
JERK = Quantity("jerk", "path.jerk", ("twist_part",), "m/s^3, rad/s^3", "rate of twist_rate")


def present(data: Dataset) -> tuple[Quantity, ...]:
    """The quantities that a data set has, or should have.

    Args:
        data: The data set.

    Returns:
        All that a plan has, the proofs that are there, and those of a path if there is one.
    """
    motion = (TIME, *MOTION) if TIME.name in data.variables else ()
    machine = MACHINE if MACHINE[0].name in data.variables else ()
    beside = (some for some in (WINDING, *PROOF, JERK) if some.name in data.variables)
    return (*QUANTITIES, *machine, *motion, *beside)


def check_plan(data: Dataset, cables: int) -> None:
    """Refuse a data set that is no plan, whatever its file looked like.

    Args:
        data: The data set.
        cables: How many cables the robot has.

    Raises:
        KeyError: If a variable is missing.
        InvalidValueError: If one is not what the layout says; the message names its first wrong value.
    """
    status = data.variables["pose_status"]
    rows = tuple(str(name) for name in status.dims)
    if rows not in ((), ("pose",)):
        raise InvalidValueError("pose_status: dimensions", rows, "none, or pose", STEP)
    sizes = {"cable": cables, "pose": status.size}
    check_labels(data)
    solved = np.asarray(status.values == PoseStatus.SOLVED)
    for quantity in sorted(present(data), key=lambda quantity: quantity.codes is None):  # what a status means, first
        check_variable(quantity, data.variables[quantity.name], rows, sizes, solved)


RESTS = "rests"  # of a path whose rests are known
FREE = {"unstrained_length": "free_length", "chord_tension": "free_chord_tension"}  # of cables over pulleys
STATE_ARRAYS = ("span", "rise", "unstrained_length", "horizontal_tension", "vertical_force", "chord_tension")


def save_plan(plan: Plan, file: os.PathLike[str] | str) -> None:
    """Write a plan to a NetCDF file, whole or not at all.

    Dimensions are pose (absent for a single pose) and cable; a path's times are a coordinate of pose. Poses without
    an answer are kept, with their status, shortfall, blocking cables and proof, and NaN lengths and forces. A digest
    over all values and attributes stands at the end, behind what NetCDF reads, and shows when anything has changed.

    Args:
        plan: The plan, of one robot.
        file: The file, "run.nc" for instance; a regular file that exists is replaced, anything else is refused.

    Raises:
        InvalidValueError: If the plan is of several robots, one a pose; of a cable model or a way of sharing that is
            none of sagline's; or if its values are none that `inverse` gives.
        FileError: If the file cannot be written; what was there before is untouched.
    """
    FORMAT.save(plan, file)


def load_plan(file: os.PathLike[str] | str) -> Plan:
    """Read a plan that `save_plan` wrote: the same plan to the last bit.

    Args:
        file: The NetCDF file.

    Returns:
        The plan; its proofs, from `farkas` on, are None in a file that was written before files kept them.

    Raises:
        FileError: If the file is missing, cut off, no NetCDF file, no plan, of a newer format, or not as it was
            written: its digest, shapes, units, status codes and signs are checked.

    Warns:
        SaglineWarning: If the file is from before files carried a digest.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (1, 1, 2)], speed=1.0)
        >>> sl.inverse(sl.load_robot("cogiro"), path).save("run.nc")
        >>> plan = sl.load_plan("run.nc")
        >>> print(plan.state.robot.name, plan.unstrained_length.shape)
        cogiro (283, 8)
    """
    return FORMAT.load(file, unsealed=_warn_of_damage)


def _warn_of_damage(path: FilePath) -> None:
    """Warn that damage to a file without a digest need not show; the caller of `load_plan` is meant."""
    text = f"{path} is from before plans carried a digest: damage to it need not show. Save it again to have one."
    warnings.warn(text, SaglineWarning, stacklevel=4)


def plan_dataset(plan: Plan) -> Dataset:
    """A plan as a data set, with the robot among its attributes.

    Args:
        plan: The plan, of one robot.

    Raises:
        InvalidValueError: If it is of several robots, or of a model or way of sharing that is none of sagline's.
    """
    rows = ("pose",) * len(plan.state.pose.shape)

    def variable(quantity: Quantity) -> tuple[tuple[str, ...], Any, dict[str, Any]]:
        return (*rows, *quantity.parts), quantity.of(plan), quantity.attributes

    proof = tuple(quantity for quantity in PROOF if quantity.of(plan) is not None)
    motion = () if plan.path is None else MOTION if plan.path.jerk is None else (*MOTION, JERK)
    contact = plan.state.contact
    machine = () if contact is None else MACHINE if contact.winding is None else (*MACHINE, WINDING)
    quantities = QUANTITIES + machine + proof + motion
    coordinates: dict[str, Any] = {"cable": numbered("cable", plan.state.one_robot.cable_count)}
    if plan.path is not None:
        coordinates["time"] = variable(TIME)
    variables: dict[str, Any] = {quantity.name: variable(quantity) for quantity in quantities}
    if plan.path is not None and plan.path.rests is not None:
        variables[RESTS] = (("rest",), plan.path.rests, {"units": "s", "long_name": "when the platform stands"})
    data = labeled_dataset(variables, _attributes(plan), coordinates)
    check_plan(data, plan.state.one_robot.cable_count)
    return data


def _attributes(plan: Plan) -> dict[str, Any]:
    return {
        **FORMAT.attributes(f"Cable lengths and tensions of {plan.state.one_robot.name}"),
        **choice_attributes("model", plan.state.cables.model, MODELS),
        **choice_attributes("tension", plan.tension, METHODS),
        "robot": dump_robot(plan.state.one_robot),
    }


def plan_of(path: FilePath, data: Dataset, where: str = "robot") -> Plan:
    """The plan of a data set.

    Args:
        path: The file it is from, for messages.
        data: What `plan_dataset` gave.
        where: Name of the robot in messages.

    Raises:
        FileError: If it is none of a plan.
        InvalidValueError: If one of its values is none.
    """
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, {where}")

    def values(name: str) -> Any:
        return locked(np.asarray(data[name].values, order="C"))

    if data.sizes["cable"] != robot.cable_count:
        reason = f"has {data.sizes['cable']} cables, its robot {robot.cable_count}"
        raise FileError(path, reason, "Write it again.", item="cable")
    check_plan(data, robot.cable_count)
    behind = MACHINE[0].name in data.variables
    if behind != anything_behind(robot):
        said, has = ("is", "none of its") if behind else ("is not", "some of its")
        raise FileError(path, f"{said} of cables over pulleys, but {has} robot's are", FORMAT.again)
    pose = Pose.from_quaternion(values("position"), values("quaternion"))
    cables = CableState(
        model=choice_of(path, data.attrs, "model", MODELS),
        cable=robot.cables,
        gravity=robot.gravity,
        **{name: values(FREE.get(name, name) if behind else name) for name in STATE_ARRAYS},
        status=values("cable_status"),
    )
    contact = None
    if behind:
        contact = Contact(**{field.name: values(field.name) for field in fields(Contact) if field.name in data})
    motion = None
    if TIME.name in data.variables:
        jerk = values(JERK.name) if JERK.name in data.variables else None
        rests = values(RESTS) if RESTS in data.variables else None
        motion = Path(values("time"), pose, values("twist"), values("twist_rate"), jerk, rests)
    return Plan(
        state=Equilibrium(robot, pose, values("wrench"), cables, contact),
        path=motion,
        tension=choice_of(path, data.attrs, "tension", METHODS),
        status=values("pose_status"),
        shortfall=values("shortfall"),
        wrench_residual=values("wrench_residual"),
        blocking=values("blocking"),
        **{quantity.name: values(quantity.name) for quantity in PROOF if quantity.name in data.variables},
    )


FORMAT: Final = Format(
    kind=Plan,
    name="plan",
    made="run of sagline track",
    give="Give the .nc file that sagline track wrote.",
    again="Run sagline track again, or take the file from where it came.",
    key="sagline_format",
    version=2,  # 2: with a digest
    pack=plan_dataset,
    unpack=plan_of,
    sealed_from=2,
)
save = FORMAT.save
