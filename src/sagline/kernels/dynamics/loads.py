"""Loads of massless cables on a platform that another program moves: its pose, twist and winch lengths are given."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import forces_from_lengths
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.terms import Model
from sagline.kernels.dynamics.massless import damp_cables, fill_frame_end_tensions
from sagline.kernels.dynamics.rigid_body import VELOCITY
from sagline.kernels.forward.platform import add_force
from sagline.kernels.jit import entry

# code, k_h, k_p, gravity; True for pulleys or dead lengths, else None
ModelTerms = tuple[int, float, float, float, bool | None]


@entry
def cable_loads(
    model: ModelTerms,
    losses: tuple[float, float],
    cables: Array,
    body: Array,
    data: Array,
    state: Array,
    rotation: Array,
    rows: Array,
    now: Array,
    wrenches: Array,
) -> int:
    """Fill the tensions at the frame ends and the wrench of all cables. Returns the number of cables without solution.

    Args:
        model: Cable model.
        losses: loss_time [s] and air damping [N s/m^2].
        cables: Rows of the cable_table, (m, CABLE_COLUMNS).
        body: Row of the body_table. Its center of mass is the reference point of wrench and velocity.
        data: Parameters of the drives, (DATA_ROWS, m); the height of the frame ends above the drums is used.
        state: Pose row of the platform, velocity of the reference point and angular velocity in world axes, (13,).
        rotation: Work array (3, 3).
        rows: Rows of the cables with their lengths, (CABLE_ROWS, m). The solution is near the solution of the last
            call if the parameters of that call are in the rows.
        now: State of the drives with the rates of the lengths, (DRIVE_ROWS, m). The tensions are filled.
        wrenches: Filled, (2, 6): wrench on the platform about the reference point, and the part of the losses.
    """
    terms = Model(model[0], model[1], model[2], model[3], model[4])
    gravity = terms.gravity if terms.code == codes.CATENARY else 0.0
    wrench, lost = wrenches[0], wrenches[1]
    cable_geometry(cables, body, state, rotation, rows)
    forces_from_lengths(terms, cables, rows, terms.behind)
    fill_frame_end_tensions(gravity, cables, rows, data, now, terms.behind)
    lost[:] = 0.0
    if losses[0] > 0.0 or losses[1] > 0.0:
        damp_cables(losses, gravity, cables, rows, state[VELOCITY:], now, lost, terms.behind)
    unsolved = 0
    for k in range(6):
        wrench[k] = lost[k]
    for i in range(cables.shape[0]):
        add_force(rows, i, -rows[g.HORIZONTAL, i], -rows[g.VERTICAL, i], wrench)
        if rows[g.STATUS, i] not in (codes.CABLE_SOLVED, codes.CABLE_SLACK):
            unsolved += 1
    return unsolved
