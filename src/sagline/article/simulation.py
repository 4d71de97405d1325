"""Chapter about figures 17 to 22: both robots along the planar path, with each of the five cable models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

import sagline as sl
from sagline.article.drawing import (
    WIDTH,
    Drawing,
    axes,
    cables_over_time,
    chapter,
    finding,
    logarithmic_with_floor,
    thinning,
)
from sagline.article.models import MODELS
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.plan import path as draw_path
from sagline.plot.robot import robot as draw_robot
from sagline.plot.sheet import BLUE, COLORS, LINE_STYLES, VERMILLION, Sheet, draw_components
from sagline.present.page import Chapter, Finding, Table, Verdict

ROBOTS = ("article-suspended", "article-mixed")  # the article's first and second configuration
# Equation (55) of the article selects the tensions that are closest to the previous tensions. The figures of the
# article show another method: tensions of cables that are not needed are near their minimum, and curves return to their
# initial values. Tensions with the minimum norm of T_x have both properties.
METHOD = sl.MinimumNorm("horizontal")
ERROR_BAND = 6e-3  # [m], the article's "(-6, 6) mm"


class _Figures(NamedTuple):
    """Summary of one robot along the path with one model; only feasible poses count."""

    error_max: float  # largest distance of the platform from the planned position [m]
    error_mean: float  # mean distance [m]
    axis_error_max: float  # largest error along one axis [m]
    tension_min: float  # smallest T_x [N]
    tension_max: float  # largest T_x [N]
    vertical_max: float  # largest |T_z| [N]
    step_max: float  # largest change of T_x between two samples [N]
    slope_max: float  # largest |dT_x/dt| [N/s]
    # largest change of dT_x/dt between two steps [N/s]; smaller steps do not reduce the change at a kink of T_x
    slope_jump: float
    length_min: float  # smallest L [m]
    length_max: float  # largest L [m]
    adjusting_min: float  # smallest d [m]
    adjusting_max: float  # largest d [m]
    feasible: float  # share of feasible poses
    held: float  # share of poses with a stable equilibrium for the planned lengths


# results of the first and of the second configuration along the same path, by the type of the cable model
PathStudy: TypeAlias = dict[type[sl.CableModel], tuple[sl.Confirmation, sl.Confirmation]]


def path_study(path: sl.Path, models: Sequence[sl.CableModel] = MODELS) -> PathStudy:
    """Plan both robots along the article's path, and find the equilibria of exact cables with the planned lengths."""
    # The lengths are planned as in the "simple controller" of the article, which computes lengths from tensions. The
    # actual pose is the equilibrium of exact cables with the planned lengths and the same inertial forces.
    # Source: Gia Luan & Truong Thinh 2020, section 7.1, figures 17 to 22.
    suspended, mixed = (sl.load_robot(name) for name in ROBOTS)
    return {type(model): (_run(suspended, path, model, METHOD), _run(mixed, path, model, METHOD)) for model in models}


def low_tension_study(limits: Array, rate: float = 10.0) -> tuple[Array, list[_Figures]]:
    """Largest errors (2, k) [m] along any axis of two robots with k lower tension limits; results for bound (54)."""
    # Both robots are planned with the empirical model. Cables may become slack. The bound (54) has T_adj = 0.
    path, robots = sl.article_path(rate), [sl.load_robot(name) for name in ROBOTS]
    errors = [
        [figures(_run(robot.replace(tension_min=low), path, sl.Empirical(), METHOD)).axis_error_max for low in limits]
        for robot in robots
    ]
    bound = sl.MinimumNorm("horizontal", lowest_point_margin=0.0)
    return np.array(errors), [
        figures(_run(robot.replace(tension_min=0.0), path, sl.Empirical(), bound)) for robot in robots
    ]


