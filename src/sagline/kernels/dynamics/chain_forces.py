"""Forces and powers of a platform on chains, and what they do to the nodes."""

from __future__ import annotations

from sagline.kernels import tables
from sagline.kernels.cable import rows as t
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.chain_run import ChainRun
from sagline.kernels.dynamics.progress import READY
from sagline.kernels.dynamics.rigid_body import CENTER, MASS, VELOCITY, spin
from sagline.kernels.forward.platform import turned
from sagline.kernels.jit import glue, kernel


@kernel
def fill_platform_force(run: ChainRun) -> float:
    """Fill what moves the platform and what the winches feel; returns the power that elements and air take [W]."""
    chains, drives, state, rows = run.chains, run.drives, run.state, run.rows
    ends = run.cables[:, tables.PLATFORM_X : tables.PLATFORM_Z + 1]
    lost = 0.0
    wx, wy, wz = spin(state, run.inertia)
    hx, hy, hz = turned(state, run.handle[0], run.handle[1], run.handle[2])
    gx, gy, gz = run.given[0], run.given[1], run.given[2]
    fx, fy, fz = gx, gy, gz - run.inertia[MASS] * run.gravity
    mx, my, mz = run.given[3] + hy * gz - hz * gy, run.given[4] + hz * gx - hx * gz, run.given[5] + hx * gy - hy * gx
    for i in range(chains.counts.shape[0]):
        n, row, place, speed = chains.counts[i], chains.table[i], chains.place[i], chains.speed[i]
        x, y, z = turned(state, ends[i, 0], ends[i, 1], ends[i, 2])
        place[0, 0], place[1, 0], place[2, 0] = state[CENTER] + x, state[CENTER + 1] + y, state[CENTER + 2] + z
        speed[0, 0] = state[VELOCITY] + (wy * z - wz * y)
        speed[1, 0] = state[VELOCITY + 1] + (wz * x - wx * z)
        speed[2, 0] = state[VELOCITY + 2] + (wx * y - wy * x)
        c.fill_frame_node_velocity(place, speed, n, row)
        lost += c.fill_element_forces(place, speed, n, row, chains.pulls[i])
        air = 0.5 * row[c.DENSITY] * row[c.ELEMENT] * row[c.AIR_RATE]
        px = chains.pulls[i, 0] * (place[0, 1] - place[0, 0]) - air * speed[0, 0]
        py = chains.pulls[i, 0] * (place[1, 1] - place[1, 0]) - air * speed[1, 0]
        pz = chains.pulls[i, 0] * (place[2, 1] - place[2, 0]) - air * speed[2, 0]
        lost += air * (speed[0, 0] ** 2 + speed[1, 0] ** 2 + speed[2, 0] ** 2)
        if run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0:
            bx, by, bz = c.wind_on_element(place, 0, 1, 0.5 * row[c.ELEMENT] * row[c.WIND], run.wind)
            px, py, pz = px + bx, py + by, pz + bz
            lost -= bx * speed[0, 0] + by * speed[1, 0] + bz * speed[2, 0]
        fx, fy, fz = fx + px, fy + py, fz + pz
        mx, my, mz = mx + (y * pz - z * py), my + (z * px - x * pz), mz + (x * py - y * px)
        tension = c.tension_at_exit(place, n, row, chains.pulls[i])
        whole = c.whole_force(place, speed, n, row, chains.pulls[i])
        lifted = row[c.DENSITY] * run.gravity * drives.data[d.BEHIND_RISE, i]
        drives.now[d.AT_FRAME, i], drives.now[d.WHOLE, i] = tension, whole
        drives.now[d.AT_DRUM, i] = d.tension_at_drum(whole, lifted, row[c.STIFFNESS])
        mean, share = c.mean_tension(chains.pulls[i], n, row), row[c.SMOOTH] if run.at[READY] == 2 else 1.0
        rows[t.TENSION, i] = share * mean + (1.0 - share) * (rows[t.TENSION, i] if share < 1.0 else 0.0)
    for k in range(6):
        free = run.free[k]
        run.force[k] = free[0] * fx + free[1] * fy + free[2] * fz + free[3] * mx + free[4] * my + free[5] * mz
    return lost


@glue
def power_of_given_wrench(run: ChainRun) -> float:
    """Power of the given wrench at the present velocities [W]."""
    wx, wy, wz = spin(run.state, run.inertia)
    hx, hy, hz = turned(run.state, run.handle[0], run.handle[1], run.handle[2])
    there = run.state[VELOCITY] + (wy * hz - wz * hy)
    beside = run.state[VELOCITY + 1] + (wz * hx - wx * hz)
    above = run.state[VELOCITY + 2] + (wx * hy - wy * hx)
    turning = run.given[3] * wx + run.given[4] * wy + run.given[5] * wz
    return run.given[0] * there + run.given[1] * beside + run.given[2] * above + turning


@kernel
def kick_chains(run: ChainRun, h: float, begins: bool) -> None:
    """Change the nodes' velocities by forces, wind and air of a time; in reverse order where a step begins."""
    chains, audit = run.chains, run.drives.audit
    blows = run.wind[0] != 0.0 or run.wind[1] != 0.0 or run.wind[2] != 0.0
    for i in range(chains.counts.shape[0]):
        n, row, place, speed = chains.counts[i], chains.table[i], chains.place[i], chains.speed[i]
        if not begins:
            c.kick_nodes(place, speed, n, row, chains.pulls[i], h)
        audit[d.LOST] += c.slow_by_air(speed, n, row, h)
        if blows:
            audit[d.SUPPLIED] += c.add_wind_on_nodes(place, speed, n, row, run.wind, h)
        if begins:
            c.kick_nodes(place, speed, n, row, chains.pulls[i], h)
