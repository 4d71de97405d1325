"""Workspaces of robots with fewer cables than degrees of freedom."""

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.core.arrays import Array
from sagline.workspaces import balanced
from sagline.workspaces.workspace import BY_BOX
from tests.kinematics.test_underconstrained import suspended
from tests.refusal import refused

BOX = sl.PoseBox([-1.9, -1.4, 0.8], [1.9, 1.4, 1.6])
FOUR = suspended(4, tension_min=5.0, tension_max=90.0)


def tensions_of_a_point(robot: sl.Robot, positions: Array) -> Array:
    """Tensions (N, 3) of three straight cables that carry a heavy point."""
    toward = robot.frame_anchors - positions[:, None]
    toward /= np.linalg.norm(toward, axis=2, keepdims=True)
    weight = np.array([0.0, 0.0, robot.mass * robot.gravity])
    return np.linalg.solve(toward.transpose(0, 2, 1), np.broadcast_to(weight, positions.shape)[..., None])[..., 0]


def test_three_cables_at_nearly_one_point_have_the_workspace_of_a_heavy_point() -> None:
    """The rotation of a small platform on light cables has no effect on the tensions, which a 3 x 3 system gives."""
    ends = 1e-3 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]])
    robot = suspended(
        3, 1e-5, platform_anchors=ends, center_of_mass=(0.0, 0.0, -0.1), tension_min=20.0, tension_max=80.0
    )
    space = sl.workspace(robot, BOX, cells=16)
    free = space.limiting != BY_BOX
    tension = tensions_of_a_point(robot, space.surface.vertices[free])
    distance = np.minimum(tension - 20.0, 80.0 - tension)
    assert np.count_nonzero(free) > 100
    np.testing.assert_allclose(distance.min(axis=1), 0.0, rtol=0.0, atol=0.1)
    assert np.mean(distance.argmin(axis=1) == space.limiting_cable[free]) > 0.98


def test_the_volume_is_the_share_of_random_positions_with_an_equilibrium() -> None:
    places = np.random.default_rng(3).uniform(BOX.low, BOX.high, (4000, 3))
    solved = sl.inverse(FOUR, places).solved
    space = sl.workspace(FOUR, BOX, cells=12)
    assert np.array_equal(space.levels()(places) >= 0.0, solved)
    volume = float(np.prod(BOX.high - BOX.low))
    share = solved.mean()
    assert space.volume == pytest.approx(volume * share, abs=3.0 * volume * np.sqrt(share * (1.0 - share) / 4000))
    assert space.surface.closed


@pytest.mark.parametrize("lowest", [5.0, 30.0])
@pytest.mark.parametrize("kind", ["chord", "frame_end"])
@pytest.mark.parametrize("density", [0.2, 0.6])
def test_the_sign_of_the_margin_is_the_verdict_of_inverse_with_heavy_cables(
    density: float, kind: Literal["chord", "frame_end"], lowest: float
) -> None:
    """The frame-end tension of a slack heavy cable is large, and a search without limits finds other equilibria."""
    corners = np.array([[x, y, 0.0] for x in (-1, 1) for y in (-1, 1)])
    robot = suspended(
        4,
        frame_anchors=corners * (2.0, 1.5, 0.0) + (0.0, 0.0, 2.5),
        platform_anchors=corners * (0.2, 0.15, 0.0) + (0.0, 0.0, 0.05),
        center_of_mass=(0.0, 0.0, -0.05),
        cables=sl.Cable(density, 2e5),
        tension_min=lowest,
        tension_max=200.0,
        tension_limits_of=kind,
    )
    seen = [[1.4078, 0.9487, 0.3389], [1.8337, 1.2771, 1.8706], [-1.81, -0.2562, 1.7072], [1.8082, -1.115, 1.9455]]
    places = np.vstack((seen, np.random.default_rng(0).uniform([-2.0, -1.5, 0.0], [2.0, 1.5, 2.5], (500, 3))))
    plan = sl.inverse(robot, places)
    margin = sl.workspace(robot, BOX, cells=4, refine=False).levels().details(places).margin
    assert 100 < plan.solved.sum() < 400
    np.testing.assert_array_equal(margin >= 0.0, plan.solved)
    tension = plan.state.limited_tension[plan.solved]
    distance = np.minimum(tension - lowest, 200.0 - tension).min(axis=1)
    np.testing.assert_allclose(margin[plan.solved], distance, rtol=1e-12, atol=1e-9)


