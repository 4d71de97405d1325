"""Robots with heavy cables, whose workspaces are compared with verdicts of the inverse at random positions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.core.arrays import Array, Flags
from sagline.workspaces.surface import normals_of
from sagline.workspaces.workspace import BY_BOX

BLOCK = 20_000  # positions per call
ASIDE = 1e-3  # [m], distance of the verdicts from the boundary
OPEN = 0.01  # target: largest share of open positions
RIGHT = 0.999  # target: least share of vertices without a wrong verdict
STEP = 1e-6  # [m], first distance and distances of the verdicts that find a gap outside the boundary
ROUNDING = 1e-5  # a margin of less than this share of the weight has no sign
PRESETS = ("article-suspended", "article-mixed", "cogiro", "ipanema-1", "ipanema-3")


class Compared(NamedTuple):
    """A workspace and the verdicts of the inverse."""

    space: sl.Workspace
    volume: float  # by the share of feasible positions [m^3]
    deviation: float  # standard deviation of this volume [m^3]
    borderline: float  # volume of the positions without a verdict [m^3]
    open: float  # share of positions whose margin is open
    contradictions: int  # positions at which the status of the margin contradicts the verdict
    wrong_sign: int  # positions with an open margin whose value has the sign that contradicts the verdict
    right: float  # share of vertices without a wrong verdict inside or outside
    before_gap: float  # share of vertices before a gap in which the inverse has no verdict and the margin is negative

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
    rounding = ROUNDING * robot.mass * robot.gravity
    held = unknown = unsure = wrong = wrong_sign = 0
    for first in range(0, count, BLOCK):
        poses = poses_at(rng.uniform(space.box.low, space.box.high, (min(BLOCK, count - first), 3)))
        plan, margin = sl.inverse(robot, poses), sl.margin(robot, poses)
        infeasible, is_open = plan.status == sl.PoseStatus.INFEASIBLE, margin.status == sl.MarginStatus.OPEN
        held += int(np.count_nonzero(plan.feasible))
        unknown += int(np.count_nonzero(plan.status == sl.PoseStatus.BORDERLINE))
        unsure += int(np.count_nonzero(is_open))
        wrong_sign += int(np.count_nonzero(is_open & plan.feasible & (margin.value < -rounding)))
        wrong_sign += int(np.count_nonzero(is_open & infeasible & (margin.value > rounding)))
        wrong += int(np.count_nonzero((margin.status == sl.MarginStatus.FEASIBLE) & infeasible))
        wrong += int(np.count_nonzero((margin.status == sl.MarginStatus.INFEASIBLE) & plan.feasible))
    share = held / count
    deviation = float(size * np.sqrt(share * (1.0 - share) / count))
    counted = (unsure / count, wrong, wrong_sign, *_right_vertices(robot, space))
    return Compared(space, size * share, deviation, size * unknown / count, *counted)


def _right_vertices(robot: sl.Robot, space: sl.Workspace) -> tuple[float, float]:
    """Shares of vertices inside the box without a wrong verdict on either side, and before a gap without a verdict."""
    vertices, faces = space.surface.vertices, space.surface.faces
    by_box = np.unique(faces[(space.limiting[faces] == BY_BOX).any(axis=1)])
    free = np.setdiff1d(np.arange(len(vertices)), by_box)
    areas = normals_of(vertices, faces)
    normals = np.stack([np.bincount(faces.ravel(), np.repeat(part, 3), len(vertices)) for part in areas.T], axis=1)
    normals = normals[free] / np.linalg.norm(normals[free], axis=1)[:, None]
    middle = vertices[free]
    wrong = sl.inverse(robot, poses_at(middle - ASIDE * normals)).status == sl.PoseStatus.INFEASIBLE
    again = np.flatnonzero(sl.inverse(robot, poses_at(middle + ASIDE * normals)).feasible)
    proved, likely = _gap_begins(robot, middle[again], normals[again])
    wrong[again] |= ~(proved | likely)
    return 1.0 - float(np.mean(wrong)), float(np.count_nonzero(likely) / len(free))


def _gap_begins(robot: sl.Robot, vertices: Array, normals: Array) -> tuple[Flags, Flags]:
    """Masks (N,) of vertices with a gap 1 µm to 0.1 mm outside: proved, or with a negative margin but no verdict.

    These vertices are on the boundary even if a feasible part of the box begins again within 1 mm.
    """
    line = vertices[:, None] + np.arange(STEP, 0.1 * ASIDE + 0.5 * STEP, STEP)[:, None] * normals[:, None]
    poses = poses_at(line.reshape(-1, 3))
    status = sl.inverse(robot, poses).status.reshape(line.shape[:2])
    negative = sl.margin(robot, poses).value.reshape(line.shape[:2]) < 0.0
    proved = (status == sl.PoseStatus.INFEASIBLE).any(axis=1)
    likely = ((status == sl.PoseStatus.BORDERLINE) & negative).any(axis=1)
    return proved, likely & ~proved
