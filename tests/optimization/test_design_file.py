"""Design files contain the arguments of `design`, and errors are reported with their key."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import FileError
from tests.refusal import refused
from tests.tiers import extended

WHOLE = """\
free:
  - frame_anchors: {low: [-1, -100 cm, 0], high: [1, 1, 500 mm], symmetry: xy, cables: [0, 1]}
  - platform_anchors: {along: [[0, 0, 2]], low: -5 cm, high: 5 cm}
  - tension_max: {low: 500 N, high: 3 kN}
  - tension_min: {low: 1, high: 20 N, cables: [2]}
  - cable:
      - {name: 4 mm, linear_density: 10 g/m, axial_stiffness: 300 kN, cost: 2.5}
      - {name: 6 mm, linear_density: 22 g/m, axial_stiffness: 700 kN, cost: 4, tension_max: 5 kN, diameter: 6 mm}
goals:
  - workspace_share
  - {minimize: cable_cost, weight: 0.5}
  - {maximize: least_stiffness, scale: 10 kN/m}
wrenches: {force: [50 N, 50, 0.1 kN], moment: 5 N*m, center: [0, 0, -20 N, 0, 1, 100 N*cm], accelerations: {linear: 1}}
box: {low: [-2, -1, 100 cm], high: [2, 1, 2]}
grid: [3, 2, 1]
inner:
  - frame_anchors: {along: [0, 0, 1], low: -1, high: 1, symmetry: together}
