"""Counters of runs in time: columns of records, and notes of events that begin by themselves."""

from __future__ import annotations

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.drives import Drives
from sagline.kernels.jit import glue, kernel

# counters that go in and out
STEPS, LENGTH_AT, WRENCH_AT, WIND_AT, NOTES, RECORDS, READY, FAILED, RENEWED = range(9)
COUNTERS = 9
# columns of the notes: what began when, with which cable; largest tensions before and after
NOTE_TIME, NOTE_KIND, NOTE_CABLE, NOTE_BEFORE, NOTE_AFTER = range(5)
NOTE_COLUMNS = 5
NOTE_SLACK, NOTE_SATURATED = 0.0, 1.0
# columns of the energies of a record
KINETIC, POTENTIAL, SUPPLIED, LOST = range(4)
ENERGY_COLUMNS = 4

ROUNDING = 1e-9  # of the sum of all parts of the energy, of chains of the weights': it may be so much off


@kernel
def note_events(
    drives: Drives, rows: Array, cables: Array, at: Indices, now: float, weight_of: float, notes: Array
) -> None:
    """Keep the largest tensions, and note what begins: a cable that no longer pulls, a drive at its limit."""
    largest = 0.0
    for i in range(rows.shape[1]):
        tension = drives.now[d.AT_FRAME, i]
        drives.now[d.PEAK, i] = max(drives.now[d.PEAK, i], tension)
        largest = max(largest, tension)
        slack = not rows[t.TENSION, i] > 0.5 * cables[i, tables.DENSITY] * weight_of * rows[g.CHORD, i]
        known = drives.now[d.SLACK, i]
        drives.now[d.SLACK, i] = (d.NEW if known == d.NO else known) if slack else d.NO
    if at[NOTES] > 0:
        row = at[NOTES] - 1
        notes[row, NOTE_AFTER] = max(notes[row, NOTE_AFTER], largest)
    for i in range(rows.shape[1]):
        for kind in range(2):
            flag = d.SATURATED if kind == NOTE_SATURATED else d.SLACK
            if drives.now[flag, i] == d.NEW:
                drives.now[flag, i] = d.YES
                if at[NOTES] < notes.shape[0]:
                    row = at[NOTES]
                    notes[row, NOTE_TIME], notes[row, NOTE_KIND], notes[row, NOTE_CABLE] = now, kind, i
                    notes[row, NOTE_BEFORE], notes[row, NOTE_AFTER] = drives.now[d.PEAK, i], largest
                    at[NOTES] += 1


@glue
def has_room(at: Indices, notes: Array, cables: int) -> bool:
    """True if all events that may begin in a step can be noted."""
    return at[NOTES] + 2 * cables <= notes.shape[0]
