"""`sagline simulate`: a robot along a path in time, as it vibrates, with cables that may break."""

from __future__ import annotations

import re
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sagline.cli.entries import CHAINS, SIMULATION, SIMULATION_OVER_PULLEYS, VIBRATION, needed_for
from sagline.cli.options import (
    AirDampingOption,
    JsonOption,
    LossTimeOption,
    PayloadOption,
    RobotArgument,
    Tension,
    TensionOption,
    Variable,
    WrenchOption,
    argument,
    choice,
    figures_flag,
    option,
)
from sagline.cli.output import Grid, Output, show_table, written
from sagline.cli.terminal import note, show, show_json, working
from sagline.cli.track import check_unit
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.numbers import n

if TYPE_CHECKING:
    from sagline.cli.progress import ProgressLine
    from sagline.core.arrays import Array
    from sagline.dynamics.simulation.results import Break, Simulation
    from sagline.kinematics.plan import Plan
    from sagline.motion.path import Path as MotionPath
    from sagline.robot.equilibrium import Equilibrium
    from sagline.robot.robot import Robot
    from sagline.tension.method import TensionMethod


class ShaperKind(StrEnum):
    """Input shapers of a path against vibration."""

    NONE = "none"
    ZV = "zv"
    ZVD = "zvd"
    EI = "ei"


class CableMass(StrEnum):
    """Models of the cables' mass in motion."""

    NONE = "none"
    LUMPED = "lumped"
    MODAL = "modal"


BREAK = re.compile(r"([0-9]{1,3})@([^@]+)")
STEP = "Give the cable and when it breaks: --break 3@2.5s."
LAST = 1.0  # s at the end, over which the residual vibration is taken