robust: {deviation: 1 cm, samples: 3, take: mean, seed: 5}
optimizer: differential_evolution
evaluations: 99
seed: 7
"""


def loaded(tmp_path: Path, text: str) -> dict[str, Any]:
    (tmp_path / "design.yaml").write_text(text)
    return sl.load_design(tmp_path / "design.yaml")


def test_every_key_is_converted_to_si(tmp_path: Path) -> None:
    asked = loaded(tmp_path, WHOLE)
    box, platform, largest, least, cable = asked["free"]
    np.testing.assert_allclose(box.low, [-1.0, -1.0, 0.0])
    np.testing.assert_allclose(box.high, [1.0, 1.0, 0.5])
    assert (box.end, box.symmetry, box.cables) == ("frame", "xy", (0, 1))
    assert (platform.end, platform.high.tolist(), platform.along.tolist()) == ("platform", [0.05], [[0.0, 0.0, 1.0]])
    assert (largest.which, largest.low, largest.high) == ("tension_max", 500.0, 3000.0)
    assert (least.which, least.low, least.high, least.cables) == ("tension_min", 1.0, 20.0, (2,))
    thin, thick = cable.catalogue
    assert (thin.name, thin.cost, thin.tension_max) == ("4 mm", 2.5, None)
    assert (float(thin.cable.linear_density), float(thin.cable.axial_stiffness)) == (0.01, 3e5)
    assert (thick.tension_max, float(thick.cable.diameter)) == (5000.0, 0.006)
    goals = [(goal.kind, goal.maximize, goal.weight, goal.scale) for goal in asked["goals"]]
    assert goals == [
        ("workspace_share", True, 1.0, None),
        ("cable_cost", False, 0.5, None),
        ("least_stiffness", True, 1.0, 1e4),
    ]
    expected = sl.WrenchBox([50, 50, 100], 5.0, [0, 0, -20, 0, 1, 1]) + sl.Accelerations(linear=1.0, angular=0.0)
    for name in ("center", "segments", "accelerations"):
        np.testing.assert_allclose(getattr(asked["wrenches"], name), getattr(expected, name))
    assert asked["box"].low.tolist() == [-2.0, -1.0, 1.0]
    assert asked["grid"] == (3, 2, 1)
    assert asked["inner"][0].symmetry == "together"
    robust = asked["robust"]
    assert (robust.deviation, robust.samples, robust.take, robust.seed) == (0.01, 3, "mean", 5)
    assert (asked["optimizer"], asked["evaluations"], asked["seed"]) == ("differential_evolution", 99, 7)


def test_omitted_keys_have_the_defaults_of_design(tmp_path: Path) -> None:
    asked = loaded(tmp_path, "free: [{tension_max: {low: 1, high: 1 kN}}]\ngoals: [least_margin]\n")
    assert sorted(asked) == ["evaluations", "free", "goals", "optimizer", "seed"]
    assert (asked["evaluations"], asked["optimizer"], asked["seed"]) == (600, "cma", 0)


HEAD, GOALS = "free: [{tension_max: {low: 1, high: 9}}]\n", "goals: [least_margin]\n"
NUMBER = 'a number in {0}, or text with a unit that converts to it, such as "1.5 {0}"'
FREE = "frame_anchors, platform_anchors, tension_min, tension_max, cable"
GOAL_NAMES = "workspace_share, mean_margin, least_margin, largest_tension, largest_sag, least_stiffness, cable_cost"
KEYS = "free, goals, wrenches, box, grid, inner, robust, optimizer, evaluations, seed"
WRONG: dict[str, tuple[str, tuple[str, ...]]] = {
    "low: 5 kg": (
        "free: [{tension_max: {low: 5 kg, high: 1 kN}}]\n" + GOALS,
        (
            "free[0].tension_max: low",
            "'5 kg'",
            NUMBER.format("N"),
        ),
    ),
    "anchors in seconds": (
        "free: [{frame_anchors: {low: 0, high: [1 s, 1, 1]}}]\n" + GOALS,
        (
            "free[0].frame_anchors: high[0]",
            "'1 s'",
            NUMBER.format("m"),
        ),
    ),
    "crossed": (
        "free: [{frame_anchors: {low: 1, high: 0}}]\n" + GOALS,
        ("free[0].frame_anchors: low[0]", "1 m", "<= high[0], 0 m"),
    ),
    "no goal of that name": (HEAD + "goals: [volume]\n", ("goals[0]: goal", "'volume'", GOAL_NAMES)),
    "two ways": (
        HEAD + "goals: [{maximize: least_margin, minimize: cable_cost}]\n",
        ("goals[0]: name", "given by maximize and minimize", "one of goal, maximize, minimize"),
    ),
    "two in one": (
        "free: [{tension_max: {low: 1, high: 9}, tension_min: {low: 1, high: 9}}]\n" + GOALS,
        ("free[0]", "of tension_min and tension_max", f"one of {FREE}"),
    ),
    "unknown key": (HEAD + GOALS + "optimiser: cma\n", ("optimiser", "an unknown key", KEYS)),
    "missing": (HEAD, ("goals", "missing")),
    "a key inside": ("free: [{frame_anchor: {low: 1}}]\n" + GOALS, ("free[0].frame_anchor", "an unknown key", FREE)),
    "a word for a number": (HEAD + GOALS + "evaluations: many\n", ("evaluations", "'many'", "a valid integer")),
    "wrenches in kg": (
        HEAD + GOALS + "wrenches: {force: 5 kg}\n",
        ("wrenches: force", "'5 kg'", NUMBER.format("N")),
    ),
    "a box upside down": (
        HEAD + GOALS + "box: {low: [0, 0, 2], high: [1, 1, 1]}\n",
        ("box: high[2]", "1 m", ">= low, 2 m"),
    ),
    "a catalogue of one": (
        "free: [{cable: [{name: a, linear_density: 1 g/m, axial_stiffness: 1 kN}]}]\n" + GOALS,
        ("free[0].cable: catalogue", "[a CableChoice]", "at least two cables"),
    ),
    "a cable without weight": (
        "free: [{cable: [{name: a, linear_density: -1 g/m, axial_stiffness: 1 kN}]}]\n" + GOALS,
        ("free[0].cable[0]: linear_density", "-0.001 kg/m", ">= 0 kg/m, finite"),
    ),
    "errors of no length": (HEAD + GOALS + "robust: {deviation: 0}\n", ("robust: deviation", "0 m", "> 0 m, finite")),
}


@pytest.mark.parametrize("name", WRONG)
def test_errors_are_reported_with_their_key(tmp_path: Path, name: str) -> None:
    text, parts = WRONG[name]
    with refused(*parts, kind=FileError, file=tmp_path / "design.yaml") as caught:
        loaded(tmp_path, text)
    told = str(caught.value)
    assert len(told) < 300
    assert "\n" not in told


@extended
def test_the_example_is_valid(tmp_path: Path) -> None:
    examples = Path(__file__).parents[2] / "examples"
    robot, asked = sl.load_robot(examples / "own_robot.yaml"), sl.load_design(examples / "design.yaml")
    front = sl.design(robot, **asked)
    assert front.better
