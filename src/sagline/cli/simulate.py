"""`sagline simulate`: the simulated motion of a robot along a path, with vibration and breaking cables."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import Output, TextTable, number_text, values_of
from sagline.cli.tension import reason
from sagline.cli.terminal import ProgressLine, show_note, show_text, working
from sagline.cli.track import anchors_of, load_path_near
from sagline.files.writing import file_stem

if TYPE_CHECKING:
    from sagline.core.arrays import Array
    from sagline.present.summaries import Summary


SHAPERS = ("none", "zv", "zvd", "ei")  # input shapers, which reduce the vibration that a path excites
BREAK = re.compile(r"([0-9]{1,3})@([^@]+)(?:@([^@]+))?")
EVENT = ("time_s", "kind", "cable", "tension_before_n", "tension_after_n", "limit")
STEP = "Give the cable and the time of the break: --break 3@2.5s."


_FIXED = opt.only_without("--base")  # the shaped frequencies are those of a robot with fixed anchors

_BREAKS: list[str] | None = opt.option(
    None,
    "CABLE@TIME[@POSITION]",
    "Cable and time of a break: 3@2.5s means cable 3 at 2.5 s. POSITION is 0 at the frame end and 1 at the "
    "platform end (default), for --cable-mass lumped. The option can be repeated.",
    "--break",
)


def simulate(
    name: str = opt.ROBOT,
    path: Path | None = opt.argument(
        None,
        "PATH",
        "Waypoints in .yaml, times and poses in .csv, or G-code in .ngc. Default: the platform is at rest at --pose.",
    ),
    pose: Any = opt.if_only(opt.POSE, opt.only_without("PATH")),
    shaper: str = opt.choice("none", "SHAPER", "Input shaper of the path", SHAPERS, _FIXED, opt.only_with("PATH")),
    cable_mass: Any = opt.choice("none", "KIND", "Model of the cable mass", ("none", "lumped", "modal")),
    winches: Any = opt.WINCHES,
    breaks: list[str] | None = _BREAKS,
    after: float = opt.quantity(3, "TIME", "Simulated time after the end of the path [s].", "s", low=0.0),
    step: float | None = opt.STEP,
    tension: str = opt.TENSION,
    loss_time: float | None = opt.LOSS_TIME,
    air_damping: float = opt.AIR_DAMPING,
    wrench: Any = opt.WRENCH,
    payload: float | None = opt.PAYLOAD,
    bases: list[str] | None = opt.BASES,
    files: opt.Files = opt.Files(),
) -> int:
    """Simulate the motion of a robot along a path, with vibration, input shapers and breaking cables.

    The lengths are planned as by `sagline track`. The result has the largest tension, the residual vibration at the
    end, the energy balance and the events. Figures show the tensions, the motion and the energy balance. If a
    cable breaks, the default of --loss-time is 1 ms, as in the viewer; otherwise it is 0. With --winches robot, an
    event has the active limit of a motor: torque or speed. `sagline view ROBOT FILE` plays the result in the browser.

    For example:

        sagline simulate article-suspended own_path.yaml --shaper zvd
        sagline simulate cogiro --break 3@0.5s --loss-time 0.001 --out sim.nc
        sagline simulate cogiro own_path.yaml --base ship.yaml=0,1,2,3
    """
    from sagline.dynamics.simulation.initial_conditions import initial_conditions
    from sagline.dynamics.simulation.simulate import NODES, losses_after_break
    from sagline.present.summaries import cable_mass_text, summary_of

    robot = opt.robot_with_payload(name, payload)
    events = tuple(_break(text, robot) for text in breaks or ())
    damping = sl.Damping(loss_time or 0.0, air_damping)
    output = Output(files, file_stem(robot.name, "simulation"), [".nc"], ["-motion", "-energy"], ".csv")
    way = None if path is None else load_path_near(robot, path)
    method, anchors = opt.tension_named(tension), anchors_of(robot, bases)
    with working(f"{robot.name}: simulating") as line:
        start = _start(robot, way, pose, method, shaper, cable_mass, wrench, anchors, line)
        course = getattr(start, "path", None)
        end = after if course is None else course.duration + after
        line.stage(f"{robot.name}: simulating {end:g} s, {cable_mass_text(cable_mass)}")
        if events and loss_time is None:
            given = initial_conditions(start, None, None, end)
            assumed = losses_after_break(given, NODES if cable_mass == "lumped" else 0)
            damping = sl.Damping(assumed.loss_time, air_damping)
        options: Any = {"cable_mass": cable_mass, "winches": winches, "events": events, "damping": damping}
        simulation = sl.simulate(start, duration=end, step=step, anchors=anchors, **options)
        simulation.save(output.file(".nc"))
        output.table(".csv", simulation.table)
        line.stage("drawing")
        output.draw(lambda: sl.plot.simulation(simulation), lambda: sl.plot.energy(simulation))
    summary = summary_of(simulation)
    assert summary is not None
    record = {"robot": robot.name, **summary.json, "events": [values_of(event, *EVENT) for event in simulation.events]}
    output.report(lambda: record, _verdict(simulation, summary), partial(_tell, simulation, summary))
    return 0


def _break(text: str, robot: sl.Robot) -> sl.Break:
    from sagline.cli.values import quantity

    found = BREAK.fullmatch(text.strip())
    if found is None:
        raise sl.InvalidValueError("--break", repr(text), "CABLE@TIME", STEP)
    cable, time = int(found[1]), quantity(found[2], "--break", "s", low=0.0)
    if cable >= robot.cable_count:
        raise sl.InvalidValueError("--break", f"cable {cable}", f"0 to {robot.cable_count - 1}", STEP)
    position = 1.0 if found[3] is None else quantity(found[3], "--break", "", low=0.0)
    return sl.Break(cable=cable, time=time, position=position)


def _start(
    robot: sl.Robot,
    way: sl.Path | None,
    pose: sl.Pose | None,
    method: sl.TensionMethod,
    shaper: str,
    cable_mass: str,
    load: Array | None,
    anchors: sl.AnchorMotion | None,
    line: ProgressLine,
) -> sl.Plan | sl.Equilibrium:
    """The plan of the path `way` after input shaping. Without a path, the equilibrium at rest at `pose`."""
    if way is None:
        place = opt.middle_pose(robot) if pose is None else pose
        if anchors is not None:
            robot = robot.replace(frame_anchors=anchors.at(0.0))
        plan = sl.inverse(robot, place, tension=method, wrench=load)
        if not plan.feasible:
            text, _, why = reason(robot, place, plan).partition(". ")
            value = f"infeasible ({why or text})"
            raise sl.InvalidValueError("--pose", value, "a feasible pose", "Change it, or the load.")
        return plan.state
    if shaper != "none":
        state = sl.inverse(robot, way.pose[len(way) - 1], wrench=load).state
        light = sl.modes(state)
        heavy = cable_mass != "none"
        frequency = sl.to_shape(sl.vibration(state, up_to=float(light.frequency.max())) if heavy else light, way)
        shaped_out = " and ".join(f"{value:.3f}" for value in frequency)
        kind = "with cable mass" if heavy else "massless"
        show_note("Shaper: ", f"{shaper} for {shaped_out} Hz ({kind}), at the end of the path")
        way = sl.shaped(way, {"zv": sl.ZV, "zvd": sl.ZVD, "ei": sl.EI}[shaper](frequency))
    progress = line.stage(f"{robot.name}: planning")
    return sl.inverse(robot, way, tension=method, wrench=load, anchors=anchors, progress=progress)


def _verdict(simulation: sl.Simulation, summary: Summary) -> str:
    """Sentence with the largest tension, and with the cables whose tension exceeds the limit."""
    rows = {row.key: row for row in summary.rows}
    above = rows["cables_above_tension_max"]
    limits = f"above tension_max: {above.text}" if above.value else "all cables stay below tension_max"
    return f"{simulation.robot.name}: tensions up to {rows['tension_max_n'].text}; {limits}."


def _tell(simulation: sl.Simulation, summary: Summary) -> None:
    rows = [[row.label, row.text] for row in summary.rows if row.text]
    TextTable(["", simulation.robot.name], rows, left=frozenset({0, 1})).show()
    for event in simulation.events:
        before, after = (number_text(value, ",.1f") for value in (event.tension_before, event.tension_after))
        show_text(f"{event.time:.3f} s: {event.text}, {before} N before, then at most {after} N")
