"""Statuses, residuals, tensions and lengths of random poses of every preset, by cable model and tension method."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from tests.record.values import rounded

COUNT: Final = 200  # poses of every preset
TILT: Final = 0.2  # rad, largest rotation
MODELS: Final = (sl.Catenary(), sl.Elastic(), sl.Straight(), sl.Parabolic(), sl.Empirical())
METHODS: Final = (
    sl.Closest(),
    sl.MinimumNorm(),
    sl.QuadraticProgram(),
    sl.ClosedForm(),
    sl.ImprovedClosedForm(),
    sl.Puncture(),
    sl.LowestSum(),
    sl.LowestMaximum(),
    sl.PNorm(),
    sl.Centroid(),
    sl.AnalyticCenter(),
    sl.PolygonWalk(),
)


def record() -> dict[str, Any]:
    """A nested dictionary: preset, then `model method`, then the values of the poses."""
    found: dict[str, Any] = {}
    for k, name in enumerate(sl.robot_names()):
        robot = sl.load_robot(name)
        poses = random_poses(robot, np.random.default_rng(20261123 + k))
        solved = {
            f"{_name(model)} {_name(method)}": _inverse(robot, poses, model, method)
            for model in MODELS
            for method in METHODS
        }
        found[name] = solved | {"forward": _forward(robot, poses), "margin": _margin(robot, poses)}
    return found


def random_poses(robot: sl.Robot, random: np.random.Generator) -> sl.Pose:
    """Poses in the box that the frame anchors span, slightly tilted."""
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    position = random.uniform(low + 0.2 * (high - low), high - 0.2 * (high - low), size=(COUNT, 3))
    turn = random.uniform(-TILT, TILT, size=(COUNT, 3))
    return sl.Pose(position, Rotation.from_rotvec(turn).as_matrix())


def _inverse(robot: sl.Robot, poses: sl.Pose, model: sl.CableModel, method: sl.TensionMethod) -> Any:
    try:
        plan = sl.inverse(robot, poses, model, method)
    except sl.InvalidValueError as error:
        return {"refused": error.item}
    solved = plan.feasible
    found: dict[str, Any] = {"status": _codes(plan.status)}
    if solved.any():
        found |= {
            "residual": rounded(plan.wrench_residual[solved].max()),
            "tension": _statistics(plan.chord_tension[solved]),
            "length": _statistics(plan.unstrained_length[solved]),
        }
    if not solved.all():
        found["shortfall"] = _statistics(plan.shortfall[~solved])
    return found


def _forward(robot: sl.Robot, poses: sl.Pose) -> Any:
    """Forward solutions of the lengths of the default plan."""
    plan = sl.inverse(robot, poses)
    if not plan.feasible.any():
        return {}
    proof = sl.confirm(plan)
    error = proof.position_error[plan.feasible]
    return {
        "status": _codes(proof.status),
        "position_error": rounded(np.nanmax(np.linalg.norm(error, axis=-1))),
        "residual": rounded(np.nanmax(proof.wrench_residual[plan.feasible])),
    }


def _margin(robot: sl.Robot, poses: sl.Pose) -> Any:
    found = sl.margin(robot, poses)
    return {"status": _codes(found.status), "value": _statistics(found.value)}


def _statistics(values: Any) -> list[float]:
    """Smallest, mean and largest of the finite values."""
    finite = np.asarray(values)[np.isfinite(values)]
    return [rounded(value) for value in (finite.min(), finite.mean(), finite.max())] if finite.size else []


def _codes(statuses: Any) -> str:
    """Status codes in the order of the poses, a digit each; they are below 10."""
    return "".join(str(code) for code in np.asarray(statuses).tolist())


def _name(value: object) -> str:
    return type(value).__name__
