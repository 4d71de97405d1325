"""Simulation of a robot: motion of the platform due to winches, wrenches, wind and events."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Final, Literal, get_args

import numpy as np

from sagline.core.arguments import check_memory, choice, optional, whole_number
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.chain_plant import FEWEST, MOST, ChainPlant
from sagline.dynamics.simulation.initial_conditions import InitialConditions, TableInTime, TimeTable, initial_conditions
from sagline.dynamics.simulation.modal import modal_simulation
from sagline.dynamics.simulation.plant import Plant
from sagline.dynamics.simulation.results import Drop, Event, PickUp, Simulation, checked_events
from sagline.dynamics.simulation.run import SimulationRun
from sagline.dynamics.simulation.winches import Winches, Winding, checked_winding, drive_data, winch_kind
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import motion as k
from sagline.kinematics.plan import Plan
from sagline.motion.anchors import AnchorMotion
from sagline.robot.equilibrium import Equilibrium, HasState
from sagline.robot.pose import Pose, PoseLike
from sagline.robot.robot import Robot

Integrator = Literal["splitting", "runge-kutta"]  # in the order of the integrator codes of the kernel
CableMass = Literal["none", "lumped", "modal"]
RECORD: Final = 0.01  # s
NODES: Final = 20  # elements of a cable with mass
LOSS_TIME: Final = 1e-3  # loss time that is assumed after a break [s]
MOST_STEPS: Final = 10**8  # steps that take some minutes


def simulate(
    start: Plan | Equilibrium | HasState | Robot,
    pose: PoseLike | None = None,
    *,
    duration: float | None = None,
    step: float | None = None,
    cable_mass: CableMass = "none",
    nodes: int = NODES,
    integrator: Integrator | None = None,
    winches: Winches = "ideal",
    winding: Winding = "constant",
    unstrained_length: TableInTime | None = None,
    events: Event | Iterable[Event] = (),
    wrench: TableInTime | None = None,
    wind: TableInTime | None = None,
    damping: Damping | None = None,
    record: float | None = None,
    anchors: AnchorMotion | None = None,
) -> Simulation:
    """Simulate a robot. The platform is a free body on exact cables, and the winches change the cable lengths.

    The set points are the lengths of the plan at its samples. Between samples they are cubic functions of time; their
    slopes at the samples are the `length_rate` of the plan. The set points are closer to the exact lengths if the path
    has more samples. A sample rate of 1 kHz is recommended.

    Args:
        start: A plan along a path, a single equilibrium, a plan of a single pose, or a robot, which rests at `pose`. A
            plan along a path gives the initial pose and speed. The external wrench of the plan acts on the platform.
            The inertial wrench of the path is not applied.
        pose: Initial pose, only if `start` is a robot. The robot rests there with the tensions of `inverse`.
        duration: Duration [s]; lengths are constant after the end of the plan or table. None: duration of the plan or
            of the table of lengths.
        step: Time step of the integrator [s]. None: 0.2 rad divided by the highest angular frequency with taut,
            massless cables, at most 1 ms.
        cable_mass: "none": cables are static catenaries at every instant, with the pulleys and dead lengths of the
            robot; they become slack if their lengths are too long. "lumped": each cable is a chain of nodes with its
            mass, at fixed material points; it swings and transmits waves. Nodes are created at the frame while cable
            is paid out, and merged while it is wound in. A chain keeps the initial exit point of its pulley.
            "modal": small motion about an equilibrium, with decoupled modes of `vibration`; lengths and wrench may
            change, and `Damping` may have modal_damping. Not supported: pulleys, events, winches, wind.
        nodes: Elements per cable with mass at the start, 4 to 500. The pose error at rest is of the order nodes^-2.
        integrator: "runge-kutta" (order 4), or "splitting" (symplectic, order 2, without energy drift in long runs).
            None: "runge-kutta", except for winches="robot", which requires "splitting".
        winches: "ideal": lengths equal their set points. SecondOrder(...): lengths lag behind their set points.
            "robot": the robot's winches with inertia, limits of torque and speed, friction, and position and speed
            loops with a period of 1 ms. From the start, the motors hold the planned tensions.
        winding: Tension of the cable on the drums. "constant": the winding_tension of the winches. "remembered": cable
            keeps the tension of its winding until it is paid out. Only for winches="robot".
        unstrained_length: Set points of the lengths, if `start` is an equilibrium: times [s] (K,) and lengths [m] (K,
            m) with linear interpolation; or one row (m,) of constant lengths.
        events: Events, each applied at the first step at or after its time: `Break`, `Stall`, `Brake`, `Drop`,
            `PickUp`.
        wrench: Wrench on the platform, one row (6,) [N, N m], or times and rows (K, 6). It replaces the wrench of
            `start`.
        wind: Velocity of the air [m/s], (3,), or times and rows (K, 3); requires the cable diameters. The wind force on
            a cable is computed for a straight cable, and half of it acts on the platform. Give the wind force on the
            platform as a wrench.
        damping: Energy losses of the cables; None: no losses.
        record: Interval of the records [s], rounded to whole steps; None: 0.01.
        anchors: Motion of the frame anchors, also for a plan with fixed anchors. At the start, the anchors are at the
            positions that `start` has; if `start` is a robot, it rests at the anchors' positions at 0 s. None: the
            anchors of the plan. Not supported: cables with mass.

    Returns:
        Simulation. Its events include the times at which a cable became slack or a winch reached a limit.

    Raises:
        InvalidValueError: If a plan has samples without a solution: the message names the first. If the step exceeds
            the stability limit. If the energy grows without input: the message names time and cable. If an event has a
            wrong cable index, or the robot lacks data of its winches. If an argument has the wrong type.

    Examples:
        A downward gust on the platform, and its work:

        >>> import numpy as np
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> state = sl.inverse(robot, sl.Pose.from_euler([0, 0, 2], 0, 0, 0)).state
        >>> gust = ([0.0, 0.2, 0.3, 0.4], np.outer([0, 0, 1, 0], [0, 0, -500, 0, 0, 0]))
        >>> run = sl.simulate(state, wrench=gust, duration=2.0)
        >>> lowest = run.pose.position[:, 2].min() - 2.0
        >>> print(f"{1e3 * lowest:.1f} mm, {run.energy.supplied[-1]:.2f} J")
        -13.7 mm, 4.79 J

    Source:
        docs/model.md, section 11; the splitting of the free turn: Dullweber, Leimkuhler & McLachlan, J. Chem. Phys.
        107, 1997.
    """
    choice(cable_mass, "cable_mass", get_args(CableMass))
    elements = whole_number(nodes, "nodes", FEWEST, MOST)
    given = initial_conditions(start, unstrained_length, wrench, duration, pose, anchors)
    if given.anchors is not None and cable_mass != "none":
        step_to = "Omit cable_mass; the weight of the cables remains."
        raise InvalidValueError("cable_mass", f'"{cable_mass}"', '"none" with moving anchors', step_to)
    if cable_mass == "modal":
        others = {"events": events, "winches": winches != "ideal", "wind": wind is not None, "integrator": integrator}
        if refused := [name for name, asked in others.items() if asked]:
            advice = 'Omit it, or give cable_mass="lumped".'
            raise InvalidValueError(refused[0], "given", 'not given for cable_mass="modal"', advice)
        written = RECORD if record is None else number(record, "record", "s", above=0.0)
        return modal_simulation(given, optional(damping, Damping, "damping") or Damping(), step, written)
    return started_run(
        given,
        elements if cable_mass == "lumped" else 0,
        step=step,
        integrator=integrator,
        winches=winches,
        winding=winding,
        events=events,
        wind=wind,
        damping=damping,
        record=record,
    ).finish()


def losses_after_break(given: InitialConditions, elements: int = 0) -> Damping:
    """Energy losses of the cables after a break. They are assumed if the caller gives no losses."""
    if elements:  # the damping of waves in stiff cables does not require smaller steps than the waves
        return Damping(loss_time=min(LOSS_TIME, 2.0 / ChainPlant.wave_frequency(given, elements)))
    return Damping(loss_time=LOSS_TIME)


def started_run(
    given: InitialConditions,
    elements: int = 0,
    *,
    step: float | None = None,
    integrator: Integrator | None = None,
    winches: Winches = "ideal",
    winding: Winding = "constant",
    events: Event | Iterable[Event] = (),
    wind: TableInTime | None = None,
    damping: Damping | None = None,
    record: float | None = None,
) -> SimulationRun:
    """Prepare a simulation at its first step."""
    if elements:
        ChainPlant.check(given)
    air = TimeTable.constant(np.zeros(3)) if wind is None else TimeTable.of(wind, "wind", "m/s", 3, given.begin)
    happening = checked_events(events, given.robot, given.begin, given.end, pieces=elements > 0)
    plant, rules, size, losses = initial_plant(
        given, elements, step, integrator, winches, winding, damping, happening, with_wind=wind is not None
    )
    every, count = _every(record, size), _count(given, size)
    numbers_each = 19 + given.robot.cable_count * (2 + (3 * elements + 3 if elements else 0))
    check_memory("record", 8.0 * numbers_each * (count / every), "Record less often.")
    numbers = (size, losses.loss_time, losses.air_damping, 1.0)
    settings = {"integrator": get_args(Integrator)[rules[0]], "winding": get_args(Winding)[rules[2]]}
    settings |= {"winches": winches, "damping": losses, "anchors": given.anchors}
    inputs = (_set_points(given, plant, rules[1]), given.wrench, air, given.places)
    return SimulationRun(plant, rules, numbers, inputs, every, count, happening, settings)


def _set_points(given: InitialConditions, plant: Plant, kind: int) -> TimeTable:
    """Set points of the drives: lengths. For drums: lengths along the winding path, then expected tensions."""
    if kind != d.DRUMS:
        return given.lengths
    stretch, table = 1.0 + plant.data[d.WINDING_STRAIN], given.lengths
    wound = TimeTable(table.time, table.value * stretch, table.begin * stretch, table.end * stretch)
    return wound.joined_columns(given.tensions)


def initial_plant(
    given: InitialConditions,
    elements: int,
    step: float | None,
    integrator: Integrator | None,
    winches: Winches,
    winding: Winding,
    damping: Damping | None,
    events: tuple[Event, ...] = (),
    *,
    with_wind: bool = False,
    spare: float = 1.0,
) -> tuple[Plant, tuple[int, int, int, int, int], float, Damping]:
    """Check the options, and create the plant at its first step, with winches at their initial speeds."""
    # `spare`: factor of the lengths up to which drums remember their winding. Returns the plant, the rules of the
    # kernel (codes of integrator and winches, remembered winding, loads, steps per period), the time step [s] and the
    # losses.
    kind, losses = winch_kind(winches), _checked_damping(damping)
    code, remembered = _integrator_code(integrator, kind, elements), checked_winding(winding, kind) == "remembered"
    length = given.state.unstrained_length
    data = drive_data(given.robot, winches, length, with_wind)
    if elements:
        plant: Plant = ChainPlant(given, data, elements, losses)
    else:
        plant = Plant(given.robot, given.model, given.state.pose, given.twist, length, data)
    plant.audit[d.BEGIN] = given.begin
    plant.now[d.RATE] = given.rate
    plant.now[d.SPEED] = given.rate * (1.0 + data[d.WINDING_STRAIN])
    if remembered:
        plant.remember_winding(spare * float(given.lengths.value.max()))
    size = _time_step(given, data, step, code, kind, losses, events, elements)
    stride = round(d.LOOP_PERIOD / size) if kind == d.DRUMS else 1
    return plant, (code, kind, int(remembered), _load_bits(losses, given, with_wind), stride), size, losses


def _checked_damping(damping: Damping | None) -> Damping:
    """The checked damping of a simulation. None gives no damping."""
    found = optional(damping, Damping, "damping") or Damping()
    if found.modal_damping > 0.0:
        step = "Give loss_time or air_damping; modal damping needs modes."
        raise InvalidValueError("damping: modal_damping", f"{found.modal_damping:g}", "0 in time", step)
    return found


def _integrator_code(integrator: Any, kind: int, elements: int) -> int:
    """The kernel's code of an integrator."""
    if integrator is not None:
        choice(integrator, "integrator", get_args(Integrator))
    if kind == d.DRUMS and integrator == "runge-kutta":
        step = "Omit integrator: static friction needs a non-smooth method."
        raise InvalidValueError("integrator", '"runge-kutta"', '"splitting" for winches="robot"', step)
    if elements and integrator == "runge-kutta":
        step = "Omit integrator: long runs of stiff chains need a method that conserves energy."
        raise InvalidValueError("integrator", '"runge-kutta"', '"splitting" for cables with mass', step)
    return k.SPLITTING if kind == d.DRUMS or elements or integrator == "splitting" else k.RUNGE_KUTTA