def test_with_a_given_yaw_the_platform_has_this_yaw(tmp_path: Path) -> None:
    turned = sl.Orientations(Rotation.from_euler("z", [-0.02]))
    names: Any = ("x", "y", "z", "yaw")
    places = np.random.default_rng(6).uniform(BOX.low, BOX.high, (1500, 3))
    robot = suspended(4, center_of_mass=(0.06, 0.03, -0.05), tension_min=5.0, tension_max=90.0)
    starts = sl.Pose.from_euler(places, -0.02, 0.0, 0.0)
    plan, level = sl.inverse(robot, starts, given=names), sl.inverse(robot, places)
    whole = sl.workspace(robot, BOX, orientations=turned, given=names, cells=4, refine=False)
    whole.save(tmp_path / "space.nc")
    space = sl.load_workspace(tmp_path / "space.nc")
    assert space.given == names
    assert np.count_nonzero(plan.solved != level.solved) > 50
    levels = space.levels()
    np.testing.assert_array_equal(levels(places) >= 0.0, plan.solved)
    tension = plan.chord_tension[plan.solved]
    distance = np.minimum(tension - 5.0, 90.0 - tension).min(axis=1)
    np.testing.assert_allclose(levels.details(places).margin[plan.solved], distance, rtol=1e-12, atol=1e-9)
    assert "yaw of −1.146" in str(space)
    frequency = sl.modes(plan.state).frequency[plan.solved, 0]
    middle = sl.LeastFrequency(float(np.median(frequency)) + 1e-6)
    stiffer = sl.workspace(robot, BOX, criteria=[middle], orientations=turned, given=names, cells=4, refine=False)
    found = stiffer.levels()(places)[plan.solved] >= 0.0
    np.testing.assert_array_equal(found, frequency >= middle.limit)
    assert 0 < found.sum() < found.size


@pytest.mark.parametrize(
    ("robot", "names", "told"),
    [
        (FOUR, ("x", "y", "yaw", "level"), "without z"),
        (FOUR, ("x", "y", "z"), "x, y, z"),
        (FOUR, ("x", "y", "z", "roll"), "'roll'"),
        (sl.load_robot("cogiro"), ("x", "y", "z", "yaw"), "('x', 'y', 'z', ...)"),
    ],
)
def test_given_values_that_do_not_fit_are_refused(robot: sl.Robot, names: Any, told: str) -> None:
    with refused("given", told):
        sl.workspace(robot, BOX, given=names, cells=4)


def test_tensions_without_a_value_are_outside(monkeypatch: pytest.MonkeyPatch) -> None:
    levels = sl.workspace(FOUR, BOX, cells=4, refine=False).levels()
    places = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0]])
    assert np.all(levels(places) > 0.0)
    monkeypatch.setattr(balanced, "limited_tension", lambda *_: np.array([[20.0, 20.0, np.nan, 20.0]]))
    assert np.all(levels.details(places).margin == -np.inf)
    assert np.all(levels(places) < 0.0)


def test_every_corner_of_the_loads_has_its_own_equilibrium() -> None:
    places = np.random.default_rng(4).uniform(BOX.low, BOX.high, (300, 3))
    box = sl.workspace(FOUR, BOX, sl.WrenchBox(force=(15.0, 0.0, 10.0)), cells=4, refine=False)
    loads = [np.array([x, 0.0, z, 0.0, 0.0, 0.0]) for x in (-15.0, 15.0) for z in (-10.0, 10.0)]
    alone = np.all([sl.inverse(FOUR, places, wrench=load).solved for load in [*loads, np.zeros(6)]], axis=0)
    assert 30 < alone.sum() < 270
    assert np.array_equal(box.levels()(places) >= 0.0, alone)


