"""Simulator of a machine for a controller: one period per call, without allocation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, instance, integer, whole_number
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.initial_conditions import FIXED, InitialConditions, TimeTable, initial_conditions
from sagline.dynamics.simulation.plant import Records, energy_error
from sagline.dynamics.simulation.simulate import Integrator, initial_plant
from sagline.dynamics.simulation.winches import Encoders, LoadCells, Winches, Winding
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.kernels.cable.geometry import LENGTH
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import motion
from sagline.kernels.dynamics import progress as k
from sagline.kernels.dynamics import rigid_body as body
from sagline.kernels.dynamics.motion import LOADED
from sagline.kernels.dynamics.progress import begin_period
from sagline.kernels.jit import bound
from sagline.kinematics.inverse_solver import copy_in
from sagline.robot.batch import dead_cable
from sagline.robot.drum import has_drum_data
from sagline.robot.equilibrium import Equilibrium, HasState, equilibrium_of
from sagline.robot.pose import Pose, PoseLike
from sagline.robot.robot import Robot

NEAR: Final = 1e-6  # tolerance for a whole number of steps in a period
MOST_STEPS: Final = 10**7  # largest number of steps in one period
MOST_SEED: Final = 2**128


class Reading(NamedTuple):
    """Sensor values and true values, in read-only arrays that the next step of the simulator overwrites.

    Attributes:
        counts: Encoder counts, whole numbers as floats, shape (m,); None if data for counts are missing.
        load_cell: Measured tensions of the load cells [N], shape (m,).
        position: Position of the platform's origin [m], shape (3,).
        quaternion: Rotation platform -> world, scalar last, shape (4,).
        twist: Velocity of the platform's origin and angular velocity, world axes [m/s, rad/s], shape (6,).
        tension: Tensions at the frame ends [N], shape (m,).
        length: Unstrained lengths off the drums [m], shape (m,).
        force: Motor forces on the cables, positive outward [N], shape (m,); 0 without the robot's winches.
        saturated: Active limits of the drives, shape (m,): 0 none, 1 torque, 2 speed, 3 both.
    """

    counts: Array | None
    load_cell: Array
    position: Array
    quaternion: Array
    twist: Array
    tension: Array
    length: Array
    force: Array
    saturated: Array


class Simulator:
    """Simulated machine for the test of a controller: winches, cables without mass, platform and sensors.

    The motion is bitwise equal to that of `simulate` if its inputs are tabulated at the ends of the periods. With other
    tables the two motions differ by rounding. Do not share a simulator between threads.
    """

    def __init__(
        self,
        robot: Robot,
        start: PoseLike | Equilibrium | HasState,
        *,
        winches: Winches = "robot",
        winding: Winding = "constant",
        integrator: Integrator | None = None,
        step: float | None = None,
        damping: Damping | None = None,
        load_cell_filter: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Simulator of a robot at rest.

        Args:
            robot: The simulated robot, which may differ from the robot of the plan.
            start: A pose, at which the robot rests with the tensions of `inverse`. Or a single equilibrium, which gives
                pose, lengths off the drums and wrench.
            winches: Same as in `simulate`.
            winding: Same as in `simulate`.
            integrator: Same as in `simulate`.
            step: Same as in `simulate`.
            damping: Same as in `simulate`.
            load_cell_filter: Time constant of the load cells' first-order filter [s], >= 0.
            seed: Seed of the load cell noise.

        Raises:
            InvalidValueError: If the robot lacks data of its winches. If the step exceeds the stability limit. If an
                argument has the wrong type.

        Examples:
            >>> import sagline as sl
            >>> robot = sl.load_robot("cogiro")
            >>> state = sl.inverse(robot, sl.Pose.from_euler([0, 0, 2], 0, 0, 0)).state
            >>> machine = sl.Simulator(robot, state, winches="ideal")
            >>> for _ in range(100):
            ...     reading = machine.step(state.unstrained_length - 0.01 * machine.time, 0.01)
            >>> print(f"{machine.time:.1f} s, {reading.position[2]:.3f} m")
            1.0 s, 2.034 m
        """
        given: InitialConditions = initial_conditions(_at_rest(instance(robot, Robot, "robot"), start), None, None, 1.0)
        plant, rules, self._step, losses = initial_plant(
            given, 0, step, integrator, winches, winding, damping, spare=2.0
        )
        code, kind, remembered, loads, stride = rules
        self._plant, self._kind, m = plant, kind, given.robot.cable_count
        self._period = self._set_up_course(given, m)
        lag = number(load_cell_filter, "load_cell_filter", "s", low=0.0)
        rules = (code, kind, remembered, loads | LOADED, stride)
        numbers = (self._step, losses.loss_time, losses.air_damping, self._step / (lag + self._step))
        inputs = (self._length_table, self._wrench_table, TimeTable.constant(np.zeros(3)), FIXED)
        records = (*Records(0, m).arrays[:-1], np.empty((0, k.NOTE_COLUMNS)))
        self._settings, self._records = (rules, numbers, inputs), records
        self._cells = LoadCells(given.robot, whole_number(seed, "seed", 0, MOST_SEED), plant.now[d.FILTERED])
        stretch = 1.0 + plant.data[d.WINDING_STRAIN]
        places = (plant.now[d.WOUND], np.ones(m)) if kind == d.DRUMS else (plant.rows[LENGTH], stretch)
        counting = has_drum_data(given.robot) and given.robot.cables.diameter is not None
        self._encoders = Encoders(given.robot, *places) if counting else None
        self._platform = np.empty(body.STATE_COLUMNS)
        self._begin = bound(begin_period, *self._period, numbers=3)
        self._bind()
        self._reading = self._new_reading()
        self._run(0, 0)
        self._read()

    def _bind(self) -> None:
        """Bind the kernels to the arrays of the plant. A new mass changes these arrays."""
        plant = self._plant
        run = (*plant.arguments(*self._settings), self._records, 0, 0)
        frame = (locked(plant.robot.center_of_mass @ plant.axes), plant.turn_back)
        look = (plant.state, locked(plant.inertia.view()), *frame, self._platform)
        # arguments of the three kernels of a period, in the order of their calls
        self.kernel_arguments: tuple[tuple[Any, ...], ...] = self._period, run, look
        self._run = bound(motion.run_massless, *run, numbers=2)
        self._look = bound(body.platform_state, *look)

    def _set_up_course(self, given: InitialConditions, m: int) -> tuple[Any, ...]:
        """Create the time table from the last to the next set points. Returns the arguments of `begin_period`."""
        drums = self._kind == d.DRUMS
        stretch = 1.0 + self._plant.data[d.WINDING_STRAIN] if drums else np.ones(m)
        lengths = np.repeat(given.lengths.value, 2, axis=0)
        wide = 2 * m if drums else m
        self._length_table = TimeTable(
            np.array([-1.0, 0.0]), np.zeros((2, wide)), np.zeros((1, wide)), np.zeros((1, wide))
        )
        self._length_table.value[:, :m], self._lengths = lengths * stretch, lengths[1]
        if drums:
            self._length_table.value[:, m:] = given.tensions.value
        self._wrench_table = TimeTable(np.zeros(1), given.wrench.value.copy(), np.empty((0, 6)), np.empty((0, 6)))
        table, counters = self._length_table, self._plant.counters
        # new set points; copied to the run if all are valid
        self._given = np.zeros(m), np.zeros(wide - m), np.zeros(6)
        self._asked, self._expected, self._wrench = (array.data for array in self._given)
        writable = (table.time, table.value, table.begin, table.end)
        read_only = tuple(locked(array.view()) for array in self._given)
        least = locked(dead_cable(given.robot) + np.zeros(m))
        self._counters = counters.data
        load = self._wrench_table.value[0]
        return read_only, least, locked(stretch), lengths, writable, load, counters, False, False, 1.0

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self._counters[k.STEPS] * self._step

    @property
    def reading(self) -> Reading:
        """Last sensor values."""
        return self._reading

    def step(
        self,
        unstrained_length: ArrayLike,
        dt: float,
        *,
        tension: ArrayLike | None = None,
        wrench: ArrayLike | None = None,
    ) -> Reading:
        """Simulate one period, during which the set points change linearly to the given values.

        Args:
            unstrained_length: Set points at the end of the period [m], shape (m,).
            dt: Period [s], > 0, a whole number of steps.
            tension: Expected tensions at the drums at the end of the period [N], shape (m,); the motors counteract
                these tensions. None: unchanged. Only for winches="robot".
            wrench: Wrench on the platform during the whole period [N, N m], shape (6,); None: unchanged.

        Returns:
            Sensor values at the end of the period; the next step overwrites its arrays.

        Raises:
            InvalidValueError: If the period is not a whole number of steps, a length is not longer than its dead
                length, or an argument has the wrong type or shape: the state is then unchanged. If the energy grows
                without input.
        """
        count = self._count(dt)
        copy_in(self._asked, unstrained_length, "unstrained_length", "m")
        if tension is not None:
            self._take_tension(tension)
        if wrench is not None:
            copy_in(self._wrench, wrench, "wrench", "N or N m")
        end = (self._counters[k.STEPS] + count) * self._step
        if not self._begin(tension is not None, wrench is not None, end):
            self._refuse(tension is not None)
        self._run(count, 0)
        if self._counters[k.FAILED]:
            raise energy_error(self._step, self.time, self._counters[k.FAILED] - 1)
        self._read()
        return self._reading

    def _take_tension(self, tension: ArrayLike) -> None:
        if self._kind != d.DRUMS:
            step = "Omit it: these winches have no motors."
            raise InvalidValueError("tension", "given", 'None, unless winches="robot"', step)
        copy_in(self._expected, tension, "tension", "N")

    def _refuse(self, with_tension: bool) -> NoReturn:
        """Raise an error for the first invalid set point."""
        lengths, tension, wrench = self._given
        checked(lengths, "unstrained_length", "m", above=0.0)
        TimeTable.constant(lengths).check_lengths(self._plant.robot)
        if with_tension:
            checked(tension, "tension", "N")
        checked(wrench, "wrench", "N or N m")
        raise AssertionError("a period that could not begin")

    def _count(self, dt: float) -> int:
        """Number of steps in the period `dt`."""
        period = dt if type(dt) is float and 0.0 < dt < MOST_STEPS else number(dt, "dt", "s", above=0.0)
        parts = period / self._step
        count = round(min(parts, 2.0 * MOST_STEPS))
        if 1 <= count <= MOST_STEPS and abs(parts - count) <= NEAR:
            return count
        allowed = f"a whole multiple of {self._step:g} s, the step, up to {MOST_STEPS:.0e}"
        raise InvalidValueError("dt", f"{period:g} s", allowed, "Choose another period, or give Simulator a step.")

    def hold(self, *winches: int) -> None:
        """Lock drums immediately, like a brake. They remain locked until `release`.

        Args:
            winches: Indices of the winches, from 0; none for all.

        Raises:
            InvalidValueError: If a winch does not exist.
        """
        self._plant.lock_winches(self._chosen(winches))

    def release(self, *winches: int) -> None:
        """Release locked drums. Their set points change linearly to the next given values.

        The integral part of a motor's controller starts at zero. At first, the motor holds the expected tension only.

        Args:
            winches: Indices of the winches, from 0; none for all.

        Raises:
            InvalidValueError: If a winch does not exist.
        """
        plant, chosen = self._plant, np.zeros(len(self._asked), dtype=np.bool_)
        chosen[self._chosen(winches)] = True
        freed = chosen & (plant.now[d.HELD] > 0.0)
        plant.now[d.HELD, freed] = plant.now[d.INTEGRAL, freed] = 0.0
        if self._kind != d.SECOND_ORDER:  # these also store previous set points
            stood = plant.now[d.WOUND] if self._kind == d.DRUMS else plant.rows[LENGTH]
            self._lengths[freed] = plant.rows[LENGTH, freed]
            self._length_table.value[1, : len(freed)][freed] = stood[freed]

    def shift(self, length: float, *winches: int) -> None:
        """Shift set points suddenly, as if an encoder lost counts. The drives move to the shifted set points.

        Args:
            length: Shift of the present set points [m], from which the motion to the next set points starts.
            winches: Indices of the winches, from 0; none for all.

        Raises:
            InvalidValueError: If a winch does not exist, or `length` is not a number.
        """
        chosen, by = self._chosen(winches), number(length, "length", "m")
        drums = self._kind == d.DRUMS
        self._lengths[chosen] += by
        own = self._length_table.value[1, : len(self._asked)]
        own[chosen] += by * (1.0 + self._plant.data[d.WINDING_STRAIN, chosen] if drums else 1.0)

    def cut(self, *cables: int) -> None:
        """Break cables. Their forces and weights vanish, but their drums still follow the set points.

        Args:
            cables: Indices of the cables, from 0; none for all.

        Raises:
            InvalidValueError: If a cable does not exist.
        """
        self._plant.cut(self._chosen(cables, "cables"))

    def drop(self, mass: float) -> None:
        """Remove a part of the platform's mass. The inertia decreases in proportion; the velocity is unchanged.

        Args:
            mass: Mass [kg], > 0, less than the present mass of the platform.

        Raises:
            InvalidValueError: If `mass` is not such a number.
        """
        given, present = number(mass, "mass", "kg", above=0.0), float(self._plant.inertia[0])
        if not given < present:
            step = "Drop less than the platform's mass."
            raise InvalidValueError("mass", f"{given:g} kg", f"< {present:g} kg, the platform's mass", step)
        self._set_mass(present - given, at_rest=False)

    def pick_up(self, mass: float) -> None:
        """Add a mass at rest to the platform. The inertia increases in proportion; the momentum is unchanged.

        Args:
            mass: Mass [kg], > 0.

        Raises:
            InvalidValueError: If `mass` is not a number > 0.
        """
        self._set_mass(float(self._plant.inertia[0]) + number(mass, "mass", "kg", above=0.0), at_rest=True)

    def _set_mass(self, mass: float, *, at_rest: bool) -> None:
        self._plant.with_mass(mass, at_rest=at_rest)
        self._counters[k.READY] = 0  # compute all forces and energies again
        self._bind()

    def limit_force(self, force: float, *winches: int) -> None:
        """Limit the force of drives, for instance for a hot motor.

        Args:
            force: Largest force at the cable [N], >= 0.
            winches: Indices of the winches, from 0; none for all.

        Raises:
            InvalidValueError: If a winch does not exist, or the winches have no motors. If `force` is not a number >=
                0.
        """
        if self._kind != d.DRUMS:
            step = "Omit it: these winches have no motors."
            raise InvalidValueError("force", "given", 'for winches="robot" alone', step)
        self._plant.data[d.FORCE_LIMIT, self._chosen(winches)] = number(force, "force", "N", low=0.0)

    def _chosen(self, winches: tuple[Any, ...], item: str = "winches") -> Any:
        m = len(self._asked)
        for winch in winches:
            if (found := integer(winch)) is None or not 0 <= found < m:
                raise InvalidValueError(item, brief(winch), f"0 to {m - 1}", "Indices start at 0.")
        return [integer(winch) for winch in winches] if winches else slice(None)

    def _new_reading(self) -> Reading:
        plant = self._plant
        counts = None if self._encoders is None else locked(self._encoders.counts.view())
        own = (self._platform[:3], self._platform[3:7], self._platform[7:])
        true = (*own, plant.now[d.AT_FRAME], plant.rows[LENGTH], plant.now[d.FORCE], plant.now[d.SATURATED])
        return Reading(counts, *(locked(array.view()) for array in (self._cells.reading, *true)))

    def _read(self) -> None:
        """Fill the arrays of the sensor values."""
        self._look()
        self._cells.read()
        if self._encoders is not None:
            self._encoders.read()


def _at_rest(robot: Robot, start: Any) -> Equilibrium:
    """Compute the equilibrium of the robot at the start."""
    if isinstance(start, Pose | list | tuple | np.ndarray):
        return equilibrium_of(robot, start)
    state = equilibrium_of(start, item="start")
    if state.cables.shape[-1:] != (robot.cable_count,):
        allowed = f"{robot.cable_count}, as {robot.name} has"
        raise InvalidValueError("start", f"of {state.cables.shape[-1]} cables", allowed, "Give a state of this robot.")
    return replace(state, robot=robot)
