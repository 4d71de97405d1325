"""Executions: reading from MCAP logs, and writing to MCAP or NetCDF together with the plan."""

from __future__ import annotations

import os
import warnings
from dataclasses import fields
from io import FileIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from sagline.control.execution import Execution, ExecutionStatus, Samples
from sagline.control.states import State
from sagline.core.arguments import brief, file_path, instance, integer
from sagline.core.arrays import locked
from sagline.core.errors import FileError, InvalidValueError, SaglineWarning
from sagline.files.mcap_layout import CABLE, CYCLES, EVENTS, EVERY, ROWS, TIME, columns_of
from sagline.files.mcap_reader import AGAIN, LogReader, read_log
from sagline.files.mcap_writer import BLOCK, McapFile, check_packages
from sagline.files.netcdf import Format, index_coordinate, write_dataset
from sagline.files.packed import unpack_dataset
from sagline.files.plan_file import plan_dataset, plan_of_dataset
from sagline.files.variables import NONE, PARTS, Quantity
from sagline.files.writing import atomic_file
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from xarray import Dataset

PLAN_GROUP: Final = "plan"


def load_execution(file: os.PathLike[str] | str, plan: int | None = None) -> Execution:
    """Read an execution from an MCAP log. The log may contain a whole session, or be cut off by the end of its process.

    All numbers of a file that `Execution.save` wrote are restored exactly.

    Args:
        file: The log.
        plan: Index of the plan, from 0; -1 is the last plan. None: all cycles of the log. The execution then has a plan
            only if the log has exactly one plan.

    Returns:
        The execution. The status is UNKNOWN if the log does not contain the end of the plan.

    Raises:
        FileError: If the file is missing, not a log, or of a newer format. If the log is damaged, or cut off before its
            first cycle. If a package that reads logs is missing.
        InvalidValueError: If the log does not have this plan.

    Warns:
        SaglineWarning: If the log was cut off; the last second of recording is then missing.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
    """
    log = read_log(file)
    if not log.complete:
        text = f"{log.path} was cut off: the data of its last second are missing."
        warnings.warn(text, SaglineWarning, stacklevel=2)
    return _execution_of_log(log, plan)


def _execution_of_log(log: LogReader, plan: int | None = None) -> Execution:
    count = len(log.plans)
    chosen = None if plan is None else integer(plan)
    if plan is not None and (chosen is None or not -count <= chosen < count):
        has = f"{-count} to {count - 1}" if count else "none: the log has no plan"
        raise InvalidValueError("plan", brief(plan), has, "Choose one of them, or None for all cycles.")
    number = (0 if count == 1 else None) if chosen is None else chosen % count
    blocks = [block for block in log.blocks if plan is None or block.get("plan") == number]
    if log.truth and not log.blocks:
        step = "Give this file as: sagline view ROBOT RUN.mcap --truth FILE."
        raise FileError(log.path, "is the log of a twin with true poses, not an execution", step)
    if log.robot is None or not blocks:
        raise FileError(log.path, "has no cycle", "It contains no data, or it was cut off at its start.")
    try:
        return _execution(log, log.robot, blocks, number)
    except (InvalidValueError, ValueError, KeyError) as error:
        raise FileError(log.path, f"is inconsistent ({error})", AGAIN) from None


def _execution(log: LogReader, robot: Robot, blocks: list[dict[str, NDArray[Any]]], number: int | None) -> Execution:
    columns = {quantity.name: _column(quantity, blocks) for quantity in EVERY}
    _check_shapes(columns, robot)
    found = {quantity.place: locked(columns[quantity.name]) for quantity in EVERY}
    samples = {field.name: found.pop(f"samples.{field.name}", found["time"]) for field in fields(Samples)}
    first, last = (found["time"][[0, -1]].tolist()) if len(found["time"]) else (0.0, 0.0)
    whole = len(blocks) == len(log.blocks)
    unknown = ExecutionStatus.UNKNOWN.name, "the log does not contain the end of the execution"
    status, reason = log.endings.get(NONE if number is None else number, unknown)
    return Execution(
        robot=robot,
        plan=None if number is None else plan_of_log(log, number),
        status=ExecutionStatus[status],
        reason=reason,
        period=log.period,
        zero=locked(blocks[-1]["zero"]),
        events=tuple(event for event in log.events if whole or first <= event.time <= last),
        samples=Samples(**samples),
        **found,
    )


