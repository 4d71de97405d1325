"""Level functions of robots: the margin of the level platform."""

import numpy as np

import sagline as sl
from sagline.core.arrays import Array
from sagline.workspaces.margin import MarginRows
from tests.workspaces.shapes import Level


def level_of(robot: sl.Robot, model: sl.CableModel) -> Level:
    """Margin with no load except the weight [N]."""
    rows = MarginRows(robot, model=model)

    def level(positions: Array) -> Array:
        poses = np.zeros((len(positions), 7))
        poses[:, :3], poses[:, 6] = positions, 1.0
        return rows.rows(poses).value

    return level


def ipanema() -> tuple[sl.Robot, Array, Array]:
    """The robot of a published hull: tensions of 1 to 10 N, no gravity; and the box of its anchors."""
    robot = sl.load_robot("ipanema-1").replace(tension_min=1.0, tension_max=10.0, gravity=0.0)
    return robot, robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
