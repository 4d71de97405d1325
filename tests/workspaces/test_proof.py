"""Proofs for boxes of poses compared with the exact inverse and known volumes; refusals."""

from __future__ import annotations

import pickle
import time
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused
from tests.tiers import extended
from tests.workspaces.proved_boxes import contradictions

pytestmark = extended

INFINITE = {"tension_max": np.inf}
EXACT, STRAIGHT = sl.Catenary(), sl.Straight()


@pytest.mark.parametrize("model", [STRAIGHT, EXACT], ids=["straight", "catenary"])
@pytest.mark.parametrize("name", ["ipanema-1", "article-suspended", "article-mixed", "falcon-7"])
def test_no_pose_contradicts_a_proof(name: str, model: sl.CableModel) -> None:
    inside, outside, wrong = contradictions(sl.load_robot(name), 90, np.random.default_rng(14), model=model)
    assert wrong == 0
    assert min(inside, outside) > 50


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("article-suspended", {"tension_limits_of": "frame_end"}),
        ("article-suspended", {"tension_limits_of": "frame_end", "tension_min": 3.0}),
        ("article-suspended", INFINITE),
        ("article-suspended", {"center_of_mass": [0.05, -0.1, 0.1]}),
        ("article-mixed", {"tension_min": 0.0}),
        ("cogiro", INFINITE),
    ],
)
def test_no_pose_contradicts_a_proof_with_other_limits(name: str, changes: dict[str, Any]) -> None:
    robot = sl.load_robot(name).replace(**changes)
    inside, outside, wrong = contradictions(robot, 180, np.random.default_rng(15))
    assert wrong == 0
    assert inside > 50
    assert outside > 10


@pytest.mark.parametrize(
    ("name", "wrenches"),
    [
        ("article-suspended", sl.WrenchBox(force=50.0, moment=5.0)),
        ("ipanema-1", sl.WrenchEllipsoid(force=30.0, moment=2.0, center=[0, 0, -20, 0, 0, 0])),
        ("cogiro", sl.WrenchPolytope([[0, 0, 0, 0, 0, 0], [0, 0, -300, 0, 0, 0], [50, 0, -100, 0, 0, 9]])),
        ("article-suspended", sl.Accelerations(linear=2.0, angular=1.0)),
    ],
    ids=["box", "ellipsoid", "polytope", "accelerations"],
)
def test_no_load_of_a_set_contradicts_a_proof(name: str, wrenches: sl.WrenchSet) -> None:
    inside, outside, wrong = contradictions(sl.load_robot(name), 180, np.random.default_rng(16), wrenches=wrenches)
    assert wrong == 0
    assert min(inside, outside) > 50


@pytest.mark.parametrize("name", ["article-suspended", "ipanema-3"])
def test_no_orientation_contradicts_a_proof(name: str) -> None:
    inside, outside, wrong = contradictions(sl.load_robot(name), 300, np.random.default_rng(17), turns=(0.02, 0.1, 0.2))
    assert wrong == 0
    assert min(inside, outside) > 50


@pytest.mark.parametrize("turns", [(0.0,), (0.1, 0.2)], ids=["level", "turned"])
def test_contradictions_appear_without_the_bound_of_second_order_terms(turns: tuple[float, ...]) -> None:
    rng = np.random.default_rng(5)
    robot = sl.load_robot("article-suspended")
    *_, wrong = contradictions(robot, 600, rng, turns=turns, precision=(0.0, 1e-12))
    assert wrong > 5


def test_the_published_workspace_between_its_bounds() -> None:
    robot = sl.load_robot("ipanema-1").replace(gravity=0.0, tension_min=1.0, tension_max=10.0)
    box = sl.PoseBox(robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0))
    proof = sl.prove(robot, box, model=STRAIGHT, budget=60.0, smallest=0.06)
    assert proof.verdict == sl.ProofVerdict.OPEN
    assert 8.0 < proof.inside_volume < 9.774 < proof.volume - proof.outside_volume < 12.0
    assert proof.inside + proof.outside + proof.open == pytest.approx(1.0, abs=1e-12)
    sizes = (proof.cells.high - proof.cells.low).prod(axis=1)
    assert sizes.sum() == pytest.approx(24.0, rel=1e-12)
    assert proof.inside_volume == pytest.approx(sizes[proof.cells.verdict == 1].sum(), rel=1e-9)
    assert "inside" in str(proof)
    assert f"{proof.tried:,} boxes" in str(proof)