def _time_step(
    given: InitialConditions, data: Array, step: Any, code: int, kind: int, losses: Damping, events: Any, elements: int
) -> float:
    """Check `step` [s] at the smallest platform mass. `elements`: number of elements of a cable with mass, else 0."""
    robot, lengths = given.robot, given.lengths.value
    waves = ChainPlant.wave_frequency(given, elements) if elements else 0.0
    highest = highest_frequency(robot, given.poses, lengths, kind, data, _lightness(robot.mass, events), given.frames)
    # losses limit the step only for massless cables; for cables with mass, they are integrated implicitly
    return _checked_step(step, code, highest, Damping() if elements else losses, kind == d.DRUMS, waves)


def _lightness(mass: float, events: tuple[Event, ...]) -> float:
    """Largest factor by which drops among `events` increase the platform frequency."""
    least = now = mass
    for event in events:
        now += event.mass if isinstance(event, PickUp) else -event.mass if isinstance(event, Drop) else 0.0
        least = min(least, now)
    return float(np.sqrt(mass / least))


def _load_bits(losses: Damping, given: InitialConditions, with_wind: bool) -> int:
    """Bit mask for the kernel: one bit for each active damping or load, and for moving anchors."""
    damped = losses.loss_time > 0.0 or losses.air_damping > 0.0
    loaded = with_wind or bool(given.wrench.value.any())
    return k.DAMPED * damped + k.LOADED * loaded + k.BLOWN * with_wind + k.MOVED * (given.anchors is not None)


