"""A step of the symplectic splitting: kick, drift, free turn, kick; docs/model.md, section 11."""

from __future__ import annotations

from sagline.kernels.dynamics.drives import add_winch_energy, kick_winches, store_step_start, turn_winches
from sagline.kernels.dynamics.forces import add_powers, fill_damping, fill_forces
from sagline.kernels.dynamics.massless import DAMPED, MasslessRun, cable_gravity
from sagline.kernels.dynamics.rigid_body import drift_body, free_turn, kick_body
from sagline.kernels.jit import glue


@glue
def splitting_step(run: MasslessRun, now: float) -> None:
    """One step of the splitting from a time on; forces at hand before and after are those of the state."""
    h, half, drives, rows = run.step, 0.5 * run.step, run.drives, run.rows
    fill_damping(run)
    add_powers(drives, half)
    kick_body(run.state, run.inertia, run.gradient, half)
    if run.work & DAMPED:
        kick_body(run.state, run.inertia, run.damping, half)
    kick_winches(drives, rows, run.targets, half, True)
    store_step_start(drives, rows)
    drift_body(run.state, h)
    free_turn(run.state, run.inertia, h)
    turn_winches(drives, run.cables, rows, cable_gravity(run), h)
    fill_forces(run, now + h)
    add_winch_energy(drives, run.cables, rows, h)
    kick_body(run.state, run.inertia, run.gradient, half)
    if run.work & DAMPED:  # the adjoint of the first kick, by one correction
        fill_damping(run)
        for k in range(6):
            run.before[k] = run.damping[k]
        kick_body(run.state, run.inertia, run.damping, half)
        fill_damping(run)
        kick_body(run.state, run.inertia, run.before, -half)
        kick_body(run.state, run.inertia, run.damping, half)
    kick_winches(drives, rows, run.targets, half, False)
    fill_damping(run)
    add_powers(drives, half)
