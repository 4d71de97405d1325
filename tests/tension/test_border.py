"""Largest loads by verdicts compared with a nonlinear program in the tensions, and confirmed by forward."""

import numpy as np
import pytest
from scipy.optimize import minimize

from sagline import Catenary, MinimumNorm, PoseStatus, forward, inverse
from sagline.core.arrays import Array
from tests.tension.reference import BORDER_ROBOTS, Border, found_border, structure
from tests.tiers import wide

PRECISION = 1e-6  # of the weight


def largest_load(border: Border, i: int, start: Array) -> float:
    """By sequential quadratic programs over tensions and load; rows in weights, moments per lever arm."""
    robot, pose = border.robot, border.poses[i]
    m, weight = robot.cable_count, robot.mass * robot.gravity
    matrix = structure(robot, pose)
    lever = (robot.platform_anchors - robot.center_of_mass) @ pose.matrix.T
    hanging = np.stack(
        (0 * lever[:, 0], 0 * lever[:, 0], 1 + 0 * lever[:, 0], lever[:, 1], -lever[:, 0], 0 * lever[:, 0])
    )
    unit = np.where(np.arange(6) < 3, 1.0, 1 / np.abs(matrix[3:]).max()) / weight
    scaled = [robot.freedom @ (unit[:, None] * rows) for rows in (matrix, hanging, border.ways[i, :, None])]
    own = robot.freedom @ (unit * [0, 0, weight, 0, 0, 0])
    rope = pose.position + robot.platform_anchors @ pose.matrix.T - robot.frame_anchors
    span, rise = np.hypot(rope[:, 0], rope[:, 1]), rope[:, 2]

    def pull(tau: Array) -> Array:
        state = Catenary().from_tension(robot.cables, span, rise, tau, gravity=robot.gravity)
        return np.asarray(state.vertical_force - tau * rise / np.hypot(span, rise))

    def left(x: Array) -> Array:
        return np.asarray(scaled[0] @ x[:m] - scaled[1] @ pull(x[:m]) - own + scaled[2][:, 0] * x[m])

    def slopes(x: Array) -> Array:
        step = 1e-5 * x[:m]
        grows = (pull(x[:m] + step) - pull(x[:m] - step)) / (2 * step)
        return np.column_stack((scaled[0] - scaled[1] * grows, scaled[2]))

    high = np.minimum(robot.tension_max, 1e9)
    best = minimize(
        lambda x: -x[m] / weight,
        np.clip(start, np.append(robot.tension_min, 0), np.append(high, np.inf)),
        jac=lambda x: np.append(np.zeros(m), -1 / weight),
        constraints={"type": "eq", "fun": left, "jac": slopes},
        bounds=[*zip(robot.tension_min, high, strict=True), (0, None)],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return float(best.x[m]) if np.abs(left(best.x)).max() < 1e-9 else -np.inf


def check_border(name: str, count: int, seed: int) -> None:
    border = found_border(name, count, seed)
    robot, loads = border.robot, border.loads
    weight = robot.mass * robot.gravity
    wrench = border.ways * loads[:, None]
    plan = inverse(robot, border.poses, tension=MinimumNorm(), wrench=wrench)
    assert plan.feasible.all()
    tau = plan.chord_tension
    assert (tau >= robot.tension_min * (1 - 1e-12)).all()
    assert (tau <= robot.tension_max * (1 + 1e-12)).all()
    # forward with these lengths and this load gives the pose: feasible loads are held
    back = forward(robot, plan.unstrained_length, border.poses, wrench=wrench)
    assert np.abs(back.pose.position - border.poses.position).max() < 1e-6 * np.ptp(robot.frame_anchors)
    still = inverse(robot, border.poses, tension=MinimumNorm())
    for i in range(count):
        starts = [np.append(tau[i], loads[i]), np.append(still.chord_tension[i], 0.0)]
        best = max(largest_load(border, i, start) for start in starts)
        assert best <= loads[i] + PRECISION * weight  # no feasible load is refused
    # a load beyond by a millionth of the weight is refused or at the boundary, never feasible
    beyond = inverse(
        robot, border.poses, tension=MinimumNorm(), wrench=border.ways * (loads + PRECISION * weight)[:, None]
    )
    assert set(beyond.status) <= {PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE}
    clearly = inverse(robot, border.poses, tension=MinimumNorm(), wrench=border.ways * (loads + 1e-3 * weight)[:, None])
    assert (clearly.status == PoseStatus.INFEASIBLE).all()


@pytest.mark.parametrize("name", wide(BORDER_ROBOTS))
def test_the_largest_load_agrees_with_a_nonlinear_program(name: str) -> None:
    check_border(name, 12, 41)


@pytest.mark.soak
@pytest.mark.parametrize("name", BORDER_ROBOTS)
def test_two_hundred_largest_loads_agree_with_a_nonlinear_program(name: str) -> None:
    check_border(name, 200, 42)
