"""A run of a platform on cables without mass: all that its steps work on."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CATENARY
from sagline.kernels.dynamics.drives import Drives
from sagline.kernels.dynamics.rigid_body import STATE_COLUMNS
from sagline.kernels.dynamics.tables_in_time import TimeTable, TimeTableArrays
from sagline.kernels.jit import glue
from sagline.kernels.memory import block

SPLITTING, RUNGE_KUTTA = 0, 1
DAMPED, LOADED, BLOWN = 1, 2, 4  # bits of what damps or loads

Losses = tuple[float, float]
ModelTerms = tuple[int, float, float, float, bool | None]  # with gravity; anything behind the cables: True, or None
Rules = tuple[int, int, int, int, int]  # integrator, kind of winches, remembered, what damps or loads, loops' stride
Numbers = tuple[float, float, float, float]  # step [s], loss_time [s], air damping [N s/m^2], share of a new reading
Robot = tuple[Array, Array, Array, Array]  # cables, body, inertia, freedom
Courses = tuple[TimeTableArrays, TimeTableArrays, TimeTableArrays]  # of lengths, wrenches, the wind
Kept = tuple[Array, Array, Array, Array, Array, Indices, Array]  # state, rows, drives' now, layers, audit, counters
Records = tuple[Array, Array, Array, Array, Array]  # states, tensions, lengths, energies, notes


class MasslessRun(NamedTuple):
    """State and arrays of a run, as in `motion.run`."""

    model: Model
    work: int
    step: float
    losses: Losses
    cables: Array
    body: Array
    inertia: Array
    freedom: Array
    drives: Drives
    lengths: TimeTable
    wrenches: TimeTable
    winds: TimeTable
    state: Array
    rows: Array
    at: Indices
    rotation: Array
    gradient: Array
    given: Array
    damping: Array
    before: Array
    none: Array
    spare: Array
    targets: Array
    target_rates: Array
    base: Array
    first: Array
    total: Array
    lengths_base: Array


@glue
def massless_run_of(
    model: ModelTerms, rules: Rules, numbers: Numbers, robot: Robot, data: Array, courses: Courses, kept: Kept
) -> MasslessRun:
    """State and arrays of a run from the arguments of `motion.run`."""
    _integrator, kind, remembered, work, _stride = rules
    step, loss_time, air, _filtering = numbers
    state, rows, now, layers, audit, at, room = kept
    cables, body, inertia, freedom = robot
    small, place = block(room, 0, 6, 6)
    sides, place = block(room, place, 3, STATE_COLUMNS)
    wide, place = block(room, place, 4, rows.shape[1])
    both, place = block(room, place, 2, courses[0][1].shape[1])
    rotation, place = block(room, place, 3, 3)
    return MasslessRun(
        Model(*model),
        work,
        step,
        (loss_time, air),
        cables,
        body,
        inertia,
        freedom,
        Drives(kind, remembered > 0, data, now, layers, audit),
        TimeTable(*courses[0]),
        TimeTable(*courses[1]),
        TimeTable(*courses[2]),
        state,
        rows,
        at,
        rotation,
        small[0],
        small[1],
        small[2],
        small[3],
        small[4],
        small[5],
        both[0],
        both[1],
        sides[0],
        sides[1],
        sides[2],
        wide,
    )


@glue
def cable_gravity(run: MasslessRun) -> float:
    """Gravity where cables weigh, else 0 [m/s^2]."""
    return run.model.gravity if run.model.code == CATENARY else 0.0
