"""Robots with heavy cables, whose workspaces are compared with verdicts of the inverse at random positions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.core.arrays import Array
from sagline.workspaces.surface import normals_of
from sagline.workspaces.workspace import BY_BOX

BLOCK = 20_000  # positions per call
ASIDE = 1e-3  # [m], distance of the verdicts from the boundary
PRESETS = ("article-suspended", "article-mixed", "cogiro", "ipanema-1", "ipanema-3")


class Compared(NamedTuple):
    """A workspace and the verdicts of the inverse."""

    space: sl.Workspace
    volume: float  # by the share of feasible positions [m^3]
    deviation: float  # standard deviation of this volume [m^3]
    borderline: float  # volume of the positions without a verdict [m^3]
    open: float  # share of positions whose margin is open
    contradictions: int  # positions at which the status of the margin contradicts the verdict
    right: float  # share of vertices with the right verdicts inside and outside

    @property
    def away(self) -> float:
        """Difference of the volumes in error bars and two standard deviations."""
        beyond = max(abs(self.space.volume - self.volume) - self.borderline, 0.0)
        return beyond / (self.space.volume_error + 2.0 * self.deviation)


def with_density(name: str, density: float, **changes: object) -> sl.Robot:
    """A preset with cables of another mass per length [kg/m] and other changes."""
    robot = sl.load_robot(name)
    cables = sl.Cable(np.full(robot.cable_count, density), robot.cables.axial_stiffness)
    return robot.replace(cables=cables, **changes)


def three_robots() -> Iterator[tuple[str, sl.Robot]]:
    """Robots whose hulls by the middle of the range of sag forces are wrong by 3 to 10 %."""
    yield "article-suspended, 0.67 kg/m", with_density("article-suspended", 0.67)
    yield "cogiro, 0.3 kg/m", with_density("cogiro", 0.3, tension_limits_of="frame_end", tension_min=10.0)
    yield "article-mixed, 0.3 kg/m", with_density("article-mixed", 0.3, tension_limits_of="frame_end", tension_min=25.0)


def random_robots(count: int, seed: int) -> Iterator[tuple[str, sl.Robot]]:
    """Presets with cables of 0.1 to 0.7 kg/m, and limits of either tension."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        name, limited = str(rng.choice(PRESETS)), str(rng.choice(["chord", "frame_end"]))
        density, least = 10 ** rng.uniform(-1.0, -0.15), 10 ** rng.uniform(1.0, 1.7)
        made = with_density(name, density, tension_limits_of=limited, tension_min=least, tension_max=3000.0)
        yield f"{name}, {density:.2f} kg/m, {limited} {least:.0f} to 3000 N", made


def poses_at(positions: Array) -> sl.Pose:
    """Level poses at positions (N, 3) [m]."""
    return sl.Pose(positions, np.broadcast_to(np.eye(3), (len(positions), 3, 3)))


def compared(robot: sl.Robot, count: int, cells: int, rng: np.random.Generator) -> Compared:
    """Compare a workspace with the verdicts at random positions in its box, and beside its vertices."""
    space = sl.workspace(robot, cells=cells)
    size = float(np.prod(space.box.high - space.box.low))
    held = unknown = unsure = wrong = 0
    for first in range(0, count, BLOCK):
        poses = poses_at(rng.uniform(space.box.low, space.box.high, (min(BLOCK, count - first), 3)))
        plan, status = sl.inverse(robot, poses), sl.margin(robot, poses).status
        held += int(np.count_nonzero(plan.feasible))
        unknown += int(np.count_nonzero(plan.status == sl.PoseStatus.BORDERLINE))
        unsure += int(np.count_nonzero(status == sl.MarginStatus.OPEN))
        wrong += int(np.count_nonzero((status == sl.MarginStatus.FEASIBLE) & (plan.status == sl.PoseStatus.INFEASIBLE)))
        wrong += int(np.count_nonzero((status == sl.MarginStatus.INFEASIBLE) & plan.feasible))
    share = held / count
    deviation = float(size * np.sqrt(share * (1.0 - share) / count))
    right = _right_vertices(robot, space)
    return Compared(space, size * share, deviation, size * unknown / count, unsure / count, wrong, right)


def _right_vertices(robot: sl.Robot, space: sl.Workspace) -> float:
    """Share of vertices inside the box without a wrong verdict on either side."""
    vertices, faces = space.surface.vertices, space.surface.faces
    by_box = np.unique(faces[(space.limiting[faces] == BY_BOX).any(axis=1)])
    free = np.setdiff1d(np.arange(len(vertices)), by_box)
    areas = normals_of(vertices, faces)
    normals = np.stack([np.bincount(faces.ravel(), np.repeat(part, 3), len(vertices)) for part in areas.T], axis=1)
    normals = normals[free] / np.linalg.norm(normals[free], axis=1)[:, None]
    inside = sl.inverse(robot, poses_at(vertices[free] - ASIDE * normals)).status
    outside = sl.inverse(robot, poses_at(vertices[free] + ASIDE * normals)).status
    wrong = (inside == sl.PoseStatus.INFEASIBLE) | (outside == sl.PoseStatus.SOLVED)
    return 1.0 - float(np.mean(wrong))