def _every(record: Any, step: float) -> int:
    """Convert the interval `record` between records [s] to a number of steps."""
    given = RECORD if record is None else number(record, "record", "s", above=0.0)
    if record is not None and given < 0.999 * step:
        raise InvalidValueError("record", f"{given:g} s", f">= {step:g} s, the step", "Increase it, or reduce step.")
    return max(1, round(min(given / step, MOST_STEPS)))


def _count(given: InitialConditions, step: float) -> int:
    """Number of steps from the begin to the end of the simulation."""
    count = np.ceil((given.end - given.begin) / step - 1e-9)
    if not count <= MOST_STEPS:
        longest, advice = f"<= {MOST_STEPS * step:g} s, {MOST_STEPS:.0e} steps", "Simulate a shorter time."
        raise InvalidValueError("duration", f"{given.end - given.begin:g} s", longest, advice)
    return int(count)


LIMIT: Final = {k.SPLITTING: 2.0, k.RUNGE_KUTTA: 2.0 * math.sqrt(2.0)}  # largest stable step times highest frequency
SHARE: Final = 0.2  # default product of step and highest angular frequency [rad]
# default step divided by the limit 0.4 l sqrt(rho/EA) of chains; small, because a break excites the shortest waves
WAVE_SHARE: Final = 0.465
LONGEST: Final = 1e-3  # s


