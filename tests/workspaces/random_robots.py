"""Robots without a design behind them, and the verdicts of five functions on their poses.

The robots have every motion pattern. Their cables are soft, heavy or light; their limits are those of the chord or of
the frame end, or there are none; some have pulleys. The verdicts on a pose are compared with each other and with the
limits. The counters name each contradiction. Stability is another question, so `inverse` leaves it out.
"""

from __future__ import annotations

from collections import Counter
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array, Codes, Flags
from sagline.workspaces.proof import Prover
from sagline.workspaces.wrench_sets import load_of

Pattern = Literal["2T", "3T", "1R2T", "3R3T"]
CABLES: dict[Pattern, tuple[int, int]] = {"2T": (2, 4), "3T": (3, 6), "1R2T": (3, 5), "3R3T": (6, 9)}
SIZE = 4.0  # of the frames [m]
LOOSEST = 5.0  # largest half weight of a cable, relative to its chord tension
WITHIN = 1e-7  # relative tolerance of a limit
GRID = 200  # tensions of a cable that are tried
Margin, Proof, Pose = sl.MarginStatus, sl.ProofVerdict, sl.PoseStatus
NO_VERDICT = (Pose.BORDERLINE, Pose.NO_CHORD, Pose.SINGULAR)
COUNTED = ("poses", "open", "solved", "borderline", "proved", "fitting")  # counters that are not contradictions


class Case(NamedTuple):
    """Poses of a robot under one wrench, and the tensions for them."""

    robot: sl.Robot
    poses: sl.Pose
    wrench: Array
    loads: sl.WrenchSet
    plan: sl.Plan
    margin: sl.Margin


def random_robot(rng: np.random.Generator, pattern: Pattern) -> sl.Robot:
    """A robot with anchors anywhere in a cube, and cables of any weight and stiffness."""
    fewest, most = CABLES[pattern]
    m = int(rng.integers(fewest, most + 1))
    flat = np.array([1.0, 0.0 if pattern in ("2T", "1R2T") else 1.0, 1.0])
    frame = rng.uniform(-0.5, 0.5, (m, 3)) * SIZE * flat
    if rng.random() < 0.6:  # at the faces of the cube
        axis = rng.choice(np.flatnonzero(flat), m)
        frame[np.arange(m), axis] = 0.5 * SIZE * rng.choice([-1.0, 1.0], m)
    if rng.random() < 0.5:
        frame[:, 2] = np.abs(frame[:, 2])
    turns = pattern in ("1R2T", "3R3T")
    mass = 10.0 ** rng.uniform(-0.5, 2.0)
    weight = 9.81 * mass
    heavy = rng.choice([1e-4, 1e-2, 0.1, 0.5]) * rng.uniform(0.5, 2.0, 1 if rng.random() < 0.5 else m)
    soft = rng.choice([0.5, 3.0, 30.0, 1e3, 1e5]) * rng.uniform(0.5, 2.0)
    low = weight * rng.choice([0.0, 1e-3, 0.02, 0.1, 0.4])
    pulleys = pattern in ("3T", "3R3T") and rng.random() < 0.2
    return sl.Robot(
        "random",
        frame,
        rng.uniform(-0.3, 0.3, (m, 3)) * flat * turns,
        sl.Cable(np.broadcast_to(heavy * mass / SIZE, m), np.full(m, soft * weight)),
        mass,
        np.eye(3) * mass * 0.02 if turns else None,
        motion_pattern=pattern,
        plane_normal=[0.0, 1.0, 0.0] if pattern in ("2T", "1R2T") else None,
        winches=sl.Winch(pulley_radius=rng.choice([0.0, 0.03, 0.15], m)) if pulleys else None,
        gravity=9.81 if rng.random() < 0.9 else 0.0,
        tension_min=low,
        tension_max=low + weight * 10.0 ** rng.uniform(-1.0, 1.3) if rng.random() < 0.7 else np.inf,
        tension_limits_of="chord" if rng.random() < 0.5 else "frame_end",
    )


