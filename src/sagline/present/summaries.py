"""Summaries of results as text and as JSON: title, verdict, rows with values, and notes."""

from __future__ import annotations

from dataclasses import fields
from functools import singledispatch
from textwrap import shorten, wrap
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.cables.cable import Cable
from sagline.calibration.result import Calibration
from sagline.calibration.summary import chi_squared_text
from sagline.core.arguments import word_of
from sagline.core.numbers import n
from sagline.core.results import Result, Shown, documented_units
from sagline.dynamics.simulation.results import Simulation
from sagline.dynamics.vibration.vibration import Vibration
from sagline.kinematics.confirm import Confirmation
from sagline.kinematics.forward_rows import ForwardSolution
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.anchors import AnchorMotion
from sagline.motion.path import Path
from sagline.robot.batch import first_of
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.workspaces.workspace import Workspace

if TYPE_CHECKING:
    from sagline.core.arrays import Array

MOST_LINES: Final = 12  # largest number of lines of the text of a result
WIDTH: Final = 80  # largest number of characters in a line
MOST_GAPS = 5  # largest number of listed items
MOST_MODES = 8
LAST = 1.0  # length of the interval at the end of a simulation that shows the residual vibration [s]


class Row(NamedTuple):
    """Value of a summary."""

    key: str  # name in JSON, with the unit
    label: str  # label for readers
    value: Any  # value in JSON
    text: str  # text of the value with the unit, for readers; "" for a value that is only for programs


class Summary(NamedTuple):
    """Summary of a robot, a path, a plan or a result."""

    title: str  # type and name of the object
    verdict: str  # verdict in one line
    good: bool | None  # True for a good verdict, False for a bad verdict, None for a neutral verdict
    notes: tuple[str, ...] = ()  # further lines
    rows: tuple[Row, ...] = ()  # values

    @property
    def lines(self) -> tuple[str, ...]:
        """Rows and notes as text."""
        return (*(f"{row.label}: {row.text}" for row in self.rows if row.text), *self.notes)

    @property
    def json(self) -> dict[str, Any]:
        """Values by key."""
        return {row.key: row.value for row in self.rows}


def text_of(thing: object) -> str:
    """Title, verdict, values and notes of a result in at most 12 lines."""
    found = summary_of(thing) or _summary_of_fields(thing)
    head = f"{found.title}: {found.verdict}" if found.verdict else found.title
    lines = [line for text in (head, *found.lines) for line in wrap(text, WIDTH, subsequent_indent="  ")]
    if len(lines) > MOST_LINES:
        lines[MOST_LINES - 1 :] = [f"... and {len(lines) - MOST_LINES + 1} more lines"]
    return "\n".join(lines)


def _summary_of_fields(thing: Any) -> Summary:
    """Summary of a result without its own summary: shapes and ranges of arrays, and other values."""
    robot = getattr(getattr(thing, "state", thing), "robot", None)
    lines = []
    for name in (field.name for field in fields(thing)):
        value = getattr(thing, name)
        if isinstance(value, np.ndarray):
            lines.append(f"{name} {value.shape or ''}: {_extent(value, documented_units(type(thing), name))}")
        elif isinstance(value, Pose):
            lines.append(f"{name}: {f'{len(value):,} poses' if value.shape else f'at {_place(value)} m'}")
        elif not isinstance(value, Shown | Cable) and value is not None:
            lines.append(f"{name}: {shorten(str(value), WIDTH, placeholder=' ...')}")
    whose = f" of {robot.name}" if isinstance(robot, Robot) else ""
    return Summary(f"{type(thing).__name__}{whose}", "", None, tuple(lines))


def _extent(values: NDArray[Any], units: list[str]) -> str:
    """Range of `values` as text. With several `units`, one per part of the values, they follow in brackets."""
    if values.dtype.kind == "b":
        return f"{np.count_nonzero(values)} of {values.size} true"
    unit = ", ".join(units)
    if values.dtype.kind not in "fi":
        return f"{values.size} values" + (f" [{unit}]" if unit else "")
    return _range(values, unit) if "," not in unit else f"{_range(values, '')} [{unit}]"


def _place(pose: Pose) -> str:
    return f"({', '.join(n(each, '.4f') for each in pose.position.reshape(-1))})"


@singledispatch
def summary_of(thing: object) -> Summary | None:
    """Summary of a robot, a path, a plan or a result; None for other objects."""
    if isinstance(thing, Result) and type(thing).__str__ is not object.__str__:
        first, *rest = str(thing).splitlines()
        return Summary(type(thing).__name__, first, None, tuple(rest))
    return None


