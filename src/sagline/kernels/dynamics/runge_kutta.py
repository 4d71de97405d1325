"""A step of the classical Runge-Kutta method, winches and the audit of energy with it."""

from __future__ import annotations

import math

from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.forces import fill_damping, fill_forces
from sagline.kernels.dynamics.massless import DAMPED, MasslessRun
from sagline.kernels.dynamics.rigid_body import STATE_COLUMNS, TURN, rates_of
from sagline.kernels.jit import glue


@glue
def runge_kutta_step(run: MasslessRun, now: float) -> None:
    """One step of the classical Runge-Kutta method; forces at hand before and after are those of the state."""
    h, drives, rows, state = run.step, run.drives, run.rows, run.state
    m, lagging = rows.shape[1], drives.kind == d.SECOND_ORDER
    supplied, lost = 0.0, 0.0
    for k in range(STATE_COLUMNS):
        run.base[k] = state[k]
        run.total[k] = 0.0
    for i in range(m):
        run.lengths_base[0, i], run.lengths_base[1, i] = rows[t.LENGTH, i], drives.now[d.RATE, i]
        run.lengths_base[2, i] = run.lengths_base[3, i] = 0.0
    for stage in range(4):
        weight = 1.0 / 3.0 if stage == 1 or stage == 2 else 1.0 / 6.0
        ahead = 0.5 * h if stage < 2 else h
        fill_damping(run)
        for k in range(6):
            run.before[k] = run.gradient[k] + (run.damping[k] if run.work & DAMPED else 0.0)
        rates_of(state, run.inertia, run.before, run.first)
        supplied += weight * drives.audit[d.GIVEN_POWER]
        lost += weight * drives.audit[d.LOST_POWER]
        for k in range(STATE_COLUMNS):
            run.total[k] += weight * run.first[k]
            state[k] = run.base[k] + (ahead * run.first[k] if stage < 3 else h * run.total[k])
        for i in range(m):
            rate = drives.now[d.RATE, i]
            supplied -= weight * (drives.now[d.WHOLE, i] + drives.now[d.STRETCHING, i]) * rate
            if lagging:
                omega, ratio = drives.data[d.BANDWIDTH, i], drives.data[d.RATIO, i]
                push = omega * omega * (run.targets[i] - rows[t.LENGTH, i]) - 2.0 * ratio * omega * rate
                if drives.now[d.HELD, i] > 0.0:
                    push = rate = 0.0
                run.lengths_base[2, i] += weight * rate
                run.lengths_base[3, i] += weight * push
                length = ahead * rate if stage < 3 else h * run.lengths_base[2, i]
                speed = ahead * push if stage < 3 else h * run.lengths_base[3, i]
                rows[t.LENGTH, i] = run.lengths_base[0, i] + length
                drives.now[d.RATE, i] = run.lengths_base[1, i] + speed
        if stage == 3:
            scale = 0.0
            for k in range(4):
                scale += state[TURN + k] * state[TURN + k]
            for k in range(4):
                state[TURN + k] /= math.sqrt(scale)
        fill_forces(run, now + ahead)
    drives.audit[d.SUPPLIED] += h * supplied
    drives.audit[d.LOST] += h * lost
    fill_damping(run)