def random_poses(robot: sl.Robot, count: int, rng: np.random.Generator) -> sl.Pose:
    """Poses in the cube at which all cables have chords; half of them are tilted if the platform can rotate."""
    flat = robot.plane_normal is not None
    places = rng.uniform(-0.5, 0.5, (count, 3)) * SIZE * (~np.array([False, flat, False]))
    vectors = np.zeros((count, 3))
    if robot.motion_pattern in ("1R2T", "3R3T"):
        vectors = rng.normal(scale=0.3, size=(count, 3)) * ([0.0, 1.0, 0.0] if flat else [1.0] * 3)
        vectors[: count // 2] = 0.0
    poses = sl.Pose.from_quaternion(places, Rotation.from_rotvec(vectors).as_quat())
    return poses[sl.margin(robot, poses).status != Margin.NO_CHORD]


def has_pulleys(robot: sl.Robot) -> bool:
    return robot.winches is not None


def beyond_limits(robot: sl.Robot, plan: sl.Plan) -> Flags:
    """Mask (N,) of solved poses with a tension or an exit point that is not admissible."""
    limited, tau = plan.state.limited_tension, plan.state.chord_tension
    rounding = WITHIN * robot.mass * 9.81
    wrong = ~(limited >= robot.tension_min * (1.0 - WITHIN) - rounding)  # also without a value
    wrong |= limited > robot.tension_max * (1.0 + WITHIN) + rounding
    wrong |= np.isinf(robot.tension_max) & (tau > robot.cables.axial_stiffness * (1.0 + WITHIN))
    if not has_pulleys(robot):
        chord = np.hypot(plan.state.cables.span, plan.state.cables.rise)
        half_weight = 0.5 * robot.cables.linear_density * robot.gravity * chord
        wrong |= half_weight > LOOSEST * tau * (1.0 + WITHIN) + rounding
    else:
        wrong |= ~(plan.state.cables.span > 0.0)  # the cable leaves its pulley beyond the platform end
    return np.asarray(wrong.any(axis=-1) & (plan.status == Pose.SOLVED))


def fitting_loads(robot: sl.Robot, poses: sl.Pose, rng: np.random.Generator) -> tuple[Array, Flags]:
    """Wrenches (N, 6) that random admissible tensions balance, and a mask (N,) of poses with such tensions.

    A grid of tensions shows the frame-end tension. Its falling side is admissible only where it is never too small.
    """
    run = poses.transform(robot.platform_anchors) - robot.frame_anchors
    span, rise = np.hypot(run[..., 0], run[..., 1]), run[..., 2]
    chord = np.hypot(span, rise)
    cable = sl.Cable(robot.cables.linear_density[:, None], robot.cables.axial_stiffness[:, None])
    half_weight = 0.5 * robot.cables.linear_density * robot.gravity * chord
    least = np.maximum(half_weight / LOOSEST, 1e-4 * robot.mass)
    most = np.where(np.isfinite(robot.tension_max), robot.tension_max * 1.5 + half_weight, robot.cables.axial_stiffness)
    most = np.minimum(np.maximum(most, 1.001 * least), robot.mass * 9.81 * 30.0 + least)
    tau = np.geomspace(least, most, GRID, axis=-1)
    hung = sl.Catenary().from_tension(cable, span[..., None], rise[..., None], tau, robot.gravity)
    low, high = robot.tension_min[:, None], robot.tension_max[:, None]
    fits = (tau >= low) & (tau <= high)
    if robot.tension_limits_of == "frame_end":
        end = hung.frame_end_tension
        never_small = (end >= low * 1.001).all(axis=-1, keepdims=True)
        fits = (end >= low) & (end <= high) & ((np.gradient(end, axis=-1) > 0.0) | never_small)
    fits &= np.isinf(high) <= (tau <= robot.cables.axial_stiffness[:, None])
    chosen = np.where(fits, rng.random(fits.shape), -1.0).argmax(axis=-1)[..., None]
    tau, vertical = (np.take_along_axis(row, chosen, axis=-1)[..., 0] for row in (tau, hung.vertical_force))
    force = -(tau / chord)[..., None] * run
    force[..., 2] = -vertical
    lever = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(poses.matrix, -1, -2)
    wrench = -np.concatenate([force.sum(axis=1), np.cross(lever, force).sum(axis=1)], axis=-1)
    wrench[:, 2] += robot.mass * robot.gravity
    return wrench, np.asarray(fits.any(axis=-1).all(axis=-1))


def box_verdicts(case: Case, half: float) -> Codes:
    """Verdicts (N,) of proofs for boxes with these half edges [m] around the poses."""
    edges = np.full(3, half) * (1.0 if case.robot.plane_normal is None else np.array([1.0, 0.0, 1.0]))
    vectors = Rotation.from_quat(case.poses.quaternion).as_rotvec()
    return Prover(case.robot, case.loads, sl.Catenary()).verdicts(case.poses.position, edges, vectors)


def compare(robot: sl.Robot, count: int, rng: np.random.Generator) -> Counter[str]:
    """Contradictions at some poses of a robot by class, and the counters of COUNTED."""
    poses = random_poses(robot, count, rng)
    found: Counter[str] = Counter(poses=len(poses))
    if not len(poses):
        return found
    size = 10.0 ** rng.uniform(-3.0, 0.3) * robot.mass * 9.81
    wrench = rng.normal(size=6) * size * ([1.0] * 3 + [0.1] * 3) @ (robot.freedom.T @ robot.freedom)
    method = sl.MinimumNorm() if rng.random() < 0.5 else sl.Closest()
    loads = load_of(sl.WrenchPolytope([wrench]))
    plan = sl.inverse(robot, poses, tension=method, wrench=wrench, stability=False)
    case = Case(robot, poses, wrench, loads, plan, sl.margin(robot, poses, loads))
    _compare_margin(case, found)
    if not has_pulleys(robot):
        for half in (0.0, SIZE * 10.0 ** rng.uniform(-4.0, -1.5)):
            _compare_proof(case, box_verdicts(case, half), found)
        _compare_fitting(case, rng, found)
    if rng.random() < 0.1:
        _compare_workspace(case, found)
        _compare_design(case, found)
    return found


def _compare_margin(case: Case, found: Counter[str]) -> None:
    """Compare the statuses of margin and inverse, and the tensions with their limits."""
    known, said = case.plan.status, case.margin.status
    found["open"] += int((said == Margin.OPEN).sum())
    found["solved"] += int((known == Pose.SOLVED).sum())
    found["borderline"] += int((known == Pose.BORDERLINE).sum())
    for status in set(Pose) - {Pose.SOLVED, *NO_VERDICT}:
        found[f"margin FEASIBLE, inverse {status.name}"] += int(((said == Margin.FEASIBLE) & (known == status)).sum())
    for status in set(Pose) - {Pose.SOLVED, Pose.INFEASIBLE, *NO_VERDICT}:
        found[f"inverse {status.name}"] += int((known == status).sum())
    for kind in (Margin.INFEASIBLE, Margin.TOO_SLACK, Margin.SINGULAR):
        found[f"margin {kind.name}, inverse SOLVED"] += int(((said == kind) & (known == Pose.SOLVED)).sum())
    in_order = (case.margin.low <= case.margin.value) & (case.margin.value <= case.margin.high)
    found["margin outside its bracket"] += int((~in_order).sum())
    found[f"limit of the {case.robot.tension_limits_of}"] += int(beyond_limits(case.robot, case.plan).sum())


def _compare_proof(case: Case, proved: Codes, found: Counter[str]) -> None:
    """Compare the verdicts of proofs with margin and inverse at the middle of the boxes."""
    known, inside, outside = case.plan.status, proved == Proof.PROVED_INSIDE, proved == Proof.PROVED_OUTSIDE
    found["proved"] += int((inside | outside).sum())
    for status in set(Pose) - {Pose.SOLVED, *NO_VERDICT}:
        found[f"prove INSIDE, inverse {status.name}"] += int((inside & (known == status)).sum())
    found["prove OUTSIDE, inverse SOLVED"] += int((outside & (known == Pose.SOLVED)).sum())
    found["prove OUTSIDE, margin FEASIBLE"] += int((outside & (case.margin.status == Margin.FEASIBLE)).sum())
    found["prove INSIDE, margin INFEASIBLE"] += int((inside & (case.margin.status == Margin.INFEASIBLE)).sum())


def _compare_fitting(case: Case, rng: np.random.Generator, found: Counter[str]) -> None:
    """Compare the verdicts at loads that admissible tensions balance."""
    wrenches, exist = fitting_loads(case.robot, case.poses, rng)
    few = np.flatnonzero(exist)[: max(1, len(case.poses) // 4)]
    found["fitting"] += len(few)
    for p in few:
        pose, method = case.poses[int(p)], case.plan.tension
        status = sl.inverse(case.robot, pose, tension=method, wrench=wrenches[p], stability=False).status
        if status not in (Pose.SOLVED, *NO_VERDICT):
            found[f"fitting tensions, inverse {Pose(int(status)).name}"] += 1
        high = sl.margin(case.robot, pose, sl.WrenchPolytope([wrenches[p]])).high
        found["fitting tensions, margin INFEASIBLE"] += int(high < -1e-9 * case.robot.mass)


def _compare_workspace(case: Case, found: Counter[str]) -> None:
    """Compare the levels of a workspace, with a criterion on tensions, with the inverse at the nodes of its grid."""
    corner = np.full(3, 0.5 * SIZE)
    box = sl.PoseBox(-corner, corner)
    if case.robot.plane_normal is not None:
        box = sl.PoseBox(-corner * [1.0, 0.0, 1.0], corner * [1.0, 0.0, 1.0])
    any_sag = sl.MaximumSag(1e3)
    space = sl.workspace(case.robot, box, case.loads, criteria=[any_sag], cells=4, refine=False)
    nodes = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1).reshape(-1, 3)
    if case.robot.plane_normal is not None:
        nodes[:, 1] = 0.0
    poses, level = sl.Pose(nodes, np.eye(3)), space.level.reshape(-1)
    said = sl.margin(case.robot, poses, case.loads).status
    kept = said != Margin.NO_CHORD
    known = sl.inverse(case.robot, poses[kept], wrench=case.wrench, stability=False).status
    level, said = level[kept], said[kept]
    decided = (said != Margin.OPEN) & ~np.isin(known, NO_VERDICT)
    found["workspace inside, inverse INFEASIBLE"] += int((decided & (level > 0.0) & (known == Pose.INFEASIBLE)).sum())
    found["workspace outside, inverse SOLVED"] += int((decided & (level < 0.0) & (known == Pose.SOLVED)).sum())


def _compare_design(case: Case, found: Counter[str]) -> None:
    """Compare the goals of a design's first robot, at feasible poses, with margin and inverse."""
    away = np.einsum("kpi,pij->pkj", case.robot.frame_anchors[:, None] - case.poses.position, case.poses.matrix)
    clear = (np.abs(away) > 0.31).any(axis=-1).all(axis=-1)  # no frame anchor in the platform, which design rejects
    poses = case.poses[(case.margin.status == Margin.FEASIBLE) & clear]
    if not len(poses):
        return
    plan = sl.inverse(case.robot, poses, tension=sl.MinimumNorm(), wrench=case.wrench, stability=False)
    if not plan.feasible.any():  # all without a verdict; design then refuses the poses
        return
    raised = sl.FreeAnchors("frame", -0.01, 0.01, along=[0, 0, 1], symmetry="together")
    goals = ["workspace_share", "largest_tension"]
    front = sl.design(case.robot, [raised], goals, case.loads, poses, evaluations=16)
    found["design without feasible poses"] += int(front.start_values[0] < 1.0)
    largest = plan.state.chord_tension[plan.feasible].max()
    found["design with other tensions"] += int(not np.isclose(front.start_values[1], largest, rtol=1e-9))
