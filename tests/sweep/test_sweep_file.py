"""Sweep files with units, and invalid ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from tests.refusal import refused

WHOLE = """
robots: [cogiro, mine.yaml]
poses:
  grid:
    x: {low: -1 m, high: 1000 mm, count: 3}
    y: 25 cm
    z: {low: 1.5, high: 2, count: 2}
    alpha: {low: -10 deg, high: 10 deg, count: 2}
wrenches:
  grid:
    force_x: {low: -0.1 kN, high: 100 N, count: 3}
    moment_z: 5 N*m
around: {force: 20 N, moment: [1, 2 N*m, 300 N*cm]}
moment_arm: 30 cm
quantities: [margin, tension]
model: empirical
tension: analytic-center
"""


def written(folder: Path, text: str) -> Path:
    if "mine.yaml" in text:
        (folder / "mine.yaml").write_text(sl.dump_robot(sl.load_robot("ipanema-1").replace(name="mine")))
    (folder / "sweep.yaml").write_text(text)
    return folder / "sweep.yaml"


def test_every_key_with_its_unit(tmp_path: Path) -> None:
    found = sl.load_sweep(written(tmp_path, WHOLE))
    assert [robot.name for robot in found.robots] == [sl.load_robot("cogiro").name, "mine"]
    assert found.shape == (2, 12, 3)
    expected = [[x, 0.25, z] for x in (-1.0, 0.0, 1.0) for z in (1.5, 2.0) for _ in range(2)]
    np.testing.assert_allclose(found.poses.position, expected, rtol=1e-15)
    turned = sl.Pose.from_euler(found.poses.position, np.tile(np.radians([-10.0, 10.0]), 6), 0.0, 0.0)
    np.testing.assert_allclose(found.poses.quaternion, turned.quaternion, atol=1e-15)
    np.testing.assert_allclose(found.wrenches, [[force, 0, 0, 0, 0, 5] for force in (-100, 0, 100)], rtol=1e-15)
    np.testing.assert_allclose(found.around.segments.diagonal(), [20, 20, 20, 1, 2, 3], rtol=1e-15)
    assert found.moment_arm == pytest.approx(0.3)
    assert found.quantities == ("tension", "margin")
    assert isinstance(found.model, sl.Empirical)
    assert isinstance(found.tension, sl.AnalyticCenter)


def test_rows_paths_and_omitted_keys(tmp_path: Path) -> None:
    (tmp_path / "path.yaml").write_text(
        "durations: 1\nrate: 4\nwaypoints: [{position: [0, 0, 1]}, {position: [0, 0, 2]}]\n"
    )
    text = (
        "robots: cogiro\nposes: {path: path.yaml}\nwrenches: {rows: [[1 kN, 0, 0, 0, 0, 2 N*m], [0, 0, -5, 0, 0, 0]]}\n"
    )
    found = sl.load_sweep(written(tmp_path, text))
    np.testing.assert_array_equal(found.poses.position, sl.load_path(tmp_path / "path.yaml").pose.position)
    np.testing.assert_array_equal(found.wrenches, [[1000, 0, 0, 0, 0, 2], [0, 0, -5, 0, 0, 0]])
    alone = sl.load_sweep(written(tmp_path, "robots: cogiro\nposes: {grid: {x: 0, y: 0, z: 2}}\n"))
    np.testing.assert_array_equal(alone.wrenches, np.zeros((1, 6)))
    assert (alone.quantities, len(alone)) == (("tension",), 1)
    assert isinstance(alone.model, sl.Catenary)
    assert isinstance(alone.tension, sl.MinimumNorm)


METHODS = (
    *("closest", "minimum-norm", "quadratic-program", "lowest-sum", "lowest-maximum", "p-norm", "centroid"),
    *("analytic-center", "closed-form", "improved-closed-form", "puncture", "polygon-walk"),
)
GRID = "robots: cogiro\nposes: {grid: {x: %s, y: 0, z: 2}}\n"
HUGE = GRID.replace("y: 0", "y: {low: 0, high: 1, count: 1000000}") % "{low: 0, high: 1, count: 1000000}"
START = "robots: cogiro\nposes: {grid: {x: 0, y: 0, z: 2}}\n"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("poses: {grid: {x: 0, y: 0, z: 2}}\n", ("robots", "missing")),
        ("robots: []\nposes: {grid: {x: 0, y: 0, z: 2}}\n", ("robots", "empty")),
        ("robots: [3]\nposes: {grid: {x: 0, y: 0, z: 2}}\n", ("robots[0]", "3")),
        ("robots: cogero\nposes: {grid: {x: 0, y: 0, z: 2}}\n", ("robot", "'cogero'")),
        ("robots: cogiro\nposes: {}\n", ("poses", "not given")),
        ("robots: cogiro\nposes: {path: p.yaml, grid: {x: 0, y: 0, z: 2}}\n", ("poses", "given by grid and path")),
        ("robots: cogiro\nposes: {grid: {x: 0, y: 0}}\n", ("poses.grid.z", "missing")),
        ("robots: cogiro\nposes: {grid: {x: 0, y: 0, z: 2, w: 1}}\n", ("poses.grid.w", "an unknown key")),
        (GRID % "{low: 0, high: 1}", ("poses.grid.x", "given by 'low, high'")),
        (GRID % "{low: 0, high: 1, count: 0}", ("poses.grid.x.count", "0")),
        (GRID % "{low: 0, high: 1, count: 1}", ("poses.grid.x", "0 to 1 m")),
        (GRID % "{low: 1, high: 0, count: 3}", ("poses.grid.x", "1 to 0 m")),
        (GRID % "{low: 0, high: 1, count: 2.5}", ("poses.grid.x.count", "2.5")),
        (GRID % "{low: 0, high: 1, count: 1000000000}", ("poses.grid.x.count", "1000000000")),
        (HUGE, ("the memory for a grid of 1,000,000,000,000 points", "4e+05 GB")),
        (GRID % "1 kg", ("poses.grid.x", "'1 kg'")),
        (GRID % "inf", ("poses.grid.x", "inf m")),
        (GRID % "[1, 2]", ("poses.grid.x", "[1, 2]")),
        (START + "wrenches: {}\n", ("wrenches", "not given")),
        (START + "wrenches: {rows: []}\n", ("wrenches", "empty")),
        (START + "wrenches: {rows: [[1, 2]]}\n", ("wrenches.rows[0]", "[1, 2]")),
        (START + "wrenches: {rows: [[1, 2, 3, 4 N, 5, 6]]}\n", ("wrenches.rows[0]: moment_x", "'4 N'")),
        (START + "wrenches: {grid: {force_x: 3 N*m}}\n", ("wrenches.grid.force_x", "'3 N*m'")),
        (START + "around: {force: -1 N}\n", ("force", "-1 N")),
        (START + "moment_arm: -1\n", ("moment_arm", "-1 m")),
        (START + "quantities: [tensions]\n", ("quantities[0]", "'tensions'")),
        (START + "quantities: []\n", ("quantities", "empty")),
        (START + "quantities: [margin, margin]\n", ("quantities", "['margin', 'margin']")),
        (START + "model: catenery\n", ("model", "'catenery'", "straight, elastic, empirical, parabolic, catenary")),
        (START + "tension: minimum_norm\n", ("tension", "'minimum_norm'", ", ".join(METHODS))),
        (START + "workers: 3\n", ("workers", "an unknown key")),
    ],
)  # fmt: skip
def test_errors_are_reported_with_their_key(tmp_path: Path, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts) as error:
        sl.load_sweep(written(tmp_path, text))
    assert len(str(error.value)) < 300


def test_a_missing_robot_file_is_named(tmp_path: Path) -> None:
    with refused(kind=sl.FileError, file=tmp_path / "nothing.yaml"):
        sl.load_sweep(written(tmp_path, START.replace("cogiro", "nothing.yaml")))


def test_another_suffix_is_refused(tmp_path: Path) -> None:
    with refused("the suffix", ".csv", ".yaml, .yml", kind=sl.FileError):
        sl.load_sweep(tmp_path / "sweep.csv")
