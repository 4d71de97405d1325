"""Uncertainty of a plan, compared with differences and a Monte Carlo simulation of perturbed robots."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import qmc

import sagline as sl
from sagline.core.arrays import Array
from tests.calibration.machines import robots
from tests.refusal import refused
from tests.tiers import extended, wide

WRENCH = np.array([20.0, -15.0, 10.0, 8.0, -6.0, 12.0])
TOLERANCES: dict[str, Any] = {
    "frame_anchors": [1e-3, 2e-3, 5e-4],
    "platform_anchors": 5e-4,
    "length_zero": 1e-3,
    "linear_density": 1e-3,
    "axial_stiffness": 1e3,
    "mass": 0.5,
    "center_of_mass": [2e-3, 1e-3, 3e-3],
}
OVER_PULLEYS = {"pulley_radius": 2e-4, "dead_cable": 2e-3, "load_cell_gain": 0.02}

WITH: dict[str, dict[str, Any]] = {
    "cogiro": {},
    "pulleys": OVER_PULLEYS,
    "slanted": OVER_PULLEYS,
    "layers": {**OVER_PULLEYS, "drum_radius": 2e-5},
    "drums": {},
    "planar": {},
    "article-suspended": {},
}


def plan_of(name: str, share: float = 1.0) -> sl.Plan:
    """A plan at a pose off the middle, with an external moment; share: factor of the tolerances."""
    given = {**TOLERANCES, **WITH[name]}
    robot = robots()[name].replace(tolerances={key: share * np.array(size) for key, size in given.items()})
    if robot.winches is not None and robot.winches.counts_per_turn is not None:  # rounding would change the lengths
        robot = robot.replace(winches=robot.winches.replace(counts_per_turn=1e9))
    place = ((0.4, 0.0, -0.3), (0.0, 0.1, 0.0)) if name == "planar" else ((0.8, 0.4, 1.6), (0.0, 0.0, 0.0))
    pose = sl.Pose(place[0], Rotation.from_rotvec(place[1]))
    plan = sl.inverse(robot, pose, wrench=0.01 * WRENCH if name == "planar" else WRENCH, tension=sl.MinimumNorm())
    assert plan.solved
    return plan


def changed(robot: sl.Robot, changes: dict[str, Array]) -> sl.Robot:
    """The robot with `changes` added to its quantities."""
    own: dict[str, dict[str, Array]] = {"cables": {}, "winches": {}, "": {}}
    for name, more in changes.items():
        part = next(part for part in own if hasattr(getattr(robot, part) if part else robot, name))
        own[part][name] = getattr(getattr(robot, part) if part else robot, name) + more
    cables = robot.cables.replace(**own["cables"])
    winches = None if robot.winches is None else robot.winches.replace(**own["winches"])
    return robot.replace(cables=cables, winches=winches, **own[""])


class Perturbed:
    """Equilibria of robots that deviate from the robot of a plan, at the same counts or reported lengths."""

    def __init__(self, plan: sl.Plan) -> None:
        self.state, self.robot = plan.state, plan.state.one_robot
        winches = self.robot.winches
        self.counted = winches is not None and winches.drum_radius is not None
        self.counts = sl.encoder_counts(plan) if self.counted else None

    def lengths(self, robot: sl.Robot, zero: Array | float) -> Array:
        """Lengths that the winches of the perturbed robot pay out."""
        if self.counts is None:
            return np.asarray(self.state.unstrained_length + zero)
        return sl.lengths_from_counts(robot, self.counts)

    def solve(self, changes: list[dict[str, Array]]) -> sl.ForwardSolution:
        """Forward solutions of robots with the given changes of their quantities."""
        made, lengths = [], []
        for change in changes:
            made.append(changed(self.robot, {name: more for name, more in change.items() if self._has(name)}))
            lengths.append(self.lengths(made[-1], 0.0 if self.counted else change.get("length_zero", 0.0)))
        found = sl.forward(made, lengths, self.state.pose, self.state.cables.model, self.state.wrench)
        assert found.stable.all()
        return found

    def _has(self, name: str) -> bool:
        return name != "length_zero" or self.counted

    def errors(self, found: sl.ForwardSolution) -> Array:
        """Errors of position, rotation vector and frame-end tensions, (N, 6 + m)."""
        pose, tension = self.state.pose, found.state.cables.frame_end_tension
        turn = (found.pose.rotation * pose.rotation.inv()).as_rotvec()
        return np.hstack((found.pose.position - pose.position, turn, tension - self.state.cables.frame_end_tension))


def single_changes(tolerances: Any, name: str) -> Iterator[dict[str, Array]]:
    """One change for each number of a quantity: its tolerance, and zero for the other numbers."""
    sizes = np.asarray(tolerances[name])
    for k in range(sizes.size):
        change = np.zeros(sizes.size)
        change[k] = sizes.flat[k]
        yield {name: change.reshape(sizes.shape)}


@pytest.mark.parametrize("name", wide(WITH, first=2))
def test_variances_are_the_squares_of_central_differences(name: str) -> None:
    plan = plan_of(name)
    found, perturbed, h = plan.uncertainty(), Perturbed(plan), 0.005
    tolerances, whole = perturbed.robot.tolerances, np.zeros((6, 6))
    assert set(found.names) == set(tolerances) - {"load_cell_gain"}
    for k, quantity in enumerate(found.names):
        steps = list(single_changes(tolerances, quantity))
        ends = [{q: sign * h * c for q, c in step.items()} for sign in (1.0, -1.0) for step in steps]
        errors = perturbed.errors(perturbed.solve(ends))
        slopes = (errors[: len(steps)] - errors[len(steps) :]) / (2.0 * h)
        variance = (slopes**2).sum(axis=0)
        size = (variance[:3].max(), variance[3:6].max(), variance[6:].max())
        for part, expected, atol in (
            (found.pose_variance[:3, k], variance[:3], size[0]),
            (found.pose_variance[3:, k], variance[3:6], size[1]),
            (found.tension_variance[:, k], variance[6:], size[2]),
        ):
            np.testing.assert_allclose(part, expected, rtol=3e-5, atol=1e-6 * atol, err_msg=quantity)
        whole += slopes[:, :6].T @ slopes[:, :6]
    np.testing.assert_allclose(found.covariance, whole, rtol=3e-5, atol=1e-6 * np.abs(whole).max())


@extended
@pytest.mark.parametrize("name", ["cogiro", "pulleys", "drums"])
def test_a_monte_carlo_simulation_agrees_to_one_percent(name: str) -> None:
    plan = plan_of(name, share=0.1)  # larger errors make cables of minimum-norm tensions slack
    found, perturbed = plan.uncertainty(), Perturbed(plan)
    sizes = {quantity: perturbed.robot.tolerances[quantity] for quantity in found.names}
    total = sum(size.size for size in sizes.values())
    points = qmc.MultivariateNormalQMC(np.zeros(total), seed=3).random(1 << 13)
    splits = np.cumsum([size.size for size in sizes.values()])[:-1]
    changes = [
        {
            q: part.reshape(size.shape) * size
            for (q, size), part in zip(sizes.items(), np.split(row, splits), strict=True)
        }
        for row in points
    ]
    spread = np.std(perturbed.errors(perturbed.solve(changes)), axis=0)
    expected = np.sqrt(np.concatenate((np.diagonal(found.covariance), found.tension**2)))
    np.testing.assert_allclose(spread, expected, rtol=0.01)
    np.testing.assert_allclose(np.linalg.norm(spread[:3]), found.position, rtol=0.01)


def test_sources_and_sums_of_a_path() -> None:
    robot = sl.load_robot("cogiro").replace(tolerances={"mass": 1e-6, "frame_anchors": 1e-3})
    path = sl.quintic_path([(0, 0, 1), (0, 0, 40)], durations=1.0, rate=10)
    plan = sl.inverse(robot, path)
    found, solved = plan.uncertainty(), plan.solved
    assert solved.any()
    assert not solved.all()
    assert (found.position_source == np.where(solved, "frame_anchors", "")).all()
    assert (found.tension_source == found.position_source).all()
    trace = np.trace(found.covariance[:, :3, :3], axis1=1, axis2=2)
    np.testing.assert_allclose(found.position, np.sqrt(trace), rtol=1e-12)
    assert (np.isnan(found.tension).any(axis=1) == ~solved).all()
    one = sl.inverse(robot, path.pose[0]).uncertainty()
    np.testing.assert_allclose(found.covariance[0], one.covariance, rtol=1e-9)
    assert found.table()["position"][0] == found.position[0]


def test_standard_errors_of_a_calibration_replace_larger_tolerances(tmp_path: Path) -> None:
    robot = sl.load_robot("cogiro").replace(tolerances={"frame_anchors": 4e-3})
    file, found = tmp_path / "known.yaml", "{log: l, date: 2026-01-01, standard_error: {frame_anchors: 1 mm}}"
    file.write_text(f"{sl.dump_robot(robot)}\ncalibration: {found}\n", encoding="utf-8")
    known = sl.load_robot(file)
    before, after = (sl.inverse(one, (0, 0, 2)).uncertainty().position for one in (robot, known))
    np.testing.assert_allclose(after, 0.25 * before, rtol=1e-12)


def test_plans_without_an_uncertainty() -> None:
    robot = sl.load_robot("cogiro")
    with refused("robot: tolerances", "not given"):
        sl.inverse(robot, (0, 0, 2)).uncertainty()
    with refused("tolerances: mass", "inf", "finite for an uncertainty"):
        sl.inverse(robot.replace(tolerances={"mass": np.inf}), (0, 0, 2)).uncertainty()
    known = robot.replace(tolerances={"mass": 1.0})
    with refused("model", "Parabolic"):
        sl.inverse(known, (0, 0, 2), model=sl.Parabolic()).uncertainty()
    with refused("unknown: drum_radius"):
        sl.inverse(robot.replace(tolerances={"drum_radius": 1e-4}), (0, 0, 2)).uncertainty()
