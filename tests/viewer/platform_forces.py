"""Forces on the platform from the shapes of the cables only: slopes at the platform by finite differences."""

import numpy as np

import sagline as sl

SIDE = np.array([147 / 60, -6.0, 15 / 2, -20 / 3, 15 / 4, -6 / 5, 1 / 6])  # sixth order, at the end of equal steps
POINTS = 801


def pulled(state: sl.Equilibrium) -> np.ndarray:
    """Forces of the cables on the platform in world axes [N], shape (m, 3)."""
    profile = state.cables.points(POINTS)
    slope = -np.einsum("k,ikj->ij", SIDE, profile[:, ::-1][:, : SIDE.size])  # toward the frame, along and up
    ends = state.pose.transform(state.robot.platform_anchors)  # type: ignore[union-attr]
    back = (state.exit_point - ends)[:, :2]
    level = back / np.maximum(np.linalg.norm(back, axis=1, keepdims=True), 1e-300)
    horizontal = state.cables.horizontal_tension
    return np.column_stack((level * horizontal[:, None], horizontal * slope[:, 1] / np.abs(slope[:, 0])))


def unbalanced(state: sl.Equilibrium) -> tuple[float, float]:
    """Residual about the center of mass: force [N] and moment [N m]."""
    robot = state.robot
    assert isinstance(robot, sl.Robot)
    force = pulled(state)
    arm = state.pose.rotation.apply(robot.platform_anchors - robot.center_of_mass)
    whole = force.sum(axis=0) + state.wrench[:3] + [0.0, 0.0, -robot.mass * robot.gravity]
    turning = np.cross(arm, force).sum(axis=0) + state.wrench[3:]
    return float(np.linalg.norm(whole)), float(np.linalg.norm(turning))