@summary_of.register
def _(robot: Robot) -> Summary:
    plan = middle_plan(robot)
    verdict, good = f"{robot.cable_count} cables", None
    if plan is not None:
        there = "in the middle of its test box"
        good = bool(plan.solved)
        lost = f"its equilibrium {there} is unstable" if plan.feasible else f"no tensions hold it {there}"
        how = f"{plan.tension.alone.title}, {word_of(type(plan.state.cables.model).__name__)}"
        verdict = f"held {there} by {_range(plan.chord_tension)} ({how})" if good else lost
    lines = [
        f"{robot.cable_count} cables, {robot.degrees_of_freedom} freedoms ({robot.motion_pattern}), "
        f"platform of {n(robot.mass, '.4g', 'kg')}",
        f"limits of the {robot.tension_limits_of.replace('_', ' ')} tension: "
        f"{n(robot.tension_min.min(), unit='N')} to {n(robot.tension_max.max(), unit='N')}",
    ]
    if robot.assumed:
        lines.append(f"assumed: {', '.join(robot.assumed)}")
    return Summary(robot.name, verdict, good, tuple(lines))


def middle_plan(robot: Robot) -> Plan | None:
    """Plan of the pose in the middle of the test box of `robot`; None if it has no test box or too few cables."""
    box = robot.test_box
    if box is None or is_underconstrained(robot):
        return None
    return inverse(robot, Pose(0.5 * (box.low + box.high), np.eye(3)))


@summary_of.register
def _(plan: Plan) -> Summary:
    feasible, name = np.atleast_1d(plan.feasible), plan.robot.name
    good, count = bool(plan.solved.all()), feasible.size
    how = f"{plan.method}, {word_of(type(plan.state.cables.model).__name__)}"
    lines = [f"chord tensions {_range(plan.chord_tension)} ({how})" if feasible.any() else how]
    if np.isfinite(stiffness := plan.stiffness_min).any():
        lines.append(f"least stiffness {n(np.nanmin(stiffness), '.3g', 'N/m')}")
    gaps = plan.gaps if feasible.size > 1 else ()
    if feasible.size == 1 and plan.blocking.any():
        short = f"short of {n(plan.shortfall.item(), '.4g', 'N')}; " if np.isfinite(plan.shortfall).all() else ""
        lines.insert(0, f"{short}limits of cables {', '.join(map(str, np.flatnonzero(plan.blocking)))}")
    for gap in gaps[:MOST_GAPS]:
        why = PoseStatus(gap.status).text
        short = f", {n(gap.shortfall, '.3g', 'N')} short" if np.isfinite(gap.shortfall) and gap.shortfall > 0.0 else ""
        lines.append(f"{_when(plan, gap.first, gap.last)}{short}: {why}")
    if len(gaps) > MOST_GAPS:
        lines.append(f"and {len(gaps) - MOST_GAPS} more gaps")
    if count == 1:
        verdict = "feasible" if good else PoseStatus(int(plan.status.reshape(-1)[0])).text
    else:
        verdict = f"all {count:,} poses are feasible" if good else f"{int(feasible.sum()):,} of {count:,} feasible"
        unstable = int(feasible.sum() - plan.solved.sum())
        verdict += f", {unstable:,} of them unstable" if unstable else ""
    return Summary(f"Plan of {name}", verdict, good, (*lines, *plan.warnings))


def _when(plan: Plan, first: int, last: int) -> str:
    if plan.path is None:
        return f"pose {first}" if first == last else f"poses {first} to {last}"
    times = plan.path.time[[first, last]]
    return f"at {times[0]:.4g} s" if first == last else f"{times[0]:.4g} s to {times[1]:.4g} s"


@summary_of.register
def _(state: Equilibrium) -> Summary:
    known = np.isfinite(state.unstrained_length).all(axis=-1)
    where = f"at {_place(state.pose)} m" if not known.shape else f"{known.sum():,} of {known.size:,} with lengths"
    model = word_of(type(state.cables.model).__name__)
    lines = f"chord tensions {_range(state.chord_tension)}", f"cable model {model}"
    return Summary(f"Equilibrium of {first_of(state.robot).name}", where, None, lines)


@summary_of.register
def _(proof: Confirmation) -> Summary:
    held, planned = np.atleast_1d(proof.held), np.atleast_1d(proof.plan.feasible)
    good, size = bool(held[planned].all()), 1e3 * float(np.nanmax(proof.plan.unstrained_length, initial=0.0))
    away = 1e3 * np.linalg.norm(np.atleast_2d(proof.position_error), axis=1)
    largest = float(np.nanmax(away, initial=0.0))
    verdict = f"{int(held.sum()):,} of {int(planned.sum()):,} planned poses are confirmed"
    line = f"largest position error {n(largest, '.2g', 'mm', size=size)}"
    return Summary(f"Confirmation of {proof.plan.robot.name}", verdict, good, (line,))


@summary_of.register
def _(found: ForwardSolution) -> Summary:
    solved, stable = np.atleast_1d(found.solved), np.atleast_1d(found.stable)
    verdict = f"{int(solved.sum()):,} of {solved.size:,} solved, {int((solved & stable).sum()):,} stable"
    lines = []
    if solved.size == 1 and solved[0]:
        lines = [f"at {_place(found.pose)} m, least stiffness {n(np.min(found.stiffness_min), '.3g', 'N/m')}"]
    return Summary(f"Equilibrium of {found.state.one_robot.name}", verdict, bool((solved & stable).all()), tuple(lines))


