"""Whole machine in one process: the true robot, drives, PLCs and network."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from sagline.control.link import COUNTERS, PERIOD, Command, groups_of
from sagline.core.arguments import brief, choice, elements, flag, instance, optional, whole_number
from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.simulator import Reading
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.twin import link as plc_link
from sagline.twin.hardware import CELL, LENGTH, Hardware
from sagline.twin.injected import KINDS, Injected, TimedQueue, fault
from sagline.twin.plc_program import Order, PlcLimits, Program

LOSSES: Final = Damping(loss_time=1e-3, air_damping=0.2)  # assumed; the prototype has about 2 N s/m of air damping
MOST_SEED: Final = 2**63 - 1
LARGEST_ID: Final = 2**32 - 1
RIVAL: Final = 2**31 - 2  # id of the controller that owns a group because of an injected fault
TRIPPED: Final = 1  # fault code of a tripped drive


class Machine:
    """Machine that is simulated in steps of one period, for a controller in this process or for a server.

    A controller in the same process uses `link`. Each exchange advances the machine by a period. A server for
    controllers in other processes makes the following calls in every period:

        machine.claim(group, owner)      # if a claim was written
        machine.take(group, command)     # command in the group's block, for its own winches only
        machine.advance()
        machine.report(group)            # present block of the group; None: leave the block unchanged

    At the beginning of a period, each PLC runs its program, and converts set points to counts with the data of the
    nominal drums. The drives then move linearly until the end of the period. The true drums convert counts to cable
    length. The inner control loops use the exact drum angles every millisecond. Only the readings are rounded to whole
    counts; a count is some nanometers of cable.

    Attributes:
        robot: The true robot.
        nominal: The robot whose data planning and PLCs use.
        groups: The winches of each group, from 0.
        period: Period of controller and PLCs [s].
    """

    def __init__(
        self,
        robot: Robot,
        *,
        nominal: Robot | None = None,
        start: Pose | None = None,
        surveyed: bool = False,
        seed: int = 0,
        period: float = PERIOD,
        step: float = 1e-3,
        delay: float = 0.0,
        jitter: float = 0.0,
        loss: float = 0.0,
        damping: Damping | None = None,
        faults: str | Injected | Iterable[str | Injected] = (),
    ) -> None:
        """Switch a machine on, with its platform at rest and its brakes on.

        Args:
            robot: The true robot, with all data of its winches and encoders.
            nominal: The robot used for planning; the PLCs use its data for counts and limits. None: the true robot. The
                zero error of an encoder is the difference of `length_zero` between both robots, or zero if a value is
                missing.
            start: Pose at which the encoders were set; None for the middle of the nominal robot's test_box. The
                platform is at the equilibrium for the free lengths that the nominal robot has at this pose.
            surveyed: True if the true platform was exactly at the pose `start` when the encoders were set.
            seed: Seed for the noise of sensors, the clocks and the network.
            period: Period of controller and PLCs [s], a whole multiple of the step.
            step: Step of the simulation of the plant [s].
            delay: Delay of every message over `link`, in each direction [s].
            jitter: Largest additional delay, uniformly distributed [s].
            loss: Share of the messages that are lost.
            damping: Damping of the cables; None for a loss time of 1 ms and air damping.
            faults: One or several faults, each as a text (see `fault`) or as a result of `fault`.

        Raises:
            InvalidValueError: If data are missing. If `step` is too long for the robot's modes. If the robot has no
                equilibrium near `start`. If an argument has the wrong type.

        Examples:
            >>> import sagline as sl
            >>> machine = sl.twin.Machine(sl.load_robot("article-prototype"), seed=1)
            >>> sample = machine.link().exchange(None)
            >>> print(f"{sample.time:g} s, {sample.length[0]:.3f} m")
            0.01 s, 3.484 m
        """
        self.robot = instance(robot, Robot, "robot")
        self.nominal = optional(nominal, Robot, "nominal") or robot
        if self.nominal.cable_count != robot.cable_count:
            allowed = f"of {robot.cable_count} cables, as {robot.name} has"
            raise InvalidValueError("nominal", f"of {self.nominal.cable_count} cables", allowed, "Give as many.")
        self.groups, self.period = groups_of(robot.cable_count), number(period, "period", "s", above=0.0)
        size = number(step, "step", "s", above=0.0)
        losses = optional(damping, Damping, "damping") or LOSSES
        noise = whole_number(seed, "seed", 0, MOST_SEED)
        self._network = plc_link.Network(delay, jitter, loss, noise)
        known = flag(surveyed, "surveyed")
        self._hardware = Hardware(robot, self.nominal, start, known, losses, size, self.period, noise)
        self._parts = [slice(winches[0], winches[-1] + 1) for winches in self.groups]
        self._programs = self._make_programs(self._hardware.limits)
        self._clocks = np.random.default_rng((noise, 2)).uniform(0.0, 1e3, len(self.groups))
        self._group_rows = np.zeros((5, len(self.groups)), dtype=np.int64)
        self._whole = np.zeros((3, robot.cable_count), dtype=np.int64)
        self._reported: Any = None  # last blocks that were reported, without their counters
        self._cycles = self._counter = 0
        self._links: list[plc_link.MachineLink] = []
        self._schedule, self._commands = TimedQueue(), ""  # starts (True) and ends of faults; fault of all commands
        self._spoiled: dict[int, str] = {}
        self._stopped: set[int] = set()
        self._taken: set[int] = set()
        self._snapshot = self._written(None)
        step_to = 'Give texts: faults=["cell 3 sticks at 40 s"].'
        for one in elements(faults, str | Injected, "faults", step_to):
            self.inject(one)

    def _make_programs(self, limits: PlcLimits) -> list[Program]:
        """Programs of the PLCs, each with the limits of its own winches."""
        programs = [Program(PlcLimits(*(column[part] for column in limits)), self.period) for part in self._parts]
        for program, part in zip(programs, self._parts, strict=True):
            program.length = self._hardware.read[LENGTH, part].tolist()
        return programs

    @property
    def time(self) -> float:
        """Time since the machine was switched on [s]."""
        return self._cycles * self.period

    @property
    def reading(self) -> Reading:
        """True state of the plant. Every period overwrites it."""
        return self._hardware.simulator.reading

    def link(self, *, moves: bool = True) -> plc_link.MachineLink:
        """Link to the machine for a controller in this process.

        Args:
            moves: True if each exchange of the link advances the machine by a period. Only one of several links may
                have True.

        Returns:
            The link: a `sagline.control.link.Link`.
        """
        link = plc_link.MachineLink(self, self._network, flag(moves, "moves"))
        self._links.append(link)
        return link

    def claim(self, group: int, owner: int) -> None:
        """Claim the ownership of the group of a PLC.

        Args:
            group: Index of the group, from 0.
            owner: Id of the controller; 0 for none.

        Raises:
            InvalidValueError: If the group does not exist. If the id is not a whole number of 32 bits.
        """
        self.deliver(self._group(group), whole_number(owner, "owner", 0, LARGEST_ID))

    def take(self, group: int, command: Command) -> None:
        """Send a command to a PLC. The PLC checks the counter and the owner of the command.

        Args:
            group: Index of the group, from 0.
            command: Command with arrays for the winches of the group only.

        Raises:
            InvalidValueError: If the group does not exist. If `command` is not a command for the winches of this group.
        """
        chosen = self._group(group)
        count = len(self.groups[chosen])
        rows = [np.asarray(row) for row in instance(command, Command, "command")[4:8]]
        if any(row.shape != (count,) for row in rows):
            shapes = f"of shapes {', '.join(str(row.shape) for row in rows)}"
            raise InvalidValueError("command", shapes, f"({count},), as group {chosen} has winches", "Give these only.")
        lists = (row.tolist() for row in rows)
        self.deliver(chosen, Order(command.counter, command.owner, command.mode, command.valid_for, *lists))

    def _group(self, group: Any) -> int:
        return whole_number(group, "group", 0, len(self.groups) - 1)

    def deliver(self, group: int, message: int | Order) -> None:
        """Deliver a claim or a command to a PLC, unless a fault prevents it.

        Args:
            group: Index of the group, from 0.
            message: A claim (the id of its owner), or a command.
        """
        if self._schedule.waiting:
            self._apply_due_faults()
        if group in self._stopped or self._commands not in ("", "are foreign"):
            return
        if isinstance(message, int):
            self._programs[group].claim(message, self.time)
        elif self._commands:
            self._programs[group].take(message._replace(owner=message.owner % COUNTERS + 1))
        else:
            self._programs[group].take(message)

    def advance(self) -> None:
        """Simulate one period: faults that are due, scans of the PLCs, motion of drives and plant, and new readings."""
        now = self.time
        if self._schedule.waiting:
            self._apply_due_faults()
        for link in self._links:
            link.before(now)
        self._scan(now)
        self._cycles += 1
        self._snapshot = self._written(self._snapshot)
        for link in self._links:
            link.after(self.time, self._snapshot, self._spoiled)

    def _scan(self, now: float) -> None:
        hardware = self._hardware
        encoder, cell = hardware.read[LENGTH].tolist(), hardware.read[CELL].tolist()
        length: list[float] = []
        tension: list[float] = []
        powered: list[bool] = []
        for group in self._taken:
            self._programs[group].seize(RIVAL, now)
        for group, (program, part) in enumerate(zip(self._programs, self._parts, strict=True)):
            if group not in self._stopped:
                program.scan(now, encoder[part], cell[part])
            length += program.length
            tension += program.tension
            powered += program.powered
        hardware.simulate_period(length, tension, powered)

    def _written(self, before: plc_link.PlcBlocks | None) -> plc_link.PlcBlocks:
        """Blocks of all groups. A stopped PLC keeps its previous block."""
        hardware, programs, groups = self._hardware, self._programs, self._group_rows
        self._counter = self._counter % COUNTERS + 1
        groups[plc_link.COUNTER] = self._counter
        groups[plc_link.ECHO] = [program.echo for program in programs]
        saturated = hardware.simulator.reading.saturated.tolist()
        news = [(program.owner, program.status, program.fault, *program.powered) for program in programs], saturated
        if news != self._reported:
            self._reported = news
            owners, status, faults = zip(*(row[:3] for row in news[0]), strict=True)
            groups[plc_link.OWNER], groups[plc_link.STATUS], groups[plc_link.FAULT] = owners, status, faults
            for program, part in zip(programs, self._parts, strict=True):
                states = program.states(saturated[part])
                self._whole[plc_link.STATE, part], self._whole[plc_link.DRIVE_FAULT, part] = states
        self._whole[plc_link.COUNTS] = hardware.counts
        new = plc_link.PlcBlocks((hardware.read.copy(), self._whole.copy(), groups.copy(), self._clocks + self.time))
        if before is not None and self._stopped:
            for group in self._stopped:
                new.keep(group, self._parts[group], before)
        return new

    def report(self, group: int) -> plc_link.Report | None:
        """Present block of a group.

        Args:
            group: Index of the group, from 0.

        Returns:
            The block. None if the previous block remains because of a fault.

        Raises:
            InvalidValueError: If the group does not exist.
        """
        group = self._group(group)
        how = self._spoiled.get(group, "")
        if group in self._stopped or how in ("is silent", "repeats", "goes back"):
            return None
        floats, whole, groups, clock = self._snapshot.arrays
        part = self._parts[group]
        counter, *state = groups[:, group].tolist()
        again = counter % COUNTERS + 1 if how == "is torn" else counter
        rows: list[Any] = [*floats[:, part].tolist(), *whole[:, part].tolist()]
        return plc_link.Report(counter, again, how == "is foreign", float(clock[group]), *state, *rows)

    def inject(self, what: str | Injected) -> None:
        """Inject a fault.

        Args:
            what: Text of a fault, or a result of `fault`. A fault with a time in the past begins immediately.

        Raises:
            InvalidValueError: If the fault does not exist. If the machine has no such part.
        """
        found = what if isinstance(what, Injected) else fault(what)
        kind = KINDS[choice(found.kind, "fault: kind", KINDS)]
        parts = len(self.groups) if kind.item == "group" else self.robot.cable_count
        if kind.numbered and not 0 <= found.which < parts:
            raise InvalidValueError("fault", brief(str(found)), f"{kind.item} 0 to {parts - 1}", "Numbers begin at 0.")
        self._schedule.add(found.time, (True, found))
        if found.duration < np.inf:
            self._schedule.add(found.time + found.duration, (False, found))

    def _apply_due_faults(self) -> None:
        for _, (begins, what) in self._schedule.due(self.time):
            self._apply_fault(what, begins)

    def _apply_fault(self, what: Injected, begins: bool) -> None:
        hardware, which, value = self._hardware, what.which, what.value
        item, words = KINDS[what.kind].item, KINDS[what.kind].words
        if item == "cell":
            hardware.spoil_cell(which, words if begins else None, value)
        elif item == "group":
            self._spoil_group(which, words, begins)
        elif item == "commands":
            self._commands = words if begins else ""
        elif item == "cable":
            hardware.simulator.cut(which)
        elif item == "encoder":
            hardware.shift_encoder(which, value)
        elif item == "load":
            hardware.add_load(value if begins else -value)
        elif item == "emergency stop":
            self.emergency_stop()
        elif words == "trips":
            group = next(g for g, winches in enumerate(self.groups) if which in winches)
            self._programs[group].trip(which - self.groups[group][0], TRIPPED)
        else:
            hardware.simulator.limit_force(value, which)

    def _spoil_group(self, group: int, words: str, begins: bool) -> None:
        kept = {"is taken": self._taken, "stops": self._stopped}.get(words)
        if kept is not None:
            (kept.add if begins else kept.discard)(group)
            if words == "stops" or not begins:
                self._programs[group].restart()
        self._spoiled.pop(group, None)
        if begins and words != "is taken":
            self._spoiled[group] = words

    def emergency_stop(self) -> None:
        """Press the emergency stop.

        Hardware locks the drums and cuts the power. The PLCs only report the stop, from a normally closed contact.
        A broken wire therefore has the same effect as the stop.
        """
        for program in self._programs:
            program.contact = False

    def reset(self) -> None:
        """Release the emergency stop and the drums, and clear the faults of the drives, as an operator does."""
        for program in self._programs:
            program.contact = True
            program.reset()