def highest_frequency(
    robot: Robot,
    poses: Pose,
    lengths: Array,
    kind: int,
    data: Array,
    lightness: float = 1.0,
    frames: Array | None = None,
) -> float:
    """Highest angular frequency of platform and winches as a coupled system [rad/s]."""
    # `lightness`: factor of the platform frequency for a smaller mass. `frames`: frame anchors at the poses; None for
    # those of the robot.
    #
    # shapes: lengths (K, m) [m]; data (DATA_ROWS, m)
    frames = robot.frame_anchors if frames is None else frames
    platform = _platform_frequency(robot, poses, lengths, frames) * lightness
    if kind == d.SECOND_ORDER:
        return max(platform, float(data[d.BANDWIDTH].max() * max(1.0, 2.0 * data[d.RATIO].max())))
    if kind == d.DRUMS:  # the largest eigenvalue is at most the sum of those with one mass only
        drums = robot.cables.axial_stiffness / (lengths.min(axis=0) * data[d.INERTIA])
        return math.hypot(platform, math.sqrt(float(drums.max())))
    return platform


def _platform_frequency(robot: Robot, poses: Pose, lengths: Array, frames: Array) -> float:
    """Highest angular frequency of the platform with all cables taut [rad/s]. Sag reduces this frequency."""
    # shapes: lengths (K, m) [m]
    rotation, freedom = poses.matrix, robot.freedom
    levers = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(rotation, 1, 2)
    ends = (poses.position + rotation @ robot.center_of_mass)[:, None] + levers
    chords = ends - frames
    distance = np.linalg.norm(chords, axis=-1, keepdims=True)
    along = chords / np.maximum(distance, 1e-300)
    rows = np.concatenate((along, np.cross(levers, along)), axis=-1) @ freedom.T
    taut = np.maximum(distance[..., 0], 1e-300)
    with np.errstate(over="ignore", invalid="ignore"):  # lengths that are too short are refused below
        springs = robot.cables.axial_stiffness / (np.minimum(lengths.min(axis=0), taut) if len(poses) == 1 else taut)
        stiffness = np.swapaxes(rows, 1, 2) @ (springs[..., None] * rows)
    if not np.isfinite(stiffness).all():
        value = f"down to {lengths.min():g} m"
        raise InvalidValueError("unstrained_length", value, "longer cables", "Correct unstrained_length.")
    mass = np.zeros((len(poses), 6, 6))
    mass[:, :3, :3] = robot.mass * np.eye(3)
    mass[:, 3:, 3:] = rotation @ robot.inertia @ np.swapaxes(rotation, 1, 2)
    squares = np.linalg.eigvals(np.linalg.solve(freedom @ mass @ freedom.T, stiffness)).real
    return float(np.sqrt(max(squares.max(), 0.0)))