def test_the_frame_contains_the_platform_in_the_rotation_of_the_balance() -> None:
    robot = suspended(4, center_of_mass=(0.08, 0.0, -0.05), tension_min=5.0, platform_size=(0.6, 0.5, 0.1))
    places = np.random.default_rng(5).uniform([-1.4, -0.9, 0.0], [1.4, 0.9, 0.3], (500, 3))
    space = sl.workspace(robot, BOX, criteria=[sl.InFrame()], cells=4, refine=False)
    plan = sl.inverse(robot, places)
    corners = 0.5 * np.array([[x, y, z] for x in (-0.6, 0.6) for y in (-0.5, 0.5) for z in (-0.1, 0.1)])
    low = plan.state.pose.transform(np.vstack((corners, robot.platform_anchors)))[..., 2].min(axis=1)
    level = (places[:, 2] - 0.05) >= 0.0
    assert np.any((low >= 0.0) != level)
    assert np.array_equal((space.levels()(places) >= 0.0)[plan.solved], (low >= 0.0)[plan.solved])


@pytest.mark.parametrize(
    ("item", "given"),
    [
        ("orientations", {"orientations": sl.Tilts(0.1)}),
        ("hull", {"hull": "inner"}),
        ("moment_arm", {"moment_arm": 0.2}),
        ("wrenches", {"wrenches": sl.Accelerations(1.0)}),
        (
            "wrenches",
            {"wrenches": sl.WrenchBox(10.0, 1.0) + sl.WrenchBox((1.0, 1.0, 0.0)) + sl.WrenchPolytope(np.eye(6))},
        ),
    ],
)
def test_arguments_without_meaning_are_refused(item: str, given: dict[str, Any]) -> None:
    with refused(item):
        sl.workspace(FOUR, BOX, **given)
    with refused("suspended: number of cables", "2"):
        sl.workspace(suspended(2))


def test_an_empty_workspace_names_the_cable() -> None:
    heavy = suspended(4, tension_min=5.0, tension_max=[90.0, 90.0, 90.0, 6.0])
    space = sl.workspace(heavy, sl.PoseBox([0.3, -0.8, 1.0], [0.6, -0.5, 1.3]), cells=4)
    assert space.nearest is not None
    assert space.nearest.cables == (3,)
    assert f"{-space.nearest.margin:.3g}" in space.nearest.reason
    taut = suspended(4, tension_min=[5.0, 5.0, 60.0, 5.0])
    space = sl.workspace(taut, sl.PoseBox([0.3, -0.8, 1.0], [0.6, -0.5, 1.3]), cells=4)
    assert space.nearest is not None
    assert space.nearest.cables == (2,)
    assert f"{-space.nearest.margin:.3g}" in space.nearest.reason
    assert "outside" in space.nearest.reason


def test_positions_with_an_unstable_equilibrium_only_are_outside() -> None:
    near = sl.PoseBox([-0.1, -0.1, 0.9], [0.1, 0.1, 1.1])
    space = sl.workspace(suspended(3, center_of_mass=(0.0, 0.0, 0.9)), near, cells=4, refine=False)
    assert space.nearest is not None
    assert np.isinf(space.nearest.margin)
    assert sl.PoseStatus.UNSTABLE.text in space.nearest.reason


def test_the_command_writes_a_workspace_that_can_be_loaded(tmp_path: Path) -> None:
    file = tmp_path / "four.yaml"
    file.write_text(sl.dump_robot(FOUR))
    asked = ["workspace", str(file), "--cells", "6", "--no-figures", "--out", str(tmp_path)]
    done = CliRunner().invoke(app, asked)
    assert done.exit_code == 0, done.output
    assert "4 cables" in " ".join(done.output.split())
    found = sl.load_workspace(next(tmp_path.glob("*.nc")))
    assert found.volume == pytest.approx(sl.workspace(FOUR, cells=6).volume, rel=1e-12)
