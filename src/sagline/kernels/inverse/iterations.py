"""Iterations of tension distribution and cable states until the sag forces converge; docs/model.md, section 5.

If the variable of the distribution is the frame-end tension, the balance is linearized at the last tensions.
"""

from __future__ import annotations

from sagline.core.arrays import Codes
from sagline.kernels import codes
from sagline.kernels.balance.setting import (
    Balance,
    Platform,
    factor_balance,
    fill_needed_wrench,
    scale_limits,
    start_from_minimum_norm,
)
from sagline.kernels.cable.admissible import cable_without_tension, is_limited_by_strain
from sagline.kernels.cable.cables import Cables, chord_of, material_of, pulley_of
from sagline.kernels.cable.states import NEAR, SAME_EXIT, frame_end_tension, solve_cable_states
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import glue, kernel
from sagline.kernels.tension.nearest import Distribution, ReferencePoint, is_nearest, set_reference, share_nearest
from sagline.kernels.tension.other_methods import distribute_by_other_method
from sagline.kernels.tension.polygon import WorkArrays, reset_work_arrays

TENSION_CONVERGED = 1e-9  # relative change of tension below which a distribution in frame-end tensions has converged
SLOPE_STEP = 1e-4  # relative step of the central difference of the frame-end tension


@kernel
def linearize_ends(model: Model, distribution: Distribution, cables: Cables, balance: Balance) -> bool:
    """Linearize the frame-end tensions at the present chord tensions, and factor the balance. False if singular."""
    for i in range(cables.tau.size):
        tau = cables.tau[i]
        chord, material, pulley = chord_of(cables, i), material_of(cables, i), pulley_of(cables, i)
        above = frame_end_tension(model, chord, material, pulley, tau * (1.0 + SLOPE_STEP))
        below = frame_end_tension(model, chord, material, pulley, tau * (1.0 - SLOPE_STEP))
        slope = (above - below) / (2.0 * SLOPE_STEP * tau)
        balance.offset[i] = frame_end_tension(model, chord, material, pulley, tau) - slope * tau
        balance.scale[i] = slope * distribution.weight[i]
        scale_limits(cables, balance, i)
    return factor_balance(balance)


ITERATIONS = 30
# iterations after which the reference is fixed, so that rounding cannot change the choice between equal tensions
FREE_ITERATIONS = 8
CONVERGED = 1e-10  # largest change of a converged sag force, in N and relative to the largest tension:
SAG_ROUNDING = 1e-15


@glue
def distribute_and_solve_cables(
    model: Model, distribution: Distribution, platform: Platform, cables: Cables, balance: Balance,
    near: ReferencePoint, work: WorkArrays | None, statuses: Codes,
) -> int:  # fmt: skip
    """Distribute tensions and solve the cables until the sag forces converge. Returns the pose's status.

    cables: the cables from `set_pose`, with tensions, ratios and sag forces to be filled; work: work arrays for
    frame-end tensions and for methods that are not projections. With None, the code of both is not compiled. statuses:
    filled with the status of each cable, (m,).
    """
    near.held.labels[0] = 0
    if work is not None:
        reset_work_arrays(work)
    set_reference(distribution, balance.offset, balance.null, near)
    solved = False
    fill_needed_wrench(platform, cables, balance)
    possible = cable_without_tension(cables) < 0
    status = codes.POSE_NOT_CONVERGED if possible else codes.POSE_INFEASIBLE
    for k in range(ITERATIONS if possible else 0):
        start_from_minimum_norm(balance)
        if work is None:
            status = share_nearest(balance.bounds, balance.null, near, balance.tension)
        elif is_nearest(distribution) or k >= FREE_ITERATIONS:
            if k >= FREE_ITERATIONS and not is_nearest(distribution):
                fix_reference(balance, near)
            status = share_nearest(balance.bounds, balance.null, near, balance.tension)
        else:
            status = distribute_by_other_method(
                distribution, balance.bounds, balance.offset, balance.null, near, work, balance.tension
            )
        if status != codes.POSE_SOLVED:
            break
        moved, largest = take_tensions(cables, balance)
        gravest, turned = solve_cable_states(model, cables, not solved, solved and moved < NEAR, statuses)
        if gravest == codes.CABLE_TOO_SLACK or gravest == codes.CABLE_NOT_CONVERGED:
            status = codes.POSE_NOT_CONVERGED
            break
        status = codes.POSE_NOT_CONVERGED
        change = sag_force_change(cables)
        converged = model.code != codes.CATENARY or (
            change <= CONVERGED + SAG_ROUNDING * largest and turned <= SAME_EXIT
        )
        if work is None or distribution.variable != codes.FRAME_END_TENSION:
            if converged:
                status = codes.POSE_SOLVED
                break
        else:
            if converged and solved and moved <= TENSION_CONVERGED:
                status = codes.POSE_SOLVED
                break
            if not linearize_ends(model, distribution, cables, balance):
                status = codes.POSE_SINGULAR
                break
            set_reference(distribution, balance.offset, balance.null, near)
            reset_work_arrays(work)
        solved = True
        fill_needed_wrench(platform, cables, balance)
    if status == codes.POSE_SOLVED and not strain_admits_tensions(cables):
        status = codes.POSE_INFEASIBLE
    return status


@glue
def strain_admits_tensions(cables: Cables) -> bool:
    """True if no cable without upper limit exceeds the largest strain, which distribution methods ignore."""
    for i in range(cables.tau.size):
        if cables.tau[i] > cables.high[i] and is_limited_by_strain(cables, i):
            return False
    return True


@glue
def fix_reference(balance: Balance, near: ReferencePoint) -> None:
    """Make the present tensions the reference, and release an active bound that is only due to a tie."""
    near.held.labels[0] = 0
    for k in range(balance.null.shape[0]):
        near.reference[k] = 0.0
        for i in range(balance.null.shape[1]):
            near.reference[k] += balance.null[k, i] * balance.tension[i]


@glue
def take_tensions(cables: Cables, balance: Balance) -> tuple[float, float]:
    """Copy the distributed tensions to the cables. Returns the largest relative change and the largest tension [N]."""
    largest = 0.0
    moved = 0.0
    for i in range(cables.tau.size):
        new = balance.tension[i] / balance.scale[i]
        moved = max(moved, abs(new - cables.tau[i]) / new)
        largest = max(largest, new)
        cables.tau[i] = new
        cables.last_sag_force[i] = cables.sag_force[i]
    return moved, largest


@glue
def sag_force_change(cables: Cables) -> float:
    """Largest change of a sag force in this iteration [N]."""
    change = 0.0
    for i in range(cables.tau.size):
        change = max(change, abs(cables.sag_force[i] - cables.last_sag_force[i]))
    return change


@glue
def store_tensions(
    model: Model, distribution: Distribution, cables: Cables, work: WorkArrays | None, near: ReferencePoint
) -> None:
    """Store the tensions, in the variable of the distribution, for the next pose."""
    for i in range(cables.tau.size):
        near.previous[i] = cables.tau[i]
        if distribution.variable == codes.HORIZONTAL_TENSION:
            near.previous[i] = cables.tau[i] * cables.cosine[i]
        elif work is not None and distribution.variable == codes.FRAME_END_TENSION:
            near.previous[i] = frame_end_tension(
                model, chord_of(cables, i), material_of(cables, i), pulley_of(cables, i), cables.tau[i]
            )