def figures(run: sl.Confirmation) -> _Figures:
    """Summary of the errors, tensions and lengths of one robot along the path."""
    plan, good = run.plan, np.atleast_1d(run.plan.feasible & run.held)
    if not good.any():
        return _Figures(*(float("nan"),) * 13, float(np.mean(plan.feasible)), 0.0)
    cables, error = plan.state.cables, run.position_error[good]
    distance = np.linalg.norm(error, axis=1)
    tension = plan.horizontal_tension
    return _Figures(
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


# lower limits of the chord tension in the study [N]
LIMITS = np.array([15.0, 17.0, 18.0, 18.5, 19.0, 19.5, 20.0, 22.5, 25.0, 30.0, 40.0, 50.0])
CORNER = (5.0, 3.5, 1.5)  # corner of the path [m], to which the figure refers
FLOOR = 1e-9  # smallest drawn distance [m]
NEAR = 1.05  # a tension is near its minimum if it is less than this multiple of the lower limit


def simulation_chapter() -> Chapter:
    """Chapter about both robots along the path."""
    path = sl.article_path()
    study = path_study(path)
    findings = _robots(study), _path(path), _courses(study), _error(study, path), _comparison(study)
    return chapter("simulation", [*findings, _models(study, path), _low_tension()])


def _robots(study: PathStudy) -> Finding:
    panels = []
    for run, caption in zip(study[sl.Catenary], ("First configuration: suspended.", "Second: mixed."), strict=True):
        figure = Sheet(figsize=(WIDTH, 3.4))
        figure.subplots_adjust(left=0.13, right=0.97, bottom=0.0, top=1.0)
        ax = figure.add_subplot(projection="3d")
        draw_robot(run.plan.state.one_robot, sl.Pose(CORNER), ax)
        ax.set_title("")
        panels.append((figure, caption))
    return finding("robots", panels=panels)


def _path(path: sl.Path) -> Finding:
    figure, ax = axes("", "")
    draw_path(path, ax)
    figure.subplots_adjust(bottom=0.16, top=0.92)
    second, bx = axes("time [s]", "velocity [m/s]")
    part = thinning(len(path))
    draw_components(bx, path.time[part], path.twist[part, :2], "v_{}")
    speed = np.linalg.norm(path.twist[:, :3], axis=1)
    acceleration = np.linalg.norm(path.twist_rate[:, :3], axis=1)
    return finding(
        "path",
        numbers={
            "duration_s": path.duration,
            "samples": len(path),
            "speed_max": speed.max(),
            "acceleration_max": acceleration.max(),
        },
        panels=((figure, "The path from above (figure 18)."), (second, "Velocities (figure 19).")),
    )


def _courses(study: PathStudy) -> Finding:
    panels, numbers, texts = [], {}, []
    for run, robot, figure in zip(study[sl.Empirical], ("suspended", "mixed"), (20, 21), strict=True):
        cables, numbers[robot] = run.plan.state.cables, figures(run)._asdict()
        for values, label, what in (
            (cables.unstrained_length, "$L$ [m]", "unstrained length"),
            (1e3 * cables.adjusting_length, "$d$ [mm]", "adjusting length"),
            (cables.horizontal_tension, "$T_x$ [N]", "T_x"),
            (cables.vertical_force, "$T_z$ [N]", "T_z"),
        ):
            panels.append(_cables(run.plan, values, label, f"Figure {figure}, {robot}: {what}."))
        found = figures(run)
        texts.append(
            f"{robot.capitalize()}: L {n(found.length_min, '.2f')} to {n(found.length_max, '.2f', 'm')}, d "
            f"{n(1e3 * found.adjusting_min, '.3g')} to {n(1e3 * found.adjusting_max, '.3g', 'mm')}, T_x "
            f"{n(found.tension_min, '.3g')} to {n(found.tension_max, '.3g', 'N')}. Between two samples T_x changes "
            f"by at most {n(found.step_max, '.2g', 'N')}. Its slope is at most {n(found.slope_max, '.2g', 'N/s')}. "
            f"Between two samples the slope changes by at most {n(found.slope_jump, '.2g', 'N/s')}"
        )
    return finding("courses", numbers=numbers, panels=panels, courses=".\n\n".join(texts))


def _cables(plan: sl.Plan, values: Array, label: str, caption: str) -> Drawing:
    path = plan.path
    assert path is not None
    figure = cables_over_time(path.time, values, label, 1.0, "{}")
    figure.axes[0].set_xlim(path.time[0], path.time[-1])
    return figure, caption, "cable"


def _error(study: PathStudy, path: sl.Path) -> Finding:
    panels, found = [], {}
    for run, robot in zip(study[sl.Empirical], ("suspended", "mixed"), strict=True):
        found[robot] = figures(run)
        panels.append(_error_panel(run, path, f"{robot.capitalize()}: empirical model."))
    inside = all(f.axis_error_max <= ERROR_BAND for f in found.values())
    return finding(
        "position-error",
        numbers={
            robot: {"axis_mm": 1e3 * f.axis_error_max, "max_mm": 1e3 * f.error_max, "mean_mm": 1e3 * f.error_mean}
            for robot, f in found.items()
        },
        verdict=Verdict.HOLDS if inside else Verdict.FAILS,
        panels=panels,
    )


def _error_panel(run: sl.Confirmation, path: sl.Path, caption: str) -> Drawing:
    part = thinning(len(path))
    figure, ax = axes("time [s]", "position error [mm]", height=2.7)
    draw_components(ax, path.time[part], 1e3 * run.position_error[part])
    ax.set_xlim(path.time[0], path.time[-1])
    return figure, caption


def _comparison(study: PathStudy) -> Finding:
    suspended, mixed = study[sl.Empirical]
    robot = mixed.plan.state.one_robot
    lower = robot.frame_anchors[:, 2] < robot.frame_anchors[:, 2].mean()
    near = float(np.mean(mixed.plan.chord_tension[:, lower] <= NEAR * robot.tension_min[lower]))
    pair = figures(suspended), figures(mixed)
    rows = [
        (label, *(n(scale * getattr(found, field), form) for found in pair))
        for label, field, scale, form in (
            ("highest T_x [N]", "tension_max", 1.0, ".1f"),
            ("lowest T_x [N]", "tension_min", 1.0, ".1f"),
            ("highest |T_z| [N]", "vertical_max", 1.0, ".1f"),
            ("shortest L [m]", "length_min", 1.0, ".2f"),
            ("longest L [m]", "length_max", 1.0, ".2f"),
            ("largest position error [mm]", "error_max", 1e3, ".2f"),
            ("feasible poses [%]", "feasible", 100.0, ".4g"),
        )
    ]
    return finding(
        "configurations",
        numbers={
            "tension_ratio": pair[1].tension_max / pair[0].tension_max,
            "near_limit_share": NEAR - 1.0,
            "share_of_lower_cables_at_limit": near,
        },
        data=(Table("Empirical model", ("", "suspended", "mixed"), rows),),
    )


def _models(study: PathStudy, path: sl.Path) -> Finding:
    rows, numbers = [], {}
    for model, runs in study.items():
        pair, name = [figures(run) for run in runs], model.__name__
        sizes = [(value, f.length_max) for f in pair for value in (f.error_max, f.error_mean)]
        errors = [n(1e3 * value, ".3g", size=1e3 * longest) for value, longest in sizes]
        highest, held = [n(f.tension_max, ".1f") for f in pair], [n(100 * f.held, ".4g") for f in pair]
        rows.append((name, *errors, *highest, *held))
        numbers[name] = {"suspended_mm": 1e3 * pair[0].error_max, "mixed_mm": 1e3 * pair[1].error_max}
    head = ["model", "max, suspended", "mean", "max, mixed", "mean", "T_x suspended", "T_x mixed"]
    panels = []
    part = thinning(len(path))
    for k, robot in enumerate(("suspended", "mixed")):
        figure, ax = axes("time [s]", "distance from the plan [mm]")
        ax.set_prop_cycle(linestyle=LINE_STYLES)
        for (model, runs), color in zip(list(study.items())[:-1], COLORS, strict=False):
            distance = 1e3 * np.linalg.norm(runs[k].position_error[part], axis=1)
            ax.plot(path.time[part], distance, color=color, linewidth=1.1, label=model.__name__)
        logarithmic_with_floor(ax, 1e3 * FLOOR, f"below {n(FLOOR, '.3g', 'm')}")
        panels.append((figure, f"Position errors of four models, {robot}; the exact model is the reference."))
    shown = Table(
        "Distance from the plan [mm], highest T_x [N], and poses held in a stable equilibrium [%]",
        [*head, "held, susp.", "mixed"],
        rows,
    )
    return finding(
        "five-models",
        numbers={
            "largest_error": numbers,
            "exact_largest_error_pm": 1e12 * _worst(study[sl.Catenary]),
            "longest_length_m": max(figures(run).length_max for run in study[sl.Catenary]),
        },
        panels=panels,
        data=(shown,),
        exact=_worst(study[sl.Catenary]),
        parabolic=_worst(study[sl.Parabolic]),
    )


def _low_tension() -> Finding:
    errors, bounds = low_tension_study(LIMITS)
    figure, ax = axes("lower limit of the chord tension [N]", "largest error along an axis [mm]")
    for error, color, label in zip(errors, (BLUE, VERMILLION), ("suspended", "mixed"), strict=True):
        ax.plot(LIMITS, 1e3 * error, color=color, marker="o", markersize=3.0, label=label)
    ax.axhline(1e3 * ERROR_BAND, color="0.5", linewidth=0.8, linestyle=":", label="6 mm, as in the article")
    ax.set_yscale("log")
    return finding(
        "low-tension",
        numbers={
            "band_mm": 1e3 * ERROR_BAND,
            "limits_N": LIMITS,
            "suspended_mm": 1e3 * errors[0],
            "mixed_mm": 1e3 * errors[1],
            "bound_54_mm": [1e3 * f.axis_error_max for f in bounds],
            "bound_54_lowest_N": [f.tension_min for f in bounds],
        },
        panels=((figure, "Largest position error of the empirical model over the lower tension limit."),),
        good_from=LIMITS[errors.max(axis=0) <= ERROR_BAND].min(),
    )


def _worst(runs: tuple[sl.Confirmation, sl.Confirmation]) -> float:
    return max(figures(run).error_max for run in runs)
