"""The forces on the platform, one by one: what must close head to tail where it is in balance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.cable_colors import NONE, Color, cable_color

WEIGHT, LOAD, MISSING = "weight", "load", "missing"
WEIGHT_COLOR: Color = NONE
LOAD_COLOR: Color = (120, 112, 104)
MISSING_COLOR: Color = (220, 56, 48)


@dataclass(frozen=True, slots=True, eq=False)
class Pull:
    """A force on the platform.

    Attributes:
        name: Number of its cable, or "weight", "load" or "missing".
        color: Of its cable, or its own.
        force: World axes [N], shape (3,).
        moment: About the center of mass, world axes [N m], shape (3,).
        at: Where it acts [m], shape (3,).
    """

    name: str
    color: Color
    force: Array
    moment: Array
    at: Array


def cable_forces(state: Equilibrium) -> Array:
    """What the cables pull the platform with, at their ends as they hang there [N], shape (m, 3).

    Args:
        state: A single pose.
    """
    back = (state.exit_point - state.pose.transform(state.one_robot.platform_anchors))[:, :2]
    far = np.linalg.norm(back, axis=1, keepdims=True)
    level = np.divide(back, far, out=np.zeros_like(back), where=far > 0.0)
    cables = state.cables
    return np.column_stack((level * cables.horizontal_tension[:, None], -cables.vertical_force))


def pulls_of(state: Equilibrium, missing: Array | None = None) -> tuple[Pull, ...]:
    """All forces on a platform: of its cables, going around, then weight, load, and what is missing.

    Args:
        state: A single pose, in balance with what is missing.
        missing: A wrench that the state has and nobody gives, shape (6,); None for none.
    """
    robot, pose = state.one_robot, state.pose
    center = pose.transform(robot.center_of_mass)
    ends = pose.transform(robot.platform_anchors)
    forces = cable_forces(state)
    order = np.argsort(np.arctan2(forces[:, 1], forces[:, 0]), kind="stable")
    pulls = [
        Pull(str(k), cable_color(int(k)), forces[k], np.cross(ends[k] - center, forces[k]), ends[k]) for k in order
    ]
    pulls.append(Pull(WEIGHT, WEIGHT_COLOR, np.array([0.0, 0.0, -robot.mass * robot.gravity]), np.zeros(3), center))
    lacking = np.zeros(6) if missing is None else missing
    for name, color, wrench in ((LOAD, LOAD_COLOR, state.wrench - lacking), (MISSING, MISSING_COLOR, lacking)):
        if np.linalg.norm(wrench) > 0.0:
            pulls.append(Pull(name, color, wrench[:3], wrench[3:], center))
    return tuple(pulls)


def residual(state: Equilibrium, pulls: tuple[Pull, ...]) -> tuple[float, float]:
    """What the forces do not add up to along the platform's free motions: force [N] and moment [N m].

    Args:
        state: The pose.
        pulls: All forces.
    """
    whole = np.concatenate((sum(each.force for each in pulls), sum(each.moment for each in pulls)))
    freedom = state.one_robot.freedom
    rest = freedom.T @ (freedom @ whole)
    return float(np.linalg.norm(rest[:3])), float(np.linalg.norm(rest[3:]))


def turns(state: Equilibrium) -> bool:
    """Whether the platform can turn, so that moments have to balance too."""
    return bool(np.abs(state.one_robot.freedom[:, 3:]).max() > 0.0)
