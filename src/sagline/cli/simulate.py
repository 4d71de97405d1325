"""`sagline simulate`: the simulated motion of a robot along a path, with vibration and breaking cables."""

from __future__ import annotations

import re
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sagline.cli.options import (
    USUAL_FORMATS,
    AirDampingOption,
    FiguresOption,
    FigureStyle,
    FormatsOption,
    JsonOption,
    LossTimeOption,
    OutOption,
    PayloadOption,
    PoseOption,
    RobotArgument,
    StyleOption,
    TableOption,
    Tension,
    TensionOption,
    TensionVariable,
    WrenchOption,
    argument,
    choice_option,
    only_with,
    only_without,
    option,
    quantity_option,
)
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.tension import reason
from sagline.cli.terminal import show_note, show_text, working
from sagline.cli.track import check_unit
from sagline.core.errors import InvalidValueError

if TYPE_CHECKING:
    from sagline.cli.progress import ProgressLine
    from sagline.core.arrays import Array
    from sagline.dynamics.simulation.results import Break, Occurrence, Simulation
    from sagline.kinematics.plan import Plan
    from sagline.motion.path import Path as MotionPath
    from sagline.present.summaries import Summary
    from sagline.robot.equilibrium import Equilibrium
    from sagline.robot.pose import Pose
    from sagline.robot.robot import Robot
    from sagline.tension.method import TensionMethod


class _ShaperKind(StrEnum):
    """Input shapers, which reduce the vibration that a path excites."""

    NONE = "none"
    ZV = "zv"
    ZVD = "zvd"
    EI = "ei"


class _CableMass(StrEnum):
    """Models of the mass of moving cables."""

    NONE = "none"
    LUMPED = "lumped"
    MODAL = "modal"


BREAK = re.compile(r"([0-9]{1,3})@([^@]+)")
STEP = "Give the cable and the time of the break: --break 3@2.5s."


_PathOption = Annotated[
    Path | None,
    argument("PATH", "Waypoints in .yaml, or times and poses in .csv. Default: the platform is at rest at --pose."),
]
_ShaperOption = Annotated[
    _ShaperKind, choice_option("SHAPER", "Input shaper of the path", _ShaperKind), only_with("PATH")
]
_BreaksOption = Annotated[
    list[str] | None,
    option(
        "CABLE@TIME", "Cable and time of a break: 3@2.5s means cable 3 at 2.5 s. The option can be repeated.", "--break"
    ),
]
_StepOption = Annotated[
    float | None,
    quantity_option("TIME", "Time step of the integrator [s]. Default: a step that suits the robot.", "s", above=0.0),
]


def simulate(
    name: RobotArgument,
    path: _PathOption = None,
    pose: Annotated[PoseOption, only_without("PATH")] = None,
    shaper: _ShaperOption = _ShaperKind.NONE,
    cable_mass: Annotated[_CableMass, choice_option("KIND", "Model of the cable mass", _CableMass)] = _CableMass.NONE,
    breaks: _BreaksOption = None,
    after: Annotated[float, quantity_option("TIME", "Simulated time after the end of the path [s].", "s", low=0.0)] = 3,
    step: _StepOption = None,
    tension: TensionOption = Tension.CLOSEST,
    loss_time: LossTimeOption = None,
    air_damping: AirDampingOption = 0,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    folder: OutOption = Path("output"),
    figures: FiguresOption = True,
    formats: FormatsOption = USUAL_FORMATS,
    style: StyleOption = FigureStyle.PLAIN,
    write_table: TableOption = False,
    as_json: JsonOption = False,
) -> int:
    """Simulate the motion of a robot along a path, with vibration, input shapers and breaking cables.

    The lengths are planned as by `sagline track`. The result has the largest tension, the residual vibration at the
    end, the energy balance and the events. Figures show the tensions, the motion and the energy balance. The default
    of --loss-time is 1 ms if a cable breaks (as in the viewer), otherwise 0. To play the result in the browser, use
    `sagline view ROBOT FILE`.

    For example:

        sagline simulate article-suspended own_path.yaml --shaper zvd
        sagline simulate cogiro --break 3@0.5s --loss-time 0.001 --out sim.nc
    """
    from sagline.cli.values import robot_with_payload
    from sagline.dynamics.simulation.initial_conditions import initial_conditions
    from sagline.dynamics.simulation.simulate import NODES, losses_after_break
    from sagline.dynamics.simulation.simulate import simulate as integrate
    from sagline.dynamics.vibration.dynamic_stiffness import Damping
    from sagline.files.path_file import load_path
    from sagline.files.writing import file_stem
    from sagline.present.summaries import cable_mass_text, summary_of

    robot = robot_with_payload(name, payload)
    events = tuple(_break(text, robot) for text in breaks or ())
    damping = Damping(loss_time or 0.0, air_damping)
    stem, parts = file_stem(robot.name, "simulation"), [".nc", *[".csv"] * write_table]
    output = Output(folder, stem, parts, ["-motion", "-energy"] if figures else [], formats, style)
    way = None if path is None else load_path(path)
    if path is not None and way is not None:
        check_unit(path, way, robot)
    method = tension.build(TensionVariable.CHORD)
    with working(f"{robot.name}: simulating") as line:
        start = _start(robot, way, pose, method, shaper, cable_mass, wrench, line)
        end = after if way is None else _duration(start) + after
        line.stage(f"{robot.name}: simulating {end:g} s, {cable_mass_text(cable_mass.value)}")
        kind: Any = cable_mass.value
        if events and loss_time is None:
            given = initial_conditions(start, None, None, end)
            assumed = losses_after_break(given, NODES if cable_mass is _CableMass.LUMPED else 0)
            damping = Damping(assumed.loss_time, air_damping)
        simulation = integrate(start, duration=end, step=step, cable_mass=kind, events=events, damping=damping)
        simulation.save(output.file(".nc"))
        if write_table:
            output.table(".csv", simulation.table().rows)
        if figures:
            from sagline import plot

            line.stage("drawing")
            output.draw(lambda: plot.simulation(simulation), lambda: plot.energy(simulation))
    summary = summary_of(simulation)
    assert summary is not None
    record = {"robot": robot.name, **summary.json, "events": [_record(event) for event in simulation.events]}
    output.report(lambda: record, _verdict(simulation, summary), partial(_tell, simulation, summary), as_json=as_json)
    return 0


