"""Numbers of docs/workspace.md, and of the first run in README, that no code block prints."""

import re
from pathlib import Path

import sagline as sl
from sagline.cli.article import CELLS, ROBOTS
from sagline.workspaces.boundary import boundary
from tests.tiers import extended
from tests.workspaces.levels import ipanema, level_of
from tests.workspaces.rays import ray_hull

pytestmark = extended

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "workspace.md").read_text(encoding="utf-8")
MODEL = " ".join((ROOT / "docs" / "model.md").read_text(encoding="utf-8").split())
README = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())


def row(name: str) -> str:
    found = re.search(rf"^\| {name}.*?\| (.*?) \|$", PAGE, re.MULTILINE)
    assert found is not None
    return found[1]


def test_rays_miss_the_printed_part_of_the_volume() -> None:
    robot, low, high = ipanema()
    level = level_of(robot, sl.Straight())
    rays = ray_hull(level, [0.0, 0.0, 1.0], low, high).volume
    whole = boundary(level, low, high, cells=32)
    by_rays, by_boundary = row("the same rays"), row("the boundary")
    assert by_rays == f"{rays:.3f}"
    assert by_boundary == f"{whole.volume:.3f} ± {whole.volume_error:.3f}"
    assert re.search(rf"\b{rays:.3f} m³; .*? {whole.volume:.3f} m³", MODEL)


def test_workspaces_of_both_robots_of_the_first_run() -> None:
    volumes = [sl.workspace(sl.load_robot(name), cells=CELLS).volume for name in ROBOTS]
    assert f"{volumes[0]:.0f} m³ and {volumes[1]:.0f} m³ inside" in README
