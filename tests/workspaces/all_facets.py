"""Margins by a slow reference: normals by singular values, sag forces on fine grids; and robots that are hard cases."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.core.arrays import Array

GRID = 4000
LOOSEST = 5.0  # half of the weight of a cable over its chord tension: fifteen times as long as its chord, see `margin`
Support = Callable[[Array], Array]  # of normals (F, 6): the largest -y . w over a set, (F,)
PATTERNS = {"2T": 2, "3T": 3, "1R2T": 3, "3R3T": 6}


class Pulls(NamedTuple):
    """Sag forces of the cables at one pose: chord tensions at limits, sag forces there, and minus secants, (m,)."""

    low: Array
    high: Array
    at_low: Array
    at_high: Array
    least: Array
    most: Array

    @property
    def slope(self) -> Array:
        """Slope of the secant."""
        wide = self.high > self.low
        return np.where(wide, (self.at_high - self.at_low) / np.where(wide, self.high - self.low, 1.0), 0.0)

    def ends_only(self) -> Pulls:
        """Bounds of the curves from their ends only, a wrong method for comparison."""
        return self._replace(least=0.0 * self.low, most=0.0 * self.low)


class Answer(NamedTuple):
    """Margins over all facets [N], and the normals of the three facets, (6,)."""

    value: float
    low: float
    high: float
    directions: Array


def pulls_on_a_grid(robot: sl.Robot, pose: sl.Pose, model: sl.CableModel) -> Pulls:
    """From a few thousand tensions; limits are those of the chord tension."""
    run = pose.transform(robot.platform_anchors) - robot.frame_anchors
    span, rise = np.hypot(run[:, 0], run[:, 1]), run[:, 2]
    low, high = robot.tension_min.copy(), robot.tension_max.copy()
    if isinstance(model, sl.Catenary):
        half_weight = 0.5 * robot.cables.linear_density * robot.gravity * np.hypot(span, rise)
        low = np.minimum(np.maximum(low, half_weight / LOOSEST), high)
    tension = np.geomspace(low, high, GRID, axis=-1)
    tension[:, 0], tension[:, -1] = low, high
    cable = sl.Cable(robot.cables.linear_density[:, None], robot.cables.axial_stiffness[:, None])
    hung = model.from_tension(cable, span[:, None], rise[:, None], tension, robot.gravity)
    pull = hung.vertical_force - tension * (rise / np.hypot(span, rise))[:, None]
    ends = Pulls(low, high, pull[:, 0], pull[:, -1], low, high)
    off = pull - pull[:, :1] - ends.slope[:, None] * (tension - low[:, None])
    return ends._replace(least=off.min(axis=1), most=off.max(axis=1))


def mean_arm(robot: sl.Robot) -> float:
    """Mean distance of the platform anchors from the center of mass [m]."""
    return float(np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1).mean())


def all_facets(robot: sl.Robot, pose: sl.Pose, pulls: Pulls, support: Support, arm: float) -> Answer:
    """Margin over the normals of all subsets of the secants, in both directions, with moments of all free motions."""
    freedom = robot.freedom
    n, m = len(freedom), robot.cable_count
    run = pose.transform(robot.platform_anchors) - robot.frame_anchors
    unit = -run / np.linalg.norm(run, axis=1, keepdims=True)
    lever = (robot.platform_anchors - robot.center_of_mass) @ pose.matrix.T
    full = np.hstack([unit, np.cross(lever, unit)]).T
    up = np.tile([0.0, 0.0, 1.0], (m, 1))
    hanging = np.hstack([up, np.cross(lever, up)]).T
    units = np.where(np.abs(freedom[:, 3:]).sum(axis=1) > 0.5, 1.0 / (mean_arm(robot) or 1.0), 1.0)
    secants = full - pulls.slope * hanging
    scaled = units[:, None] * (freedom @ secants)
    chosen = np.array(list(combinations(range(m), n - 1)))
    columns = scaled[:, chosen].transpose(1, 0, 2)  # (F, n, n - 1)
    left, sizes, _ = np.linalg.svd(columns)
    normals = (left[:, :, -1] * units) @ freedom
    normals = normals[sizes[:, -1] > 1e-9]
    normals = np.concatenate([normals, -normals])
    length = np.sqrt((normals[:, :3] ** 2).sum(axis=1) + arm**2 * (normals[:, 3:] ** 2).sum(axis=1))
    normals = normals[length > 1e-9] / length[length > 1e-9, None]
    along, down = normals @ full, normals @ hanging
    needed = normals[:, 2] * robot.mass * robot.gravity + support(normals)
    ends = np.maximum(along * pulls.low - down * pulls.at_low, along * pulls.high - down * pulls.at_high)
    inside = np.abs(normals @ secants) <= 1e-9 * (np.abs(normals) @ np.abs(secants))
    value = ends.sum(axis=1) - needed
    least = value - (inside * np.maximum(down * pulls.least, down * pulls.most)).sum(axis=1)
    most = value - np.minimum(down * pulls.least, down * pulls.most).sum(axis=1)
    best = [int(np.argmin(one)) for one in (value, least, most)]
    return Answer(float(value.min()), float(least.min()), float(most.min()), normals[best])


def no_load(normals: Array) -> Array:
    """Support of the weight only."""
    return np.zeros(len(normals))


def crafted(rng: np.random.Generator, pattern: str, extra: int | None = None, *, deep: bool = True) -> sl.Robot:
    """A robot with heavy, soft cables on all sides that sag far at their lower limits."""
    n = PATTERNS[pattern]
    m = n + (int(rng.integers(1, 3)) if extra is None else extra)
    planar = pattern in ("2T", "1R2T")
    frame = rng.uniform(-1.0, 1.0, (m, 3))
    frame *= np.array([12.0, 9.0, 6.0]) / np.linalg.norm(frame, axis=1, keepdims=True)
    platform = rng.uniform(-0.6, 0.6, (m, 3))
    if pattern in ("2T", "3T"):
        platform[:] = 0.0
    if planar:
        frame[:, 1] = platform[:, 1] = 0.0
    density = 10 ** rng.uniform(-1.5, 0.5, m) if deep else np.full(m, 0.05)
    half_weight = 0.5 * density * 9.81 * np.linalg.norm(frame, axis=1)
    low = half_weight / 10 ** rng.uniform(-1.5, 0.3, m)
    high = low * 10 ** rng.uniform(0.5, 2.0, m)
    stiffness = high / 10 ** rng.uniform(-4.0, -0.9, m)
    return sl.Robot(
        "crafted",
        frame,
        platform,
        sl.Cable(density, stiffness),
        float(rng.uniform(0.05, 1.0) * high.mean() / 9.81),
        np.eye(3) * 0.1,
        motion_pattern=pattern,  # type: ignore[arg-type]
        plane_normal=[0.0, 1.0, 0.0] if planar else None,
        tension_min=low,
        tension_max=high,
    )