@summary_of.register
def _(simulation: Simulation) -> Summary:
    energy, duration = simulation.energy, float(simulation.time[-1] - simulation.time[0])
    largest, last = _largest_tensions(simulation), simulation.time >= simulation.time[-1] - LAST
    cable, above = int(np.argmax(largest)), np.flatnonzero(largest > simulation.robot.tension_max).tolist()
    place = simulation.pose.position[last]
    residual = float(np.linalg.norm(place - place.mean(axis=0), axis=1).max())
    size = float(np.nanmax(np.abs(energy.kinetic) + np.abs(energy.potential)))
    cables = f"cable{'s' * (len(above) > 1)} {', '.join(map(str, above))}" if above else ""
    strongest = f"{n(largest[cable], ',.1f')} N, cable {cable}"
    rows = [
        Row("duration_s", "simulated", duration, n(duration, "g", "s")),
        Row("cable_mass", "cables", simulation.cable_mass, cable_mass_text(simulation.cable_mass)),
        Row("step_s", "step", simulation.step, n(simulation.step, ".3g", "s")),
        Row("tension_max_n", "largest tension", float(largest[cable]), strongest),
        Row("cables_above_tension_max", "above tension_max", above, cables),
        Row("residual_m", f"residual vibration, last {LAST:g} s", residual, n(residual, ".3g", "m", size=1e3)),
    ]
    energies = {"supplied_j": ("work supplied", energy.supplied), "lost_j": ("energy lost", energy.lost)}
    energies["removed_j"] = ("energy of removed cables and loads", energy.removed)
    for key, (label, course) in energies.items():
        text = n(course[-1], ".4g", "J", size=size) if key != "removed_j" or course.any() else ""
        rows.append(Row(key, label, float(course[-1]), text))
    error = float(np.nanmax(np.abs(energy.error)))
    rows.append(Row("energy_error_j", "error of the energy balance", error, n(error, ".2g", "J", size=size)))
    happened = [f"{event.time:.4g} s: {event.text}" for event in simulation.events[:MOST_GAPS]]
    verdict = f"{n(duration, '.4g', 's')}, tensions at the frame {_range(simulation.tensions)}"
    return Summary(f"Simulation of {simulation.robot.name}", verdict, None, tuple(happened), tuple(rows))


def _largest_tensions(simulation: Simulation) -> Array:
    """Largest tension of each cable over all steps of a simulation [N], shape (m,)."""
    if simulation.largest_tension is not None:
        return simulation.largest_tension
    largest: Array = np.nanmax(simulation.tensions, axis=0)
    return largest


def cable_mass_text(cable_mass: str) -> str:
    """Description of the model of the cable mass."""
    return "massless" if cable_mass == "none" else f"with cable mass ({cable_mass})"


@summary_of.register
def _(swings: Vibration) -> Summary:
    count = swings.frequency.size
    verdict = f"{count} modes below {n(swings.up_to, '.4g', 'Hz')}" + ("" if swings.complete else ", some are missing")
    shown = np.sort(np.argsort(-swings.platform_share, kind="stable")[:MOST_MODES]).tolist()
    listed = [
        f"{k + 1}: {swings.frequency[k]:.3f} Hz, platform {100.0 * swings.platform_share[k]:.0f} %" for k in shown
    ]
    if count > len(shown):
        listed.append(f"not shown: {count - len(shown)} modes with a smaller share of the platform")
    return Summary(f"Vibration of {swings.state.one_robot.name}", verdict, swings.complete, tuple(listed))


@summary_of.register
def _(path: Path) -> Summary:
    length = float(np.linalg.norm(np.diff(path.pose.position, axis=0), axis=1).sum())
    span = float(path.time[-1] - path.time[0])
    return Summary("Path", f"{len(path):,} poses, {n(span, '.4g', 's')}, {n(length, '.4g', 'm')}", None, ())


@summary_of.register
def _(anchors: AnchorMotion) -> Summary:
    samples, cables, _ = anchors.position.shape
    span, speed = float(np.ptp(anchors.time)), np.linalg.norm(anchors.velocity(anchors.time), axis=-1).max()
    said = f"{samples:,} samples of {cables} anchors, {n(span, '.4g', 's')}, up to {n(float(speed), '.3g', 'm/s')}"
    return Summary("Motion of anchors", said, None, ())


@summary_of.register
def _(space: Workspace) -> Summary:
    first, *rest = str(space).splitlines()
    return Summary("Workspace", first.removeprefix("Workspace of "), space.volume > 0.0, tuple(rest))


@summary_of.register
def _(found: Calibration) -> Summary:
    verdict = f"{len(found.values)} numbers from {len(found.rows)} poses; {chi_squared_text(found)}"
    return Summary(f"Calibration of {found.robot.name}", verdict, None, tuple(str(found).splitlines()))


def _range(numbers: object, unit: str = "N") -> str:
    values = np.asarray(numbers, dtype=np.float64)
    known = values[np.isfinite(values)]
    return f"{n(known.min(), '.4g', unit)} to {n(known.max(), '.4g', unit)}" if known.size else "unknown"
