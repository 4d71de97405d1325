"""A robot in space, its cables hanging as they hang."""

from __future__ import annotations

from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.axes3d import Axes3D

from sagline.arguments import instance, optional
from sagline.errors import InvalidValueError
from sagline.kernels.cable import geometry
from sagline.kinematics.inverse import inverse
from sagline.plot.sheet import BLUE, LABEL, TICK, VERMILLION, sheet
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows

if TYPE_CHECKING:
    from sagline.arrays import Array

POINTS = 50  # along each cable
FRAME_COLOR = "0.6"


def robot(robot: Robot, pose: Pose | None = None, ax: Axes3D | None = None) -> Axes3D:
    """The robot in space at rest: frame, platform, and its cables as exact catenaries that carry it.

    Args:
        robot: The robot.
        pose: Where the platform is; None for the middle of the robot's test box. Where no tensions carry the platform
            the cables are straight and dashed.
        ax: Axes to draw on, made with `projection="3d"`; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If no pose is given and the robot has no test box, or the pose is a batch.
    """
    where = _pose_of(instance(robot, Robot, "robot"), optional(pose, Pose, "pose"))
    optional(ax, Axes3D, "ax")
    if ax is None:
        ax = sheet(height=4.0, width=5.6).add_subplot(projection="3d")
    lines, carried = _cable_lines(robot, where)
    for line in lines:
        ax.plot(*line.T, color=BLUE, linewidth=1.0, linestyle="-" if carried else (0, (3.0, 2.0)))
    if robot.frame_size is not None:
        top = robot.frame_anchors.max(axis=0)
        middle = 0.5 * (top + robot.frame_anchors.min(axis=0))
        middle[2] = top[2] - 0.5 * robot.frame_size[2]  # frames stand: their top is where the highest anchors are
        _draw_box(ax, _corners(middle, robot.frame_size), FRAME_COLOR, 0.7)
    ax.scatter(*robot.frame_anchors.T, color="black", s=8.0, depthshade=False)
    low, high = robot.platform_anchors.min(axis=0), robot.platform_anchors.max(axis=0)
    size = high - low if robot.platform_size is None else robot.platform_size
    _draw_box(ax, where.position + _corners(0.5 * (low + high), size) @ where.matrix.T, VERMILLION, 1.3)
    _dress(ax, robot.name if carried else f"{robot.name}: no tensions within the limits carry it here")
    return ax


def _pose_of(robot: Robot, pose: Pose | None) -> Pose:
    if pose is None and robot.test_box is not None:
        return Pose(0.5 * (robot.test_box.low + robot.test_box.high), np.eye(3))
    if pose is None or pose.shape:
        value = "missing" if pose is None else f"a batch of {len(pose)}"
        raise InvalidValueError("pose", value, "a single pose, where the robot has no test box", "Give one pose.")
    return pose


def _cable_lines(robot: Robot, pose: Pose) -> tuple[Array, bool]:
    """Points of the cables in the world [m], shape (m, POINTS, 3), and whether tensions carry the platform."""
    plan = inverse(robot, pose)
    tables = np.empty((1, geometry.GEOMETRY_ROWS, robot.cable_count))
    geometry.cable_geometries(cable_table(robot), body_table(robot), pose_rows(pose), np.empty((3, 3)), tables)
    table = tables[0]
    if plan.feasible:
        along, up = np.moveaxis(plan.state.cables.points(POINTS), -1, 0)
    else:
        share = np.linspace(0.0, 1.0, POINTS)
        along, up = (np.outer(table[row], share) for row in (geometry.SPAN, geometry.RISE))
    azimuth = table[[geometry.AZIMUTH_X, geometry.AZIMUTH_Y]]
    offsets = np.stack((azimuth[0, :, None] * along, azimuth[1, :, None] * along, up), axis=-1)
    return robot.frame_anchors[:, None] + offsets, bool(plan.feasible)


def _corners(middle: Array, size: Array) -> Array:
    """The eight corners of a box, shape (8, 3)."""
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    corners: Array = middle + 0.5 * size * signs
    return corners


def _draw_box(ax: Axes3D, corners: Array, color: str, width: float) -> None:
    """The twelve edges: between corners that differ in one direction."""
    signs = list(product((0, 1), repeat=3))
    for a, b in combinations(range(8), 2):
        if sum(p != q for p, q in zip(signs[a], signs[b], strict=True)) == 1:
            ax.plot(*corners[[a, b]].T, color=color, linewidth=width)


def _dress(ax: Axes3D, title: str) -> None:
    ax.set_title(title, fontsize=LABEL, y=0.93)
    for name, axis in zip("xyz", (ax.xaxis, ax.yaxis, ax.zaxis), strict=True):
        axis.set_label_text(f"${name}$ [m]", fontsize=LABEL)
        axis.set_tick_params(labelsize=TICK)
        axis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    ax.grid(visible=False)
    limits = (ax.get_xlim3d(), ax.get_ylim3d(), ax.get_zlim3d())
    ax.set_box_aspect([high - low for low, high in limits], zoom=0.95)
