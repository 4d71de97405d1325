"""Integration of a simulation from event to event, with records."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np

from sagline.core.arrays import locked
from sagline.dynamics.simulation import results
from sagline.dynamics.simulation.initial_conditions import TimeTable
from sagline.dynamics.simulation.plant import NOTES, Plant, Records
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import progress as k
from sagline.kernels.dynamics import rigid_body as body

BLOCK: Final = 20_000  # steps per block, about 100 ms; interrupts are handled between blocks
NAMES: Final = {k.NOTE_SLACK: "slack", k.NOTE_SATURATED: "saturate"}
LIMITS: Final = {d.TORQUE: "torque", d.SPEED_BOUND: "speed", d.TORQUE + d.SPEED_BOUND: "torque and speed"}
Inputs = tuple[TimeTable, TimeTable, TimeTable, TimeTable]  # of lengths, wrenches, wind and anchors


class SimulationRun:
    """A simulation in progress."""

    def __init__(
        self,
        plant: Plant,
        rules: tuple[int, int, int, int, int],
        numbers: tuple[float, float, float, float],
        inputs: Inputs,
        every: int,
        steps: int,
        events: tuple[results.Event, ...] = (),
        settings: dict[str, Any] | None = None,
    ) -> None:
        """Record the first sample."""
        self._events, self._settings = list(events), settings or {}
        self.plant, self.every, self.steps = plant, every, steps
        self._rules, self._numbers, self._inputs = rules, numbers, inputs
        self._record = plant.records(-(-steps // every) + 1)  # one more record for the last step
        self._record.tensions[:] = 0.0
        self._record.lengths[:] = np.nan
        self._removed = np.zeros(len(self._record.energies))  # removed energy; the kernel counts it as lost
        self._occurrences: list[results.Occurrence] = []
        self._largest = np.zeros(plant.robot.cable_count)
        self._marks: list[int] = []  # indices of scheduled events in the list of events
        self._arguments: Any = plant.arguments(rules, numbers, inputs)
        self._advance(0)

    @property
    def step(self) -> float:
        """Time step of the integrator [s]."""
        return self._numbers[0]

    def _time(self, step: int) -> float:
        return float(self.plant.audit[d.BEGIN] + step * self.step)

    def _advance(self, last: int) -> None:
        """Integrate up to the step `last`, and record the motion."""
        plant, first = self.plant, int(self.plant.counters[k.STEPS])
        row = first // self.every + 1 if plant.counters[k.READY] else 0
        records = plant.records(last // self.every + 1 - row)
        plant.counters[k.RECORDS] = plant.counters[k.NOTES] = 0
        if last <= first and plant.counters[k.READY]:
            return
        while True:
            steps = min(last - int(plant.counters[k.STEPS]), BLOCK)
            plant.kernel(*self._arguments, records.arrays, steps, self.every)
            if plant.counters[k.FAILED]:
                raise plant.failure(self._time(int(plant.counters[k.STEPS])), self.step)
            if plant.counters[k.STEPS] == last:
                break
            if plant.counters[k.NOTES] > NOTES:
                self._store_notes(records)
                plant.counters[k.NOTES] = 0
        self._store_records(records, row)
        self._store_notes(records)
        if last == self.steps and last % self.every:
            self._store_records(self._record_now(), last // self.every + 1)

    def _store_records(self, records: Records, row: int) -> None:
        """Copy the kernel's `records` into the complete record, from its row `row` on."""
        plant = self.plant
        rows = slice(row, row + int(plant.counters[k.RECORDS]))
        kept = slice(0, rows.stop - rows.start)
        self._record.states[rows], self._record.energies[rows] = (
            plant.platform_states(records.states[kept]),
            records.energies[kept],
        )
        if self._record.points is not None and records.points is not None:
            self._record.points[rows] = records.points[kept]
        cables, first = np.unique(plant.cables, return_index=True)  # the first row of a cable is that of its frame end
        self._record.tensions[rows, cables] = records.tensions[kept][:, first]
        self._record.lengths[rows, cables] = records.lengths[kept][:, first]
        self._record.lengths[rows, plant.broken] = np.nan

    def _store_notes(self, records: Records) -> None:
        """Store the events that the kernel has recorded."""
        for row in records.notes[: int(self.plant.counters[k.NOTES])]:
            cable = int(self.plant.cables[int(row[k.NOTE_CABLE])])
            kind = NAMES[row[k.NOTE_KIND]]
            before, after = float(row[k.NOTE_BEFORE]), float(row[k.NOTE_AFTER])
            limit = LIMITS[row[k.NOTE_STATE]] if kind == "saturate" else None
            self._occurrences.append(results.Occurrence(float(row[k.NOTE_TIME]), kind, cable, before, after, limit))

    def _record_now(self) -> Records:
        """Record the current step."""
        plant, here = self.plant, self.plant.records(1)
        plant.counters[k.RECORDS] = plant.counters[k.NOTES] = 0
        plant.kernel(*self._arguments, here.arrays, 0, self.every)
        self._store_notes(here)
        return here

    def apply_event(self, event: results.Event) -> None:
        """Integrate up to `event`, and apply `event` at the first step at or after its time."""
        plant = self.plant
        self._advance(self._step_of(event))
        time, before = self._time(int(plant.counters[k.STEPS])), _energy(self._record_now())
        cable = results.event_cable(event)
        places = plant.cables == cable if cable is not None else np.ones(len(plant.cables), dtype=np.bool_)
        peak = float(plant.now[d.PEAK][places].max())
        self._finish_event()
        self._marks.append(len(self._occurrences))
        self._occurrences.append(results.Occurrence(time, results.KINDS[type(event)], cable, peak, 0.0))
        start = plant.audit[d.START]
        self._apply(event, time)
        plant.counters[[k.READY, k.LENGTH_AT, k.WRENCH_AT, k.WIND_AT, k.ANCHOR_AT]] = 0
        plant.now[d.PEAK] = 0.0
        self._arguments = plant.arguments(self._rules, self._numbers, self._inputs)
        left = before - _energy(self._record_now())
        plant.audit[d.LOST] += left
        if isinstance(event, results.Break | results.Drop | results.PickUp):
            self._removed[int(plant.counters[k.STEPS]) // self.every + 1 :] += left
        plant.audit[d.START] = start

    def _apply(self, event: results.Event, time: float) -> None:
        plant, (lengths, wrenches, winds, anchors) = self.plant, self._inputs
        wide = lengths.value.shape[1] // len(plant.cables)
        if isinstance(event, results.Break):
            count, rows = len(plant.cables), plant.break_cable(event.cable, event.position)
            plant.broken.append(event.cable)
            columns = np.concatenate([rows + part * count for part in range(wide)])
            if anchors.value.size:
                anchors = anchors.columns((3 * rows[:, None] + np.arange(3)).ravel())
            self._inputs = (lengths.columns(columns), wrenches, winds, anchors)
        elif isinstance(event, results.Stall):
            plant.lock_winches(plant.cables == event.winch)
        elif isinstance(event, results.Brake):
            chosen = np.ones(len(plant.cables), dtype=np.bool_) if event.winch is None else plant.cables == event.winch
            columns = np.flatnonzero(np.tile(chosen, wide))  # this also preserves the expected tensions of the motors
            self._inputs = (lengths.with_stop(time, event.duration, columns), wrenches, winds, anchors)
        elif isinstance(event, results.Drop):
            plant.with_mass(plant.inertia[0] - event.mass, at_rest=False)
        elif isinstance(event, results.PickUp):
            plant.with_mass(plant.inertia[0] + event.mass, at_rest=True)

    def _finish_event(self) -> None:
        """Store the largest tension after the last event, and the largest tension of the whole run."""
        np.maximum.at(self._largest, self.plant.cables, self.plant.now[d.PEAK])
        if self._marks:
            last, peak = self._marks[-1], float(self.plant.now[d.PEAK].max())
            self._occurrences[last] = replace(self._occurrences[last], tension_after=peak)

    def finish(self) -> results.Simulation:
        """Integrate to the end."""
        return self.until(math.inf)

    def until(self, time: float) -> results.Simulation:
        """Continue to `time` [s], and return the simulation up to this time."""
        ahead = (time - float(self.plant.audit[d.BEGIN])) / self.step
        records = math.ceil(min(ahead, self.steps) / self.every - 1e-9)
        last = max(min(records * self.every, self.steps), int(self.plant.counters[k.STEPS]))
        while self._events and self._step_of(self._events[0]) <= last:
            self.apply_event(self._events.pop(0))
        self._advance(last)
        self._finish_event()
        return self._result(-(-last // self.every) + 1)

    def _step_of(self, event: results.Event) -> int:
        """The first step at or after the time of `event`."""
        return math.ceil((event.time - float(self.plant.audit[d.BEGIN])) / self.step - 1e-9)

    def _result(self, count: int) -> results.Simulation:
        """Create the result from the first `count` records."""
        plant, states, removed = self.plant, self._record.states[:count], self._removed[:count]
        kinetic, potential, supplied, lost = (column.copy() for column in self._record.energies[:count].T)
        steps = np.minimum(self.every * np.arange(count), self.steps)
        pose, velocity, spin = plant.poses(states), states[:, body.VELOCITY : body.MOMENTUM], states[:, body.MOMENTUM :]
        return results.Simulation(
            robot=plant.robot,
            time=locked(plant.audit[d.BEGIN] + steps * self.step),
            pose=pose,
            twist=results.twist_of_origin(plant.robot, pose, velocity, spin),
            tensions=locked(self._record.tensions[:count].copy()),
            length=locked(self._record.lengths[:count].copy()),
            energy=results.EnergyBalance._of(kinetic, potential, supplied, lost - removed, removed.copy()),
            events=tuple(sorted(self._occurrences, key=lambda event: event.time)),
            cable_mass=plant.cable_mass,
            step=self.step,
            nodes=None if self._record.points is None else locked(self._record.points[:count].copy()),
            largest_tension=locked(self._largest.copy()),
            **self._settings,
        )


def _energy(here: Records) -> float:
    """Sum of kinetic and potential energy of the first record of `here` [J]."""
    return float(here.energies[0, k.KINETIC] + here.energies[0, k.POTENTIAL])