def simulate(
    name: RobotArgument,
    path: Annotated[
        Path | None,
        argument(
            "PATH", "Waypoints in .yaml, or time and pose in .csv. Default: at rest in the middle of the test box."
        ),
    ] = None,
    shaper: Annotated[ShaperKind, choice("SHAPER", "Shapes the path", ShaperKind)] = ShaperKind.NONE,
    cable_mass: Annotated[CableMass, choice("KIND", "Mass of the cables", CableMass)] = CableMass.NONE,
    breaks: Annotated[
        list[str] | None, option("CABLE@TIME", "A cable breaks: 3@2.5s. May be given again.", "--break")
    ] = None,
    after: Annotated[str, option("TIME", "How long it goes on after the path's end [s].")] = "3",
    step: Annotated[str | None, option("TIME", "Of the integrator [s]. Default: as the robot needs it.")] = None,
    tension: TensionOption = Tension.CLOSEST,
    loss_time: LossTimeOption = "0",
    air_damping: AirDampingOption = "0",
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    out: Annotated[
        Path | None, option("FILE", "File to write. Default: ROBOT-simulation.nc in output.", "--out")
    ] = None,
    figures: Annotated[bool, figures_flag("Draw the balance of energy beside it, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> int:
    """Move a robot in time along a path, vibrating as it does, with cables that may break.

    Lengths are planned as `sagline track` plans them. What is told: the largest tension, how far the platform still
    swings at the end, the balance of energy, and what happened. Play the file with `sagline view ROBOT FILE`.

    For example:

        sagline simulate article-suspended own_path.yaml --shaper zvd
        sagline simulate cogiro --break 3@0.5s --loss-time 0.001 --out sim.nc
    """
    from sagline.cli.values import damping_of, quantity, robot_with
    from sagline.dynamics.simulation.simulate import simulate as integrated
    from sagline.files.path_file import load_path
    from sagline.files.pose_text import wrench_of
    from sagline.files.writing import file_stem
    from sagline.robot.batch import has_routing

    load, robot = wrench_of(wrench), robot_with(name, payload)
    events = tuple(_break(text, robot) for text in breaks or ())
    rest = quantity(after, "--after", "s", low=0.0)
    size = None if step is None else quantity(step, "--step", "s", above=0.0)
    damping = damping_of(loss_time, air_damping)
    file = Path("output") / f"{file_stem(robot.name, 'simulation')}.nc" if out is None else out
    if file.suffix != ".nc":
        raise FileError(file, "does not end in .nc", "Name a NetCDF file: --out sim.nc.")
    drawing = f"{file.stem}-energy"
    output = Output(file.parent, [file.name], [drawing] * figures)
    if path is None and shaper is not ShaperKind.NONE:
        advice = "Give a path, or leave --shaper out."
        raise InvalidValueError("--shaper", f"{shaper.value} without a path", "none without a path", advice)
    way = None if path is None else load_path(path)
    if path is not None and way is not None:
        check_unit(path, way, robot)
    massless = SIMULATION_OVER_PULLEYS if has_routing(robot) else SIMULATION
    moving = {CableMass.NONE: (massless,), CableMass.LUMPED: (CHAINS,)}.get(cable_mass, ())
    method = tension.build(Variable.CHORD)
    needed = (*needed_for(method), VIBRATION, *moving)
    with working(f"{robot.name}: simulating", *needed) as line:
        start = _start(robot, way, method, shaper, cable_mass, load, line)
        end = rest if way is None else _duration(start) + rest
        line.stage(f"{robot.name}: {end:g} s in time, {_cables(cable_mass.value)}")
        kind: Any = cable_mass.value
        simulation = integrated(start, duration=end, step=size, cable_mass=kind, events=events, damping=damping)
        simulation.save(output.file(file.name))
        if figures:
            from sagline import plot

            line.stage("drawing")
            output.draw(plot.energy(simulation))
    if as_json:
        show_json({**_record(simulation), "files": output.files})
    else:
        _tell(simulation)
        output.show()
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
    method: TensionMethod,
    shaper: ShaperKind,
    cable_mass: CableMass,
    load: Array | None,
    line: ProgressLine,
) -> Plan | Equilibrium:
    """A plan along the path, shaped if asked for; or the robot at rest."""
    from sagline.cli.values import middle_of
    from sagline.dynamics.trajectories.shapers import EI, ZV, ZVD, shaped
    from sagline.dynamics.vibration.vibration import to_shape, vibration
    from sagline.kinematics.inverse import inverse
    from sagline.statics.stiffness import modes

    if way is None:
        plan = inverse(robot, middle_of(robot), tension=method, wrench=load)
        if not plan.feasible:
            raise InvalidValueError("robot", "not held in the middle of its test box", "one that is", "Give a path.")
        return plan.state
    if shaper is not ShaperKind.NONE:
        state = inverse(robot, way.pose[len(way) - 1], wrench=load).state
        light = modes(state)
        heavy = cable_mass is not CableMass.NONE
        frequency = to_shape(vibration(state, up_to=float(light.frequency.max())) if heavy else light, way)
        told = " and ".join(f"{value:.3f}" for value in frequency)
        kind = "with cable mass" if heavy else "massless"
        note("Shaper: ", f"{shaper.value} for {told} Hz ({kind}), at the end of the path")
        way = shaped(way, {ShaperKind.ZV: ZV, ShaperKind.ZVD: ZVD, ShaperKind.EI: EI}[shaper](frequency))
    return inverse(robot, way, tension=method, wrench=load, progress=line.stage(f"{robot.name}: planning"))


def _duration(start: Plan | Equilibrium) -> float:
    path = getattr(start, "path", None)
    return 0.0 if path is None else float(path.time[-1] - path.time[0])


def _cables(cable_mass: str) -> str:
    """Model of the cables' mass, in words."""
    return "massless" if cable_mass == CableMass.NONE else f"with cable mass ({cable_mass})"


def _residual(simulation: Simulation) -> float:
    """Largest distance of the platform from its mean position in the last second [m]."""
    last = simulation.time >= simulation.time[-1] - LAST
    place = simulation.pose.position[last]
    return float(np.linalg.norm(place - place.mean(axis=0), axis=1).max())


def _largest(simulation: Simulation) -> Array:
    """The largest tension of each cable at any step, for which cables, anchors and winches are to be designed [N]."""
    if simulation.largest_tension is not None:
        return simulation.largest_tension
    largest: Array = np.nanmax(simulation.tensions, axis=0)
    return largest


def _above(simulation: Simulation) -> list[int]:
    """Cables whose tension exceeds the robot's limit."""
    return np.flatnonzero(_largest(simulation) > simulation.robot.tension_max).tolist()


def _tell(simulation: Simulation) -> None:
    energy = simulation.energy
    largest = _largest(simulation)
    cable, above = int(np.argmax(largest)), _above(simulation)
    size = float(np.nanmax(np.abs(energy.kinetic) + np.abs(energy.potential)))
    rows = [
        ["simulated", f"{simulation.time[-1] - simulation.time[0]:g} s"],
        ["cables", _cables(simulation.cable_mass)],
        ["step", n(simulation.step, ".3g", "s")],
        ["largest tension", f"{written(largest[cable], ',.1f')} N, cable {cable}"],
        *([["above tension_max", f"cable{'s' * (len(above) > 1)} {', '.join(map(str, above))}"]] if above else []),
        [f"residual, last {LAST:g} s", n(_residual(simulation), ".3g", "m", size=1e3)],
        ["work supplied", n(energy.supplied[-1], ".4g", "J", size=size)],
        ["energy lost", n(energy.lost[-1], ".4g", "J", size=size)],
        *([["left with cables", n(energy.removed[-1], ".4g", "J", size=size)]] if energy.removed.any() else []),
        ["error of the balance", n(np.nanmax(np.abs(energy.error)), ".2g", "J", size=size)],
    ]  # fmt: skip
    show_table(Grid(["", simulation.robot.name], rows, left=frozenset({0, 1})))
    for event in simulation.events:
        what = event.kind if event.cable is None else f"{event.kind} of cable {event.cable}"
        before, after = (written(value, ",.1f") for value in (event.tension_before, event.tension_after))
        show(f"{event.time:.3f} s: {what}, {before} N before, then at most {after} N")


def _record(simulation: Simulation) -> dict[str, Any]:
    energy = simulation.energy
    return {
        "robot": simulation.robot.name,
        "cable_mass": simulation.cable_mass,
        "step_s": simulation.step,
        "duration_s": float(simulation.time[-1] - simulation.time[0]),
        "tension_max_n": float(_largest(simulation).max()),
        "cables_above_tension_max": _above(simulation),
        "residual_m": _residual(simulation),
        "supplied_j": float(energy.supplied[-1]),
        "lost_j": float(energy.lost[-1]),
        "removed_j": float(energy.removed[-1]),
        "energy_error_j": float(np.nanmax(np.abs(energy.error))),
        "events": [
            {
                "time_s": event.time,
                "kind": event.kind,
                "cable": event.cable,
                "tension_before_n": event.tension_before,
                "tension_after_n": event.tension_after,
            }
            for event in simulation.events
        ],
    }
