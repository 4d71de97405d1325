"""Records of a platform on chains, and the new division of the chains."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.chain_run import ChainRun, Records
from sagline.kernels.dynamics.progress import (
    COUNTERS,
    FAILED,
    KINETIC,
    LOST,
    POTENTIAL,
    READY,
    RECORDS,
    ROUNDING,
    SUPPLIED,
)
from sagline.kernels.dynamics.rigid_body import CENTER, MASS, MOMENTUM, kinetic_energy, spin
from sagline.kernels.jit import glue, kernel

ENDED = COUNTERS  # one counter more than a run without cable mass has: how it ended, FAILED being the cable to blame
DONE, LONG, SHORT, GROWN = range(4)
FEWEST = 2  # free nodes of a chain
GROWTH = 0.5  # of what could have become motion: more than phases that err can invent


@glue
def _energy_of(run: ChainRun, i: int) -> tuple[float, float]:
    """Energy of a chain with that of its half element at the exit, and the latter alone [J]."""
    chains, n, row = run.chains, run.chains.counts[i], run.chains.table[i]
    strain, raised = c.potential(chains.place[i], n, row)
    entering = c.kinetic_at_exit(chains.speed[i], n, row)
    return strain + raised + c.kinetic(chains.speed[i], n, row) + entering, entering


@kernel
def change_node_count(run: ChainRun, i: int) -> None:
    """Give a chain one node more or less at the frame, and account for the energy that this takes."""
    chains, audit = run.chains, run.drives.audit
    row, place, speed, n = chains.table[i], chains.place[i], chains.speed[i], chains.counts[i]
    more = 1 if row[c.REST] > row[c.ELEMENT] else -1
    if n + more < FEWEST or n + more + 2 > place.shape[1]:
        run.at[FAILED], run.at[ENDED] = i + 1, (SHORT if more < 0 else LONG)
        return
    before, entering_before = _energy_of(run, i)
    if more > 0:
        c.insert_node(place, speed, n, row)
    else:
        c.merge_nodes(place, speed, n, row)
    chains.counts[i] = n + more
    row[c.REST] -= more * row[c.ELEMENT]
    after, entering = _energy_of(run, i)
    audit[d.LOST] += before - after
    audit[d.SUPPLIED] -= entering - entering_before  # that of the half element at the exit is the winch's
    c.fill_element_forces(place, speed, n + more, row, chains.pulls[i])
    run.drives.now[d.WHOLE, i] = c.whole_force(place, speed, n + more, row, chains.pulls[i])


@kernel
def _sample_points(place: Array, count: int, row: Array, points: Array) -> None:
    """Fill points (points, 3) of a chain at equal material steps, from the exit on."""
    element, rest = row[c.ELEMENT], row[c.REST]
    length = rest + count * element
    for p in range(points.shape[0]):
        way = length * p / (points.shape[0] - 1) - rest  # behind the node next to the frame
        passed = int(min(max(way / element, 0.0), count - 1.0)) if way > 0.0 else -1
        share = way / element - passed if way > 0.0 else 1.0 + way / rest
        for k in range(3):
            start = place[k, count - passed]
            points[p, k] = start + share * (place[k, count - passed - 1] - start)


@kernel
def record_chain_step(run: ChainRun, records: Records, stock: Array) -> None:
    """Write down a step, and look whether energy has grown by itself."""
    states, tensions, lengths, energies, _notes, points = records
    state, drives, chains, at, r = run.state, run.drives, run.chains, run.at, run.at[RECORDS]
    audit = drives.audit
    kinetic, strain = kinetic_energy(state, run.inertia), 0.0
    raised = run.inertia[MASS] * run.gravity * state[CENTER + 2]
    size, wildest, blamed = abs(raised), -1.0, 0
    for i in range(chains.counts.shape[0]):
        n, row = chains.counts[i], chains.table[i]
        stretched, height = c.potential(chains.place[i], n, row)
        swinging = c.kinetic(chains.speed[i], n, row)
        kinetic, strain, size = kinetic + swinging, strain + stretched, size + abs(height)
        raised += height - 0.5 * row[c.DENSITY] * row[c.ELEMENT] * run.gravity * row[c.EXIT_Z]
        if not swinging <= wildest:
            wildest, blamed = swinging, i
        if drives.kind == d.DRUMS:
            kinetic += 0.5 * drives.data[d.INERTIA, i] * drives.now[d.SPEED, i] * drives.now[d.SPEED, i]
    potential = strain + raised + audit[d.ON_DRUMS]
    if at[READY] < 2:
        at[READY] = 2
        audit[d.START] = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST]
    if math.isnan(stock[0]):
        stock[0], stock[1] = kinetic + strain, raised
    invented = kinetic + potential - audit[d.SUPPLIED] + audit[d.LOST] - audit[d.START]
    convertible = stock[0] + max(stock[1] - raised, 0.0) + abs(audit[d.SUPPLIED])
    if not invented <= GROWTH * convertible + ROUNDING * size:
        at[FAILED], at[ENDED] = blamed + 1, GROWN
    if r < states.shape[0]:
        turning = spin(state, run.inertia)
        for k in range(MOMENTUM):
            states[r, k] = state[k]
        for k in range(3):
            states[r, MOMENTUM + k] = turning[k]
        energies[r, KINETIC], energies[r, POTENTIAL] = kinetic, potential
        energies[r, SUPPLIED], energies[r, LOST] = audit[d.SUPPLIED], audit[d.LOST]
        for i in range(chains.counts.shape[0]):
            tensions[r, i], lengths[r, i] = drives.now[d.AT_FRAME, i], run.rows[t.LENGTH, i]
            _sample_points(chains.place[i], chains.counts[i], chains.table[i], points[r, i])
        at[RECORDS] += 1