def test_small_boxes_are_proved_at_once() -> None:
    robot = sl.load_robot("article-suspended")
    inside = sl.prove(robot, sl.PoseBox([-1, -1, 2], [1, 1, 3]), sl.WrenchBox(force=10.0, moment=1.0))
    assert (inside.verdict, inside.inside) == (sl.ProofVerdict.PROVED_INSIDE, 1.0)
    above = sl.prove(robot, sl.PoseBox([-1, -1, 6.5], [1, 1, 7.0]))
    assert (above.verdict, above.outside) == (sl.ProofVerdict.PROVED_OUTSIDE, 1.0)
    assert not pickle.loads(pickle.dumps(above)).cells.low.flags.writeable
    point = sl.prove(robot, sl.PoseBox([0, 0, 2], [0, 0, 2]))
    assert (point.verdict, point.volume, point.tried) == (sl.ProofVerdict.PROVED_INSIDE, 0.0, 1)
    flat = sl.prove(robot, sl.PoseBox([-1, -1, 2], [1, 1, 2]))
    assert (flat.verdict, flat.volume) == (sl.ProofVerdict.PROVED_INSIDE, 0.0)
    assert sl.prove(robot, sl.PoseBox([-1, -1, 2], [1, 1, 3], tilt=0.05)).verdict == sl.ProofVerdict.PROVED_INSIDE
    tilted = sl.prove(sl.load_robot("cogiro"), sl.PoseBox([-0.1, -0.1, 2], [0.1, 0.1, 2.1], tilt=1.5))
    assert tilted.verdict == sl.ProofVerdict.PROVED_OUTSIDE


def test_a_planar_platform_rotates_only_in_its_plane() -> None:
    corners = [[-0.3, 0, 0.2], [0.3, 0, 0.2], [0.3, 0, -0.2], [-0.3, 0, -0.2]]
    robot = sl.Robot(
        "plane",
        [[-2, 0, 0], [2, 0, 0], [2, 0, 3], [-2, 0, 3]],
        corners,
        sl.Cable(0.01, 1e5),
        5.0,
        0.1 * np.eye(3),
        motion_pattern="1R2T",
        plane_normal=[0, 1, 0],
        tension_min=5.0,
        tension_max=500.0,
    )
    middle, angles = np.array([0.0, 0.0, 1.5]), np.linspace(-0.8, 0.8, 33)
    assert (sl.margin(robot, sl.Pose.from_euler(np.tile(middle, (33, 1)), 0, angles, 0)).low > 100.0).all()
    proof = sl.prove(robot, sl.PoseBox([-0.1, 0, 1.4], [0.1, 0, 1.6], tilt=0.8))
    assert proof.verdict == sl.ProofVerdict.PROVED_INSIDE
    assert proof.tried <= 1 + 1 + 4  # the whole angle, and its quarters
    turned = sl.prove(robot, sl.PoseBox(middle, middle, tilt=1.57))
    assert turned.verdict == sl.ProofVerdict.PROVED_OUTSIDE
    with refused("box: tilt", "5.73 deg", kind=sl.InvalidValueError):
        sl.prove(robot.replace(motion_pattern="2T"), sl.PoseBox(middle, middle, tilt=0.1))


def test_cables_stretched_to_more_than_twice_their_length() -> None:
    # unrealistic robots within their limits: the inverse finds tensions above EA
    soft = sl.load_robot("ipanema-1").replace(cables=sl.Cable(0.0185, 36.8), tension_max=225.0)
    _, outside, wrong = contradictions(soft, 180, np.random.default_rng(18))
    assert wrong == 0
    assert outside > 100
    softer = sl.load_robot("article-mixed").replace(cables=sl.Cable(0.095, 1240.0), tension_max=np.inf)
    inside, _, wrong = contradictions(softer, 180, np.random.default_rng(18))
    assert wrong == 0
    assert inside > 100


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_the_budget_ends_in_open_cells(tilt: float) -> None:
    robot = sl.load_robot("cogiro")
    began = time.monotonic()
    proof = sl.prove(robot, sl.PoseBox([-8, -6, 0], [8, 6, 5], tilt=tilt), budget=0.2)
    assert time.monotonic() - began < 1.5
    assert proof.verdict == sl.ProofVerdict.OPEN
    assert proof.open > 0.01


def test_progress_is_reported_and_can_interrupt() -> None:
    robot, box = sl.load_robot("cogiro"), sl.PoseBox([-8, -6, 0], [8, 6, 5])
    told: list[tuple[int, int]] = []

    def progress(done: int, known: int) -> None:
        told.append((done, known))
        if done > 2000:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sl.prove(robot, box, progress=progress)
    assert told[-1][0] > 2000
    assert all(done <= known for done, known in told)


def test_unsupported_options_are_refused() -> None:
    robot, box = sl.load_robot("article-suspended"), sl.PoseBox([0, 0, 2], [1, 1, 3], tilt=0.1)
    with refused("ipanema-2-pulleys: pulley_radius[0]", "0.25 m", kind=sl.InvalidValueError):
        sl.prove(sl.load_robot("ipanema-2-pulleys"), box)
    with refused("article-suspended: number of cables", "5", ">= 6 for 3R3T", kind=sl.InvalidValueError):
        sl.prove(sl.without_cables(robot, 0, 1, 2), box)
    with refused("wrenches: angular accelerations", kind=sl.InvalidValueError):
        sl.prove(robot, box, sl.Accelerations(angular=1.0))


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(4))
def test_a_million_poses_contradict_no_proof(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    total = 0
    robots = [sl.load_robot(name) for name in sl.robot_names()]
    for robot in robots:
        bare = robot.replace(winches=None) if robot.winches is not None else robot
        for model in (STRAIGHT, EXACT):
            for wrenches in (None, sl.WrenchBox(force=0.05 * robot.mass * 9.81)):
                inside, outside, wrong = contradictions(bare, 1200, rng, model=model, wrenches=wrenches)
                assert wrong == 0, (robot.name, model)
                total += inside + outside
    assert total > 250_000
