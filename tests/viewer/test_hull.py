"""The hull of a region: that of the workspace, within half a second, on a finer grid if it is small."""

import re

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import workspace
from sagline.viewer.slices import MarginScale
from sagline.viewer.tension_scale import cable_color
from sagline.viewer.workspace import WorkspaceQuery, region_hull, region_in
from tests.effort import least_seconds
from tests.tiers import extended

ROBOT = sl.load_robot("article-suspended")
LOADS = sl.WrenchBox(force=50.0)
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def test_a_hull_agrees_with_the_workspace() -> None:
    shares: list[float] = []
    turned = sl.Pose.from_euler(np.zeros(3), 0.1, 0.0, 0.0)
    asked = WorkspaceQuery(ROBOT, turned.quaternion, sl.Catenary(), LOADS)
    found = region_hull(asked, True, lambda done, total: shares.append(done / total))
    cells = max(region_in(asked, rough=True).cells)
    space = sl.workspace(ROBOT, wrenches=LOADS, orientations=sl.Orientations(turned.matrix), cells=cells, refine=False)
    assert len(found.vertices) == len(space.surface.vertices)
    np.testing.assert_allclose(found.vertices, space.surface.vertices, atol=1e-3)  # m
    told = re.search(r"Region</b> (\d+)", found.text)
    assert told is not None
    assert float(told[1]) == pytest.approx(space.volume, rel=0.02)  # without what bulges between vertices
    shares_of = {limit.cable: 100.0 * limit.share for limit in space.limits}
    told_shares = {int(cable): float(share) for cable, share in re.findall(r"cable (\d), (\d+) %", found.text)}
    assert set(told_shares) >= {cable for cable, share in shares_of.items() if share > 2.0}
    assert all(share == pytest.approx(shares_of[cable], abs=2.0) for cable, share in told_shares.items())
    assert all(f"{face}" in found.text for face in space.open_faces)
    assert "±50\xa0N" in found.text
    assert shares
    assert sum(len(patch.faces) for patch in found.by_cable) == len(space.surface.faces)
    assert {patch.color for patch in found.by_cable} <= {cable_color(k) for k in range(-1, 8)}
    assert sum(len(patch.faces) for patch in found.by_margin(MarginScale(10.0))) == len(space.surface.faces)


def test_an_empty_hull_names_the_nearest_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workspace, "CELLS", 6)
    asked = WorkspaceQuery(ROBOT, LEVEL, sl.Catenary(), sl.WrenchBox(1e5))
    found = region_hull(asked, False, lambda *_: None)
    assert found.by_cable == []
    assert "empty" in found.text
    assert "are missing" in found.text
    assert "coarse" in region_hull(asked, True, lambda *_: None).text


@extended
def test_a_small_region_is_computed_on_a_finer_grid() -> None:
    robot = sl.load_robot("fast")
    asked = WorkspaceQuery(robot, LEVEL, sl.Catenary(), sl.WrenchBox())
    found, region = region_hull(asked, False, lambda *_: None), region_in(asked, rough=False)
    cell = (region.high - region.low) / region.cells
    own = np.ptp(found.vertices, axis=0)
    assert np.prod(own) < 0.1 * np.prod(region.high - region.low)  # little of the robot's box
    assert found.longest < 0.8 * np.linalg.norm(cell)
    around = sl.PoseBox(found.vertices.min(axis=0) - cell, found.vertices.max(axis=0) + cell)
    space = sl.workspace(robot, around, cells=40)
    told = re.search(r"Region</b> ([\d,]+)", found.text)
    assert told is not None
    assert float(told[1].replace(",", "")) == pytest.approx(space.volume, rel=0.03)
    assert not found.on_box.any()
    assert "goes on" not in found.text


@extended
@pytest.mark.parametrize(
    "name", ["cogiro", *(pytest.param(one, marks=pytest.mark.soak) for one in ("falcon-7", "fast"))]
)
def test_a_region_takes_half_a_second(name: str) -> None:
    robot = sl.load_robot(name)
    asked = WorkspaceQuery(robot.replace(mass=1.1 * robot.mass), LEVEL, sl.Catenary(), sl.WrenchBox())
    assert np.prod(np.array(region_in(asked, rough=False).cells)) > 0.9 * 30**3

    def work() -> None:
        for rough in (True, False):
            region_hull(asked, rough, lambda *_: None)

    region_hull(asked, True, lambda *_: None)  # what is loaded on first use
    assert least_seconds(work, 0.5) <= 0.5
