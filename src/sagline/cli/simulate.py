"""`sagline simulate`: a robot along a path in time, as it vibrates, with cables that may break."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sagline.cli.choices import CableMass, ShaperKind, Tension, Variable
from sagline.cli.entries import CHAINS, SIMULATION, SIMULATION_OVER_PULLEYS, VIBRATION, needed_for
from sagline.cli.results import figure_files, listed, write_figures
from sagline.cli.tables import Grid, show_table, written
from sagline.cli.terminal import note, show, show_json, working
from sagline.cli.track import check_unit
from sagline.cli.values import damping_of, loaded, middle_of, quantity
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.numbers import n
from sagline.dynamics.events import Break
from sagline.dynamics.shaped import shaped
from sagline.dynamics.shapers import EI, ZV, ZVD
from sagline.dynamics.simulate import simulate as integrated
from sagline.dynamics.to_shape import to_shape
from sagline.dynamics.vibrating import vibration
from sagline.files.names import file_stem
from sagline.files.path_file import load_path
from sagline.files.robot_file import load_robot
from sagline.files.typed import wrench_of
from sagline.files.whole import check_files, made_folder
from sagline.kinematics.inverse import inverse
from sagline.robot.several import anything_behind
from sagline.statics.stiffness import modes

if TYPE_CHECKING:
    from sagline.cli.line import Line
    from sagline.core.arrays import Array
    from sagline.dynamics.simulation import Simulation
    from sagline.kinematics.plan import Plan
    from sagline.motion.path import Path as MotionPath
    from sagline.robot.equilibrium import Equilibrium
    from sagline.robot.robot import Robot

SHAPERS = {ShaperKind.ZV: ZV, ShaperKind.ZVD: ZVD, ShaperKind.EI: EI}
BREAK = re.compile(r"([0-9]{1,3})@([^@]+)")
STEP = "Give the cable and when it breaks: --break 3@2.5s."
LAST = 1.0  # s at the end, over which the residual vibration is taken


class Asked(NamedTuple):
    """What was asked for, as the command line has it."""

    shaper: ShaperKind
    cable_mass: CableMass
    breaks: tuple[str, ...]
    after: str
    step: str | None
    tension: Tension
    loss_time: str
    air_damping: str


def simulate(
    name: str,
    path: Path | None,
    asked: Asked,
    wrench: str | None,
    payload: str | None,
    out: Path | None,
    *,
    figures: bool,
    as_json: bool,
) -> int:
    """Plan, simulate, tell, write and draw; returns the exit code.

    Raises:
        SaglineError: If an input is wrong or the files cannot be written; then nothing has been.
    """
    load, robot = wrench_of(wrench), loaded(load_robot(name), payload)
    events = tuple(_break(text, robot) for text in asked.breaks)
    after = quantity(asked.after, "--after", "s", low=0.0)
    step = None if asked.step is None else quantity(asked.step, "--step", "s", above=0.0)
    damping = damping_of(asked.loss_time, asked.air_damping)
    file = Path("output") / f"{file_stem(robot.name, 'simulation')}.nc" if out is None else out
    if file.suffix != ".nc":
        raise FileError(file, "does not end in .nc", "Name a NetCDF file: --out sim.nc.")
    drawing = f"{file.stem}-energy"
    check_files(file.parent, [file.name, *figure_files([drawing] * figures)])
    if path is None and asked.shaper is not ShaperKind.NONE:
        advice = "Give a path, or leave --shaper out."
        raise InvalidValueError("--shaper", f"{asked.shaper.value} without a path", "none without a path", advice)
    way = None if path is None else load_path(path)
    if path is not None and way is not None:
        check_unit(path, way, robot)
    massless = SIMULATION_OVER_PULLEYS if anything_behind(robot) else SIMULATION
    moving = {CableMass.NONE: (massless,), CableMass.LUMPED: (CHAINS,)}.get(asked.cable_mass, ())
    needed = (*needed_for(asked.tension.build(Variable.CHORD)), VIBRATION, *moving)
    with working(f"{robot.name}: simulating", *needed) as line:
        start = _start(robot, way, asked, load, line)
        end = after if way is None else _duration(start) + after
        line.stage(f"{robot.name}: {end:g} s in time, {_cables(asked.cable_mass.value)}")
        kind: Any = asked.cable_mass.value
        simulation = integrated(start, duration=end, step=step, cable_mass=kind, events=events, damping=damping)
        made_folder(file.parent)
        simulation.save(file)
        files = [file]
        if figures:
            from sagline import plot

            line.stage("drawing")
            files += write_figures({drawing: plot.energy(simulation)}, file.parent)
    if as_json:
        show_json({**_record(simulation), "files": files})
    else:
        _tell(simulation)
        show(f"In {file.parent.resolve()}: {listed(files)}", whole=True)
    return 0


def _break(text: str, robot: Robot) -> Break:
    found = BREAK.fullmatch(text.strip())
    if found is None:
        raise InvalidValueError("--break", repr(text), "CABLE@TIME", STEP)
    cable, time = int(found[1]), quantity(found[2], "--break", "s", low=0.0)
    if cable >= robot.cable_count:
        raise InvalidValueError("--break", f"cable {cable}", f"0 to {robot.cable_count - 1}", STEP)
    return Break(cable=cable, time=time)


def _start(robot: Robot, way: MotionPath | None, asked: Asked, load: Array | None, line: Line) -> Plan | Equilibrium:
    """A plan along the path, shaped if asked for; or the robot at rest."""
    method = asked.tension.build(Variable.CHORD)
    if way is None:
        plan = inverse(robot, middle_of(robot), tension=method, wrench=load)
        if not plan.feasible:
            raise InvalidValueError("robot", "not held in the middle of its test box", "one that is", "Give a path.")
        return plan.state
    if asked.shaper is not ShaperKind.NONE:
        state = inverse(robot, way.pose[len(way) - 1], wrench=load).state
        light = modes(state)
        heavy = asked.cable_mass is not CableMass.NONE
        frequency = to_shape(vibration(state, up_to=float(light.frequency.max())) if heavy else light, way)
        told = " and ".join(f"{value:.3f}" for value in frequency)
        kind = "with cable mass" if heavy else "massless"
        note("Shaper: ", f"{asked.shaper.value} for {told} Hz ({kind}), at the end of the path")
        way = shaped(way, SHAPERS[asked.shaper](frequency))
    return inverse(robot, way, tension=method, wrench=load, progress=line.stage(f"{robot.name}: planning"))


def _duration(start: Plan | Equilibrium) -> float:
    path = getattr(start, "path", None)
    return 0.0 if path is None else float(path.time[-1] - path.time[0])


def _cables(cable_mass: str) -> str:
    """Which cables, in words."""
    return "massless" if cable_mass == CableMass.NONE else f"with cable mass ({cable_mass})"


def _residual(simulation: Simulation) -> float:
    """How far the platform is from its mean at most, in the last second [m]."""
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
