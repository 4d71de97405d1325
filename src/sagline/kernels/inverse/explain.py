"""Why poses are infeasible: the proof, the cables that stand against the wrench, and by how much it is too large."""

from __future__ import annotations

from sagline.arrays import Array, Flags, Indices
from sagline.kernels import tables
from sagline.kernels.balance.freedom import translations_of
from sagline.kernels.balance.setting import Limits, Platform, new_balance, set_pose, start_from_minimum_norm
from sagline.kernels.cable.cables import new_cables
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CHORD_TENSION
from sagline.kernels.inverse.poses import LimitTerms, ModelTerms, Robots
from sagline.kernels.jit import entry
from sagline.kernels.memory import Memory, block
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
    room: tuple[Array, Indices],
    explanations: tuple[Array, Array, Flags],
) -> None:
    """Explain those of N poses that no tensions balance, in chord tensions, however the load is shared.

    Args:
        model_terms: As in `inverse_poses`.
        limit_terms: As in `inverse_poses`.
        robot_terms: As in `inverse_poses`.
        poses: Rows (N, POSE_COLUMNS).
        needed: The wrench that J tau had to supply, along the free motions, (N, n).
        which: Which poses, (K,).
        room: `memory_for` as many cables.
        explanations: Filled for these poses: smallest change of the force [N], (N,); Farkas vectors along the free
            motions, (N, n); whether a cable stands against the needed wrench, (N, m).
    """
    limits = Limits(*limit_terms)
    freedom, bodies, robots = robot_terms
    shortfall, farkas, blocking = explanations
    n = freedom.shape[0]
    m = blocking.shape[1]
    cables, rest = new_cables(Memory(*room), m)
    balance, rest = new_balance(rest, m, n)
    weights, at = block(rest.numbers, 0, 1, m)
    weight = weights[0]
    for i in range(m):
        weight[i] = 1.0
    rest = Memory(rest.numbers[at:], rest.counters)
    translations = translations_of(freedom)
    for p in which:
        body = bodies[min(p, bodies.shape[0] - 1)]
        # the wrench is in what is needed
        platform = Platform(freedom, body, robots[min(p, robots.shape[0] - 1)], poses[p], needed[p])
        model = Model(model_terms[0], model_terms[1], model_terms[2], body[tables.GRAVITY])
        set_pose(model, limits, CHORD_TENSION, weight, platform, cables, balance)
        for k in range(n):
            balance.right[k] = needed[p, k]
        start_from_minimum_norm(balance)
        prove_empty(balance.strips, balance.inverse, balance.null, translations, rest, farkas[p], blocking[p])
        shortfall[p] = wrench_shortfall(balance.matrix, balance.right, cables.low, cables.high, translations, rest)
