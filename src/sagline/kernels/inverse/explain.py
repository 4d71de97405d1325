"""Why poses are infeasible: the proof, the cables that stand against the wrench, and by how much it is too large."""

from __future__ import annotations

from sagline.arrays import Array, Flags, Indices
from sagline.kernels import tables
from sagline.kernels.balance.freedom import turns
from sagline.kernels.balance.setting import Limits, Platform, new_setting, set_pose, start_from_minimum_norm
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CHORD_TENSION
from sagline.kernels.inverse.poses import LimitTerms, ModelTerms, Robots
from sagline.kernels.jit import entry
from sagline.kernels.sharing.proof import prove_empty
from sagline.kernels.sharing.shortfall import wrench_shortfall


@entry
def explain_poses(
    model_terms: ModelTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    poses: Array,
    needed: Array,
    which: Indices,
    weight: Array,
    explanations: tuple[Array, Array, Flags],
) -> None:
    """Explain those of N poses that no tensions balance.

    Args:
        model_terms: As in `inverse_poses`.
        limit_terms: As in `inverse_poses`.
        robot_terms: As in `inverse_poses`.
        poses: Rows (N, POSE_COLUMNS).
        needed: The wrench that J tau had to supply, along the free motions, (N, n).
        which: Which poses, (K,).
        weight: Ones, (m,): the explanation is in chord tensions, however the load is shared.
        explanations: Filled for these poses: smallest change of the force [N], (N,); Farkas vectors along the free
            motions, (N, n); whether a cable stands against the needed wrench, (N, m).
    """
    limits = Limits(*limit_terms)
    freedom, bodies, robots = robot_terms
    shortfall, farkas, blocking = explanations
    n = freedom.shape[0]
    cables, balance = new_setting(weight.size, n)
    translations = 0
    for k in range(n):
        translations += 0 if turns(freedom, k) else 1
    for p in which:
        body = bodies[min(p, bodies.shape[0] - 1)]
        # the wrench is in what is needed
        platform = Platform(freedom, body, robots[min(p, robots.shape[0] - 1)], poses[p], needed[p])
        model = Model(model_terms[0], model_terms[1], model_terms[2], body[tables.GRAVITY])
        set_pose(model, limits, CHORD_TENSION, weight, platform, cables, balance)
        for k in range(n):
            balance.right[k] = needed[p, k]
        start_from_minimum_norm(balance)
        prove_empty(balance.strips, balance.inverse, balance.null, translations, farkas[p], blocking[p])
        shortfall[p] = wrench_shortfall(balance.matrix, balance.right, cables.low, cables.high, translations)