def plan_of_log(log: LogReader, number: int) -> Plan:
    """Read the plan with the index `number` from a log."""
    data = unpack_dataset(log.plans[number])
    return plan_of_dataset(log.path, data, f"robot of plan {number}")


def _column(quantity: Quantity, blocks: list[dict[str, NDArray[Any]]]) -> NDArray[Any]:
    whole = np.concatenate([block[quantity.name] for block in blocks])
    if whole.dtype != quantity.type:
        raise InvalidValueError(f"{quantity.name}: type", whole.dtype, str(quantity.type), AGAIN)
    if quantity.codes is not None and (unknown := np.setdiff1d(whole, list(quantity.codes))).size:
        known = ", ".join(code.name for code in quantity.codes)
        raise InvalidValueError(quantity.name, int(unknown[0]), known, "Read it with a newer sagline.")
    return whole


def _check_shapes(columns: dict[str, NDArray[Any]], robot: Robot) -> None:
    groups = columns["age"].shape[1:] or (0,)
    sizes = {"cable": robot.cable_count, "group": groups[0], **{part: len(names) for part, names in PARTS.items()}}
    rows = columns[TIME.name].size
    for quantity in EVERY:
        shape, wanted = columns[quantity.name].shape, (rows, *(sizes[part] for part in quantity.parts))
        if shape != wanted:
            raise InvalidValueError(f"{quantity.name}: shape", shape, str(wanted), AGAIN)


def pack(execution: Execution) -> Dataset:
    """Create the data set of an execution: every quantity over time, with its unit."""
    done = instance(execution, Execution, "execution")
    variables: dict[str, Any] = {
        quantity.name: ((ROWS, *quantity.parts), quantity.of(done), quantity.attributes) for quantity in CYCLES
    }
    variables["zero"] = (CABLE, done.zero, {"units": "m", "long_name": "correction of the lengths by homing"})
    for name, what in EVENTS.items() if done.events else ():
        values = [getattr(event, name) for event in done.events]
        variables[f"event_{name}"] = ("event", [_plain(value) for value in values], {"long_name": what})
    coordinates: dict[str, Any] = {
        "cable": index_coordinate("cable", done.robot.cable_count),
        "group": index_coordinate("group", done.samples.age.shape[1]),
        TIME.name: (ROWS, done.time, TIME.attributes),
    }
    attributes = {"status": done.status.name, "reason": done.reason, "period": done.period, "period_units": "s"}
    return FORMAT.dataset(f"Execution on {done.robot.name}", done.robot, attributes, variables, coordinates)


def save(execution: Execution, file: os.PathLike[str] | str) -> None:
    """Write an execution to an MCAP log or to NetCDF, depending on the suffix of the file."""
    path = file_path(file)
    match path.suffix.lower():
        case ".mcap":
            save_execution(execution, path)
        case ".nc":  # the plan is stored in the group `plan`
            plan = instance(execution, Execution, "execution").plan
            write_dataset(pack(execution), path, {} if plan is None else {PLAN_GROUP: plan_dataset(plan)})
        case _:
            raise FileError(path, "is not a valid name for an execution", "Let it end in .mcap, or in .nc.")


def save_execution(execution: Execution, file: os.PathLike[str] | str) -> None:
    """Write an execution, its plan and its robot to an MCAP log atomically. No number is rounded."""
    done, target = instance(execution, Execution, "execution"), file_path(file)
    check_packages()
    with atomic_file(target) as partial_file, FileIO(partial_file, "wb") as stream:
        mcap = McapFile(stream, done.robot, done.period)
        number = NONE if done.plan is None else mcap.begin(done.plan)
        columns = columns_of(done)
        for first in range(0, max(len(done), 1), BLOCK):
            rows = {name: values[first : first + BLOCK] for name, values in columns.items()}
            mcap.block(rows, number, done.zero)
            mcap.close_chunk()
        for event in done.events:
            mcap.event(event)
        mcap.end(number, done.status.name, done.reason)
        mcap.finish()


def _plain(value: Any) -> Any:
    """Value for the table of events: the name of a state; numbers and texts without change."""
    return value.name if isinstance(value, State) else str(value) if isinstance(value, str) else value


FORMAT: Final = Format(
    kind=Execution,
    name="execution",
    made="execution of sagline log",
    give="Give a .nc file of sagline log.",
    again="Write it again with sagline log.",
    key="sagline_execution_format",
    pack=pack,
)