def _break(text: str, robot: Robot) -> Break:
    from sagline.cli.values import quantity
    from sagline.dynamics.simulation.results import Break

    found = BREAK.fullmatch(text.strip())
    if found is None:
        raise InvalidValueError("--break", repr(text), "CABLE@TIME", STEP)
    cable, time = int(found[1]), quantity(found[2], "--break", "s", low=0.0)
    if cable >= robot.cable_count:
        raise InvalidValueError("--break", f"cable {cable}", f"0 to {robot.cable_count - 1}", STEP)
    return Break(cable=cable, time=time)


def _start(
    robot: Robot,
    way: MotionPath | None,
    pose: Pose | None,
    method: TensionMethod,
    shaper: _ShaperKind,
    cable_mass: _CableMass,
    load: Array | None,
    line: ProgressLine,
) -> Plan | Equilibrium:
    """The plan of the path, after input shaping if a shaper is chosen; without a path, the plan of one pose at rest."""
    from sagline.cli.values import middle_pose
    from sagline.dynamics.trajectories.shapers import EI, ZV, ZVD, shaped
    from sagline.dynamics.vibration.vibration import to_shape, vibration
    from sagline.kinematics.inverse import inverse
    from sagline.statics.stiffness import modes

    if way is None:
        place = middle_pose(robot) if pose is None else pose
        plan = inverse(robot, place, tension=method, wrench=load)
        if not plan.feasible:
            text, _, why = reason(robot, place, plan).partition(". ")
            raise InvalidValueError(
                "--pose", f"infeasible ({why or text})", "a feasible pose", "Change it, or the load."
            )
        return plan.state
    if shaper is not _ShaperKind.NONE:
        state = inverse(robot, way.pose[len(way) - 1], wrench=load).state
        light = modes(state)
        heavy = cable_mass is not _CableMass.NONE
        frequency = to_shape(vibration(state, up_to=float(light.frequency.max())) if heavy else light, way)
        shaped_out = " and ".join(f"{value:.3f}" for value in frequency)
        kind = "with cable mass" if heavy else "massless"
        show_note("Shaper: ", f"{shaper.value} for {shaped_out} Hz ({kind}), at the end of the path")
        way = shaped(way, {_ShaperKind.ZV: ZV, _ShaperKind.ZVD: ZVD, _ShaperKind.EI: EI}[shaper](frequency))
    return inverse(robot, way, tension=method, wrench=load, progress=line.stage(f"{robot.name}: planning"))


def _duration(start: Plan | Equilibrium) -> float:
    path = getattr(start, "path", None)
    return 0.0 if path is None else float(path.time[-1] - path.time[0])


def _verdict(simulation: Simulation, summary: Summary) -> str:
    """Text of the largest tension, and of the cables whose tension exceeds the limit."""
    rows = {row.key: row for row in summary.rows}
    above = rows["cables_above_tension_max"]
    limits = f"above tension_max: {above.text}" if above.value else "all cables stay below tension_max"
    return f"{simulation.robot.name}: tensions up to {rows['tension_max_n'].text}; {limits}."


def _tell(simulation: Simulation, summary: Summary) -> None:
    rows = [[row.label, row.text] for row in summary.rows if row.text]
    show_table(TextTable(["", simulation.robot.name], rows, left=frozenset({0, 1})))
    for event in simulation.events:
        what = event.kind if event.cable is None else f"{event.kind} of cable {event.cable}"
        before, after = (number_text(value, ",.1f") for value in (event.tension_before, event.tension_after))
        show_text(f"{event.time:.3f} s: {what}, {before} N before, then at most {after} N")


def _record(event: Occurrence) -> dict[str, Any]:
    return {
        "time_s": event.time,
        "kind": event.kind,
        "cable": event.cable,
        "tension_before_n": event.tension_before,
        "tension_after_n": event.tension_after,
    }
