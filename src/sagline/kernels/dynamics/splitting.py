"""A step of the symplectic splitting: kick, drift, free turn, kick; docs/model.md, section 11."""

from __future__ import annotations

from sagline.kernels.dynamics.drives import account, kick_winches, remember, turn_winches
from sagline.kernels.dynamics.forces import damp, evaluate, take_powers
from sagline.kernels.dynamics.massless import DAMPED, MasslessRun, weight_of
from sagline.kernels.dynamics.rigid_body import drift, free_turn, kick
from sagline.kernels.jit import glue


@glue
def split_step(run: MasslessRun, now: float) -> None:
    """One step of the splitting from a time on; forces at hand before and after are those of the state."""
    h, half, drives, rows = run.step, 0.5 * run.step, run.drives, run.rows
    damp(run)
    take_powers(drives, half)
    kick(run.state, run.inertia, run.gradient, half)
    if run.work & DAMPED:
        kick(run.state, run.inertia, run.damping, half)
    kick_winches(drives, rows, run.targets, half, True)
    remember(drives, rows)
    drift(run.state, h)
    free_turn(run.state, run.inertia, h)
    turn_winches(drives, run.cables, rows, weight_of(run), h)
    evaluate(run, now + h)
    account(drives, run.cables, rows, h)
    kick(run.state, run.inertia, run.gradient, half)
    if run.work & DAMPED:  # the adjoint of the first kick, by one correction
        damp(run)
        for k in range(6):
            run.before[k] = run.damping[k]
        kick(run.state, run.inertia, run.damping, half)
        damp(run)
        kick(run.state, run.inertia, run.before, -half)
        kick(run.state, run.inertia, run.damping, half)
    kick_winches(drives, rows, run.targets, half, False)
    damp(run)
    take_powers(drives, half)
