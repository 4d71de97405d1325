"""Records of a platform on massless cables."""

from __future__ import annotations

from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.massless import MasslessRun, Records
from sagline.kernels.dynamics.progress import (
    FAILED,
    KINETIC,
    LOST,
    POTENTIAL,
    READY,
    RECORDS,
    ROUNDING,
    SUPPLIED,
)
from sagline.kernels.dynamics.rigid_body import CENTER, MOMENTUM, kinetic_energy, spin
from sagline.kernels.forward.platform import platform_energy
from sagline.kernels.jit import kernel

GROWTH = 0.1  # of all energy that moves: an integrator that invents or loses more has too long a step


@kernel
def record_step(run: MasslessRun, records: Records) -> None:
    """Write down a step, and look whether energy has grown by itself."""
    states, tensions, lengths, energies, _notes = records
    state, drives, rows, at = run.state, run.drives, run.rows, run.at
    audit, row = drives.audit, at[RECORDS]
    stored, size = platform_energy(run.model, run.cables, run.body, run.none, state, run.rotation, rows)
    kinetic, potential = kinetic_energy(state, run.inertia), stored + audit[d.ON_DRUMS]
    for i in range(rows.shape[1]):
        if drives.kind == d.DRUMS:
            kinetic += 0.5 * drives.data[d.INERTIA, i] * drives.now[d.SPEED, i] * drives.now[d.SPEED, i]
    if at[READY] < 2:
        at[READY] = 2
        audit[d.START] = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST]
        audit[d.START_POTENTIAL] = potential
    invented = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST] - audit[d.START]
    moved = kinetic + abs(potential - audit[d.START_POTENTIAL]) + abs(audit[d.SUPPLIED]) + abs(audit[d.LOST])
    audit[d.MOVED] = max(audit[d.MOVED], moved)
    if not abs(invented) <= GROWTH * audit[d.MOVED] + ROUNDING * size:
        at[FAILED] = 1
        for i in range(rows.shape[1]):
            if drives.now[d.AT_FRAME, i] > drives.now[d.AT_FRAME, at[FAILED] - 1]:
                at[FAILED] = i + 1
    if row < states.shape[0]:
        turning = spin(state, run.inertia)
        for k in range(MOMENTUM):
            states[row, CENTER + k] = state[CENTER + k]
        for k in range(3):
            states[row, MOMENTUM + k] = turning[k]
        for i in range(rows.shape[1]):
            tensions[row, i] = drives.now[d.AT_FRAME, i]
            lengths[row, i] = rows[t.LENGTH, i]
        energies[row, KINETIC], energies[row, POTENTIAL] = kinetic, potential
        energies[row, SUPPLIED], energies[row, LOST] = audit[d.SUPPLIED], audit[d.LOST]
        at[RECORDS] += 1
