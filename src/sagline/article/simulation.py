"""Study of figures 17 to 22: both robots along the planar path, with each of the five cable models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import sagline as sl
from sagline.article.models import MODELS
from sagline.core.arrays import Array

ROBOTS = ("article-suspended", "article-mixed")  # the article's first and second configuration
# The article's (55) selects the tensions closest to the previous ones. In its figures, however, cables that are not
# needed are near their minimum, and curves return to their initial values. Both agree with the minimum norm of the
# article's variable T_x.
METHOD = sl.MinimumNorm("horizontal")
ERROR_BAND = 6e-3  # [m], the article's "(-6, 6) mm"


class Figures(NamedTuple):
    """Numbers of a run; only feasible poses count."""

    error_max: float  # largest distance of the platform from the planned position [m]
    error_mean: float  # mean distance [m]
    axis_error_max: float  # largest error along one axis [m]
    tension_min: float  # smallest T_x [N]
    tension_max: float  # largest T_x [N]
    vertical_max: float  # largest |T_z| [N]
    step_max: float  # largest change of T_x between two samples [N]
    slope_max: float  # largest |dT_x/dt| [N/s]
    # largest change of dT_x/dt between two steps [N/s]; at a kink of T_x, smaller steps do not reduce it
    slope_jump: float
    length_min: float  # smallest L [m]
    length_max: float  # largest L [m]
    adjusting_min: float  # smallest d [m]
    adjusting_max: float  # largest d [m]
    feasible: float  # share of feasible poses
    held: float  # share of poses with a stable equilibrium for the planned lengths


@dataclass(frozen=True, slots=True, eq=False)
class PathStudy:
    """Both robots along the same path.

    Attributes:
        path: The path, N samples.
        models: The cable models, shape (k,).
        suspended: Plan and exact equilibria of the first configuration, one per model.
        mixed: Plan and exact equilibria of the second configuration, one per model.
    """

    path: sl.Path
    models: tuple[sl.CableModel, ...]
    suspended: tuple[sl.Confirmation, ...]
    mixed: tuple[sl.Confirmation, ...]

    def of(self, kind: type[sl.CableModel]) -> tuple[sl.Confirmation, sl.Confirmation]:
        """Runs of both robots with one model."""
        k = [type(model) for model in self.models].index(kind)
        return self.suspended[k], self.mixed[k]

    @property
    def tension_ratio(self) -> float:
        """Highest T_x of the mixed robot, divided by that of the suspended robot, with the empirical model."""
        suspended, mixed = (figures(run) for run in self.of(sl.Empirical))
        return mixed.tension_max / suspended.tension_max


@dataclass(frozen=True, slots=True, eq=False)
class LowTension:
    """Position error of the empirical model as a function of the lower tension limit."""

    tension_min: Array  # lower limit of the chord tension [N], shape (k,)
    suspended: Array  # largest error along one axis of the first configuration [m], shape (k,)
    mixed: Array  # largest error along one axis of the second configuration [m], shape (k,)
    suspended_bound: Figures  # first configuration; the lower limit is the bound (54) with T_adj = 0
    mixed_bound: Figures  # second configuration with the same lower limit


def path_study(rate: float = 100.0, models: Sequence[sl.CableModel] = MODELS) -> PathStudy:
    """Plan both robots along the article's path, and find the equilibria of exact cables with the planned lengths.

    The plan is the "simple controller" of the article, which computes lengths from tensions. The resulting pose of the
    platform is the equilibrium on exact cables, with the same inertial forces.

    Source:
        Gia Luan & Truong Thinh 2020, section 7.1, figures 17 to 22.
    """
    path = sl.article_path(rate)
    runs = [tuple(_run(sl.load_robot(name), path, model, METHOD) for model in models) for name in ROBOTS]
    suspended, mixed = runs
    return PathStudy(path, tuple(models), suspended, mixed)


def low_tension_study(limits: Array, rate: float = 10.0) -> LowTension:
    """Study of the empirical model at low tensions, at which cables may become slack."""
    path, robots = sl.article_path(rate), [sl.load_robot(name) for name in ROBOTS]
    suspended, mixed = (
        [figures(_run(robot.replace(tension_min=low), path, sl.Empirical(), METHOD)).axis_error_max for low in limits]
        for robot in robots
    )
    bound = sl.MinimumNorm("horizontal", lowest_point_margin=0.0)
    bounds = [figures(_run(robot.replace(tension_min=0.0), path, sl.Empirical(), bound)) for robot in robots]
    return LowTension(np.asarray(limits), np.array(suspended), np.array(mixed), *bounds)


def figures(run: sl.Confirmation) -> Figures:
    """Numbers of a run."""
    plan, good = run.plan, np.atleast_1d(run.plan.feasible & run.held)
    if not good.any():
        return Figures(*(float("nan"),) * 13, float(np.mean(plan.feasible)), 0.0)
    cables, error = plan.state.cables, run.position_error[good]
    distance = np.linalg.norm(error, axis=1)
    tension = plan.horizontal_tension
    return Figures(
        error_max=float(distance.max()),
        error_mean=float(distance.mean()),
        axis_error_max=float(np.abs(error).max()),
        tension_min=float(tension[good].min()),
        tension_max=float(tension[good].max()),
        vertical_max=float(np.abs(plan.vertical_force[good]).max()),
        **_smoothness(run),
        length_min=float(plan.unstrained_length[good].min()),
        length_max=float(plan.unstrained_length[good].max()),
        adjusting_min=float(cables.adjusting_length[good].min()),
        adjusting_max=float(cables.adjusting_length[good].max()),
        feasible=float(np.mean(plan.feasible)),
        held=float(np.mean(good)),
    )


def _run(robot: sl.Robot, path: sl.Path, model: sl.CableModel, method: sl.TensionMethod) -> sl.Confirmation:
    return sl.confirm(sl.inverse(robot, path, model, method))


def _smoothness(run: sl.Confirmation) -> dict[str, float]:
    path, tension = run.plan.path, run.plan.horizontal_tension
    assert path is not None
    change = np.diff(tension, axis=0)
    slope = change / np.diff(path.time)[:, None]
    return {
        "step_max": float(np.nanmax(np.abs(change))),
        "slope_max": float(np.nanmax(np.abs(slope))),
        "slope_jump": float(np.nanmax(np.abs(np.diff(slope, axis=0)))),
    }