def _checked_step(
    step: float | None, integrator: int, highest: float, damping: Damping, stride: bool, waves: float = 0.0
) -> float:
    """Check the time step `step` [s] of a run. `highest` and `waves` are angular frequencies [rad/s]."""
    limit = _limit(integrator, max(highest, waves), damping)
    if step is None:
        usual = min(SHARE / LIMIT[integrator] * _limit(integrator, highest, damping), LONGEST)
        usual = min(usual, WAVE_SHARE * limit) if waves > 0.0 else usual
        return LONGEST / math.ceil(LONGEST / usual - 1e-9)
    given = number(step, "step", "s", above=0.0)
    if given > limit:
        what = "cables with mass" if waves > highest else "massless cables taut"
        at = f"{max(highest, waves) / (2.0 * math.pi):.3g} Hz, {what}"
        allowed = f"<= {limit:.3g} s, the limit of stability at {at}"
        raise InvalidValueError("step", f"{given:g} s", allowed, "Omit step, or give a tenth of the limit.")
    parts = LONGEST / given
    if stride and (parts < 0.5 or abs(parts - round(parts)) > 1e-9 * parts):
        step_to = "Give for instance 1e-3 or 5e-4, because drives close their loops every millisecond."
        raise InvalidValueError("step", f"{given:g} s", "0.001 s divided by a whole number", step_to)
    return LONGEST / round(parts) if stride else given


def _limit(integrator: int, highest: float, damping: Damping) -> float:
    """Longest stable step [s] at the angular frequency `highest`."""
    ratio = 0.5 * damping.loss_time * highest  # damping ratio at the highest frequency
    slower = math.sqrt(1.0 + ratio * ratio) - ratio
    return LIMIT[integrator] * slower / highest if highest > 0.0 else math.inf
