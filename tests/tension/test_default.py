"""One default tension distribution method for all functions and commands; README gives the numbers of both."""

from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.tension.methods import DEFAULT

README = Path(__file__).parents[2] / "README.md"


@pytest.mark.parametrize("function", [sl.inverse, sl.frequency_map, sl.export_c])
def test_functions_along_paths_have_the_default(function: Any) -> None:
    assert signature(function).parameters["tension"].default is DEFAULT


@pytest.mark.parametrize("function", [sl.workspace, sl.sweep.Request])
def test_functions_of_poses_have_the_default_of_poses(function: Any) -> None:
    assert signature(function).parameters["tension"].default == DEFAULT.alone


def test_a_pose_has_the_tensions_of_the_minimum_norm() -> None:
    robot, here = sl.load_robot("cogiro"), (1.0, 1.0, 2.0)
    assert isinstance(DEFAULT.alone, sl.MinimumNorm)
    expected = sl.inverse(robot, here, tension="minimum-norm").chord_tension
    np.testing.assert_array_equal(sl.inverse(robot, here).chord_tension, expected)
    solver = sl.InverseSolver(robot).step(here, (0, 0, 0, 1))
    np.testing.assert_allclose(solver.chord_tension, expected, rtol=1e-12)


def test_the_readme_has_the_largest_tension_of_the_default_and_of_the_article() -> None:
    robot, path, text = sl.load_robot("article-mixed"), sl.article_path(), README.read_text(encoding="utf-8")
    row = next(line for line in text.splitlines() if line.startswith("| chord tension [N]"))
    article = sl.inverse(robot, path, "empirical", sl.MinimumNorm("horizontal"), stability=False).chord_tension
    own = sl.inverse(robot, path, "empirical", stability=False).chord_tension
    assert row.split("|")[4].strip() == f"{article.min():.1f} – {article.max():.1f}"
    assert f"{own.min():.1f} – {own.max():.1f} N" in text
