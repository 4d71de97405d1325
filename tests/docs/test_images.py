"""docs/images: each picture shows the present page or figure, is small, and is on a page (tools/pages/images.py)."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

import sagline as sl
from sagline.viewer.page import Page
from sagline.viewer.server import PageServer
from tools.pages import images
from tools.pages.images import FILM, FOLDER, GROUPS, description_of, viewer_of_pose, viewer_texts

ROOT = Path(__file__).parents[2]
LARGEST, FILM_LARGEST, ALL = 300_000, 1_000_000, 3_000_000  # bytes
FILES = sorted(FOLDER.iterdir())
RENEW = "renew the pictures: python -m tools.pages.images"


@pytest.mark.parametrize("group", [name for name in GROUPS if name != "position-error"])
def test_a_picture_is_not_older_than_its_controls(group: str) -> None:
    names, describe, _ = GROUPS[group]
    present = json.loads(json.dumps(describe()))
    for name in names:
        assert description_of(FOLDER / name) == present, f"{RENEW} {group}"


def test_the_figure_has_the_present_position_errors() -> None:
    plotted = images.plotted_errors()
    stored: dict[str, Any] = description_of(FOLDER / "position-error.png")
    assert stored.keys() == plotted.keys()
    for robot, errors in plotted.items():
        assert stored[robot] == [pytest.approx(row, abs=0.011) for row in errors], f"{RENEW} position-error"  # [mm]


def test_a_new_control_invalidates_a_picture() -> None:
    def with_a_button(server: PageServer) -> Page:
        page = viewer_of_pose(server)
        server.gui.add_button("Another control")
        return page

    assert viewer_texts(with_a_button) != viewer_texts(viewer_of_pose)


def test_every_picture_is_made_by_the_command_and_small() -> None:
    assert [file.name for file in FILES] == sorted(name for names, _, _ in GROUPS.values() for name in names)
    sizes = {file.name: file.stat().st_size for file in FILES}
    assert not {name for name, size in sizes.items() if size > (FILM_LARGEST if "drag" in name else LARGEST)}
    pictures = [*ROOT.glob("**/*.png"), *ROOT.glob("**/*.webp"), *ROOT.glob("**/*.gif")]
    mine = [file for file in pictures if file.relative_to(ROOT).parts[0] in ("docs", "src", "examples", "tests")]
    assert sum(file.stat().st_size for file in mine) < ALL


def test_the_film_takes_ten_seconds_and_repeats() -> None:
    with Image.open(FOLDER / "drag.webp") as film:
        pictures = int(getattr(film, "n_frames", 1))
        film.load()
        duration = float(film.info["duration"])
        assert film.info["loop"] == 0
    assert pictures * duration == pytest.approx(1e3 * FILM)


def test_every_picture_is_on_a_page_and_every_page_has_its_pictures() -> None:
    texts = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "tools" / "pages").glob("*.py")]
    texts += (ROOT / "docs" / "hooks").glob("*.py")
    used = set(re.findall(r"([\w-]+\.(?:png|webp))", "".join(file.read_text(encoding="utf-8") for file in texts)))
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.findall(r"docs/images/([\w.-]+)", readme)
    assert {file.name for file in FILES} <= used
    assert all((FOLDER / name).is_file() for name in shown)
    assert {name.replace("-dark", "") for name in shown if "-dark" in name} <= set(shown)


def test_the_platform_of_the_film_leaves_the_region_and_returns() -> None:
    robot = sl.load_robot("article-mixed")
    feasible = [bool(sl.inverse(robot, place).feasible) for place in images.STATIONS]
    assert feasible.count(False) == 1
    assert images.STATIONS[0] == images.STATIONS[-1]
