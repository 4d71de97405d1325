"""Forces and powers of a platform on cables without mass, at a time."""

from __future__ import annotations

from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.cable_loads import (
    add_wind_on_cables,
    damp_cables,
    fill_frame_end_tensions,
    project_on_freedom,
)
from sagline.kernels.dynamics.drives import Drives, keep_set_points
from sagline.kernels.dynamics.massless import BLOWN, DAMPED, LOADED, MasslessRun, cable_gravity
from sagline.kernels.dynamics.progress import LENGTH_AT, WIND_AT, WRENCH_AT
from sagline.kernels.dynamics.rigid_body import VELOCITY, power_of, spin
from sagline.kernels.dynamics.tables_in_time import MOMENT, interpolate_table
from sagline.kernels.forward.platform import unbalance
from sagline.kernels.jit import glue, kernel


@kernel
def fill_set_points(run: MasslessRun, now: float, shift: float) -> None:
    """Fill the set points at a time, and the lengths of winches that keep them."""
    at = run.at
    at[LENGTH_AT] = interpolate_table(run.lengths, at[LENGTH_AT], now, shift, run.targets, run.target_rates)
    keep_set_points(run.drives, run.rows, run.targets, run.target_rates)


@kernel
def fill_forces(run: MasslessRun, now: float) -> None:
    """Fill the force on the platform, -gradient, what is given of it, and the cables' tensions, at a time."""
    at, drives, rows, state = run.at, run.drives, run.rows, run.state
    fill_set_points(run, now, -MOMENT * run.step)
    if run.work & LOADED:
        at[WRENCH_AT] = interpolate_table(run.wrenches, at[WRENCH_AT], now, 0.0, run.given, run.spare)
    unbalance(run.model, run.cables, run.body, run.given, state, run.rotation, rows, run.gradient)
    if run.work & BLOWN:
        at[WIND_AT] = interpolate_table(run.winds, at[WIND_AT], now, 0.0, run.before[:3], run.spare)
        for k in range(6):
            run.gradient[k] += run.given[k]
        add_wind_on_cables(run.cables, drives.data[d.DRAG], rows, run.before, run.given)
        for k in range(6):
            run.gradient[k] -= run.given[k]
    for k in range(6):
        run.gradient[k] = -run.gradient[k]
    project_on_freedom(run.freedom, run.gradient, run.spare)
    fill_frame_end_tensions(cable_gravity(run), run.cables, rows, drives.data, drives.now, run.model.behind)


@kernel
def fill_damping(run: MasslessRun) -> None:
    """Fill what damping does at the present velocities, and the powers that damping takes and given forces bring."""
    if run.work:
        spinning = spin(run.state, run.inertia)
        drives, motion = run.drives, run.spare
        for k in range(3):
            motion[k], motion[3 + k] = run.state[VELOCITY + k], spinning[k]
        if run.work & DAMPED:
            drives.audit[d.LOST_POWER] = damp_cables(
                run.losses, cable_gravity(run), run.cables, run.rows, motion, drives.now, run.damping, run.model.behind
            )
            project_on_freedom(run.freedom, run.damping, motion)
        drives.audit[d.GIVEN_POWER] = power_of(run.given, run.state, spinning)


@glue
def add_powers(drives: Drives, time: float) -> None:
    """Add what the powers do in a time to the audit; winches that keep their lengths feel the damping of cables."""
    power = drives.audit[d.GIVEN_POWER]
    if drives.kind != d.DRUMS:
        for i in range(drives.now.shape[1]):
            power -= drives.now[d.STRETCHING, i] * drives.now[d.RATE, i]
    drives.audit[d.SUPPLIED] += time * power
    drives.audit[d.LOST] += time * drives.audit[d.LOST_POWER]
