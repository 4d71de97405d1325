"""Plans in NetCDF: every number with its unit, and the robot, the model and the version inside."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from sagline.cables.model import CableState
from sagline.cables.models import MODELS
from sagline.core.arrays import locked
from sagline.core.errors import FileError, InvalidValueError, SaglineWarning
from sagline.files.dataset import labeled_dataset, numbered
from sagline.files.format import Format
from sagline.files.plan_checks import check_plan
from sagline.files.plan_layout import JERK, MACHINE, MOTION, PROOF, QUANTITIES, TIME, WINDING
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import Quantity
from sagline.kinematics.plan import Plan
from sagline.motion.path import Path
from sagline.robot.contact import Contact
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.several import anything_behind
from sagline.tension.methods import METHODS

if TYPE_CHECKING:
    from xarray import Dataset

RESTS = "rests"  # of a path whose rests are known
FREE = {"unstrained_length": "free_length", "chord_tension": "free_chord_tension"}  # of cables over pulleys
STATE_ARRAYS = ("span", "rise", "unstrained_length", "horizontal_tension", "vertical_force", "chord_tension")

Choice = TypeVar("Choice")


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


def choice_attributes(key: str, choice: Any, choices: Mapping[str, type[Any]]) -> dict[str, Any]:
    """A model, method or the like as attributes: its name, and each of its options that is set.

    Args:
        key: What the attributes begin with.
        choice: What was chosen.
        choices: What can be read back, by name.

    Returns:
        Attributes.

    Raises:
        InvalidValueError: If it is none of these.
    """
    if choices.get(type(choice).__name__) is not type(choice):
        raise InvalidValueError(key, type(choice).__name__, ", ".join(choices), "Only these can be read back.")
    options = {f"{key}_{field.name}": getattr(choice, field.name) for field in fields(choice)}
    return {key: type(choice).__name__, **{name: value for name, value in options.items() if value is not None}}


def choice_of(
    path: FilePath, attributes: Mapping[str, Any], key: str, choices: Mapping[str, type[Choice]], **known: Any
) -> Choice:
    """What `choice_attributes` wrote.

    Args:
        path: The file, for messages.
        attributes: Of the file.
        key: What the attributes begin with.
        choices: What it may be, by name.
        **known: Options that are elsewhere in the file.

    Returns:
        What was chosen.

    Raises:
        FileError: If it is none of these, or an option is of another kind.
    """
    name = attributes[key]
    if name not in choices:
        refused = InvalidValueError(key, repr(name), ", ".join(choices), "Read it with a newer sagline.")
        raise FileError.of(path, refused)
    choice: Any = choices[name]
    given = {field.name: attributes.get(f"{key}_{field.name}") for field in fields(choice)}
    try:
        options = {option: _plain(value) for option, value in given.items() if value is not None}
        found: Choice = choice(**{**options, **known})
    except TypeError as error:  # a text where a number belongs
        raise FileError(path, f"{key}: {error}", "Write it again; it was edited.") from None
    return found


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


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
