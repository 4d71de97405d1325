"""Chapter: figures 17 to 22."""

from __future__ import annotations

import numpy as np

import sagline as sl
from sagline.article.drawing import WIDTH, Drawings, axes, cables_over_time, legend, logarithmic_with_floor, thinning
from sagline.article.simulation import ERROR_BAND, Figures, LowTension, Simulation, figures, low_tension_study, simulate
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.plan import path as draw_path
from sagline.plot.robot import robot as draw_robot
from sagline.plot.sheet import BLUE, COLORS, VERMILLION, Sheet
from sagline.present.page import Chapter, Finding, Panel, Table, Verdict

LIMITS = np.array(
    [15.0, 17.0, 18.0, 18.5, 19.0, 19.5, 20.0, 22.5, 25.0, 30.0, 40.0, 50.0]
)  # N, lower limits of the chord tension
CORNER = (5.0, 3.5, 1.5)  # m, of the path
FLOOR = 1e-9  # m: distances below a nanometer are not drawn
NEAR = 1.05  # times the lower limit: what counts as near the minimum


def simulation_chapter() -> Chapter:
    """Both robots along the path."""
    study, low = simulate(), low_tension_study(LIMITS)
    draw = Drawings("simulation")
    return Chapter(
        "simulation",
        "The simulation",
        "Both robots of Table 1 along a planar rest-to-rest path at z = 1.5 m. The article prints no anchor "
        "coordinates and no numbers of its path: ours are chosen and stated with the presets. Tensions are the least "
        "norm of T_x within the limits of the presets. Position errors are those of exact elastic cables wound to "
        "the planned lengths, inertia included.",
        (
            _robots(study, draw),
            _path(study.path, draw),
            _courses(study, draw),
            _error(study, draw),
            _comparison(study),
            _models(study, draw),
            _low_tension(low, draw),
        ),
    )


def _robots(study: Simulation, draw: Drawings) -> Finding:
    panels = []
    for run, caption in zip(study.of(sl.Catenary), ("First configuration: suspended.", "Second: mixed."), strict=True):
        figure = Sheet(figsize=(WIDTH, 3.4))
        figure.subplots_adjust(left=0.13, right=1.0, bottom=0.0, top=1.0)
        ax = figure.add_subplot(projection="3d")
        draw_robot(run.plan.state.one_robot, sl.Pose.from_euler(CORNER, 0.0, 0.0, 0.0), ax)
        ax.set_title("")
        panels.append(draw.panel(figure, caption))
    return Finding(
        key="robots",
        figures=(17,),
        title="the two configurations",
        statement="(a) all eight cables from the top, as CoGiRo; (b) four from the top, four from the bottom, as "
        "IPAnema 1.",
        measured="Frame corners and platform corners of Table 1's sizes; which is joined to which is our choice, "
        "crossed for the first, straight for the second.",
        verdict=Verdict.OPEN,
        numbers={},
        panels=tuple(panels),
    )


def _path(path: sl.Path, draw: Drawings) -> Finding:
    figure, ax = axes("", "")
    draw_path(path, ax)
    figure.subplots_adjust(bottom=0.16, top=0.92)
    second, bx = axes("time [s]", "velocity [m/s]")
    part = thinning(len(path))
    for name, course, color in zip("xy", path.twist.T[:2], COLORS, strict=False):
        bx.plot(path.time[part], course[part], color=color, linewidth=1.3, label=f"$v_{name}$")
    legend(bx)
    speed = np.linalg.norm(path.twist[:, :3], axis=1)
    acceleration = np.linalg.norm(path.twist_rate[:, :3], axis=1)
    return Finding(
        key="path",
        figures=(18, 19),
        title="path and velocity",
        statement="z_P = 1.5 m, all angles 0; 5th order polynomials. No numbers are given.",
        measured=f"Ours: {n(path.duration, unit='s')}, {len(path)} samples, up to {n(speed.max(), '.3g', 'm/s')} and "
        f"{n(acceleration.max(), '.2g', 'm/s²')}, at rest at the corners, the center and both ends.",
        verdict=Verdict.OPEN,
        numbers={
            "duration_s": path.duration,
            "samples": len(path),
            "speed_max": speed.max(),
            "acceleration_max": acceleration.max(),
        },
        panels=(draw.panel(figure, "The path from above (figure 18)."), draw.panel(second, "Velocities (figure 19).")),
    )


def _courses(study: Simulation, draw: Drawings) -> Finding:
    panels, numbers, texts = [], {}, []
    for run, robot, figure in zip(study.of(sl.Empirical), ("suspended", "mixed"), (20, 21), strict=True):
        cables, numbers[robot] = run.plan.state.cables, figures(run)._asdict()
        for values, label, what in (
            (cables.unstrained_length, "$L$ [m]", "unstrained length"),
            (1e3 * cables.adjusting_length, "$d$ [mm]", "adjusting length"),
            (cables.horizontal_tension, "$T_x$ [N]", "T_x"),
            (cables.vertical_force, "$T_z$ [N]", "T_z"),
        ):
            panels.append(_cables(run.plan, values, label, f"Figure {figure}, {robot}: {what}.", draw))
        found = figures(run)
        texts.append(
            f"{robot.capitalize()}: L {n(found.length_min, '.2f')} to {n(found.length_max, '.2f', 'm')}, d "
            f"{n(1e3 * found.adjusting_min, '.3g')} to {n(1e3 * found.adjusting_max, '.3g', 'mm')}, T_x "
            f"{n(found.tension_min, '.3g')} to {n(found.tension_max, '.3g', 'N')}, changing by at most "
            f"{n(found.step_max, '.2g', 'N')} from sample to sample, its slope of up to "
            f"{n(found.slope_max, '.2g', 'N/s')} "
            f"by at most {n(found.slope_jump, '.2g', 'N/s')}"
        )
    return Finding(
        key="courses",
        figures=(20, 21),
        title="lengths, adjusting lengths and tensions",
        statement="“Our proposed model produces a continuous and smooth set of tension.”",
        measured="Continuous, with mild corners.\n\n"
        + ".\n\n".join(texts)
        + ".\n\nThe slope jumps where the 5th order polynomials begin and end, and where a cable reaches its limit.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers=numbers,
        panels=tuple(panels),
    )


def _cables(plan: sl.Plan, values: Array, label: str, caption: str, draw: Drawings) -> Panel:
    path = plan.path
    assert path is not None
    figure, ax = cables_over_time(path.time, values, label, 1.0, "{}")
    ax.set_xlim(path.time[0], path.time[-1])
    legend(ax, "cable")
    return draw.panel(figure, caption)


def _error(study: Simulation, draw: Drawings) -> Finding:
    panels, found = [], {}
    for run, robot in zip(study.of(sl.Empirical), ("suspended", "mixed"), strict=True):
        found[robot] = figures(run)
        panels.append(_error_panel(run, study.path, f"{robot.capitalize()}: empirical model.", draw))
    inside = all(f.axis_error_max <= ERROR_BAND for f in found.values())
    return Finding(
        key="position-error",
        figures=(22,),
        title="position error of the empirical model",
        statement="The model keeps the positioning error around (−6, 6) mm.",
        measured="On our path the largest error along an axis is "
        + ", ".join(f"{n(1e3 * f.axis_error_max, '.2f', 'mm')} ({robot})" for robot, f in found.items())
        + "; distance "
        + ", ".join(
            f"{n(1e3 * f.error_max, '.2f', 'mm')} at most and {n(1e3 * f.error_mean, '.2f', 'mm')} in the mean"
            for f in found.values()
        )
        + ". Better than the article says, with our path and limits; worse where cables are looser, see below.",
        verdict=Verdict.HOLDS if inside else Verdict.FAILS,
        numbers={
            robot: {"axis_mm": 1e3 * f.axis_error_max, "max_mm": 1e3 * f.error_max, "mean_mm": 1e3 * f.error_mean}
            for robot, f in found.items()
        },
        panels=tuple(panels),
    )


def _error_panel(run: sl.Confirmation, path: sl.Path, caption: str, draw: Drawings) -> Panel:
    part = thinning(len(path))
    figure, ax = axes("time [s]", "position error [mm]", height=2.7)
    for name, course, color in zip("xyz", 1e3 * run.position_error[part].T, COLORS, strict=False):
        ax.plot(path.time[part], course, color=color, linewidth=1.1, label=f"${name}$")
    ax.set_xlim(path.time[0], path.time[-1])
    legend(ax)
    return draw.panel(figure, caption)


def _comparison(study: Simulation) -> Finding:
    suspended, mixed = study.of(sl.Empirical)
    robot = mixed.plan.state.one_robot
    lower = robot.frame_anchors[:, 2] < robot.frame_anchors[:, 2].mean()
    near = float(np.mean(mixed.plan.chord_tension[:, lower] <= NEAR * robot.tension_min[lower]))
    rows = [
        (label, *(n(scale * getattr(figures(run), field), form) for run in (suspended, mixed)))
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
    return Finding(
        key="configurations",
        title="the two configurations compared",
        statement="T_x of the lower cables is small, but valid; the highest load of the second configuration is "
        "approximately twice that of the first.",
        measured=f"The ratio of the highest T_x is {n(study.tension_ratio, '.2f')}. The lower cables are within "
        f"{n(100 * (NEAR - 1), unit='%')} of their lower limit {n(100 * near, '.3g', '%')} of the time.",
        verdict=Verdict.HOLDS,
        numbers={
            "tension_ratio": study.tension_ratio,
            "near_limit_share": NEAR - 1.0,
            "share_of_lower_cables_at_limit": near,
        },
        data=(Table("Empirical model", ("", "suspended", "mixed"), rows),),
    )


def _models(study: Simulation, draw: Drawings) -> Finding:
    rows, numbers = [], {}
    for model, first, second in zip(study.models, study.suspended, study.mixed, strict=True):
        pair, name = (figures(first), figures(second)), type(model).__name__
        rows.append(
            (
                name,
                *(
                    n(1e3 * value, ".3g", size=1e3 * f.length_max)
                    for f in pair
                    for value in (f.error_max, f.error_mean)
                ),
                *(n(f.tension_max, ".1f") for f in pair),
                *(n(100 * f.held, ".4g") for f in pair),
            )
        )
        numbers[name] = {"suspended_mm": 1e3 * pair[0].error_max, "mixed_mm": 1e3 * pair[1].error_max}
    panels = []
    for robot, runs in (("suspended", study.suspended), ("mixed", study.mixed)):
        figure, ax = axes("time [s]", "distance from the plan [mm]")
        part = thinning(len(study.path))
        for model, run, color in zip(study.models[:-1], runs, COLORS, strict=False):
            distance = 1e3 * np.linalg.norm(run.position_error[part], axis=1)
            ax.plot(study.path.time[part], distance, color=color, linewidth=1.1, label=type(model).__name__)
        logarithmic_with_floor(ax, 1e3 * FLOOR, f"below {n(FLOOR, '.3g', 'm')}")
        legend(ax)
        panels.append(draw.panel(figure, f"Position error of four models, {robot}; the exact one is the zero."))
    shallow = [figures(run).error_max for run in study.of(sl.Parabolic)]
    return Finding(
        key="five-models",
        title="all five cable models on the same path",
        statement="",
        measured=f"The exact model comes back to within {n(_worst(study.of(sl.Catenary)), '.2g', 'm')}, which is "
        "rounding. The "
        f"parabolic one, as cheap as the article's, is within {n(max(shallow), '.2g', 'm')}: the published "
        "constants and the stretch by one end's tension make up nearly all of the empirical model's error.",
        verdict=Verdict.OURS,
        numbers={
            "largest_error": numbers,
            "exact_largest_error_pm": 1e12 * _worst(study.of(sl.Catenary)),
            "longest_length_m": max(figures(run).length_max for run in study.of(sl.Catenary)),
        },
        panels=tuple(panels),
        data=(
            Table(
                "Distance from the plan [mm], highest T_x [N], and poses held in a stable equilibrium [%]",
                (
                    "model",
                    "max, suspended",
                    "mean",
                    "max, mixed",
                    "mean",
                    "T_x suspended",
                    "T_x mixed",
                    "held, susp.",
                    "mixed",
                ),
                rows,
            ),
        ),
    )


def _low_tension(low: LowTension, draw: Drawings) -> Finding:
    figure, ax = axes("lower limit of the chord tension [N]", "largest error on an axis [mm]")
    ax.plot(low.tension_min, 1e3 * low.suspended, color=BLUE, marker="o", markersize=3.0, label="suspended")
    ax.plot(low.tension_min, 1e3 * low.mixed, color=VERMILLION, marker="o", markersize=3.0, label="mixed")
    ax.axhline(1e3 * ERROR_BAND, color="0.5", linewidth=0.8, linestyle=":", label="the article's 6 mm")
    ax.set_yscale("log")
    legend(ax)
    bound: tuple[Figures, Figures] = (low.suspended_bound, low.mixed_bound)
    good = low.tension_min[np.maximum(low.suspended, low.mixed) <= ERROR_BAND]
    return Finding(
        key="low-tension",
        title="position error where cables are loose",
        statement="(54) bounds T_x from below, and T_adj > 0 is added “to maintain the accuracy”.",
        measured=f"The error stays within ±{n(1e3 * ERROR_BAND, unit='mm')} for lower limits from "
        f"{n(good.min(), '.3g', 'N')} on "
        "and grows fast below, where the mixed robot's lower cables hang slack. With the bound (54) alone, T_adj = 0, "
        f"it is {n(1e3 * bound[0].axis_error_max, '.2f')} and {n(1e3 * bound[1].axis_error_max, '.2f', 'mm')}, the "
        "lowest "
        f"T_x {n(bound[0].tension_min, '.3g')} and {n(bound[1].tension_min, '.3g', 'N')}.",
        verdict=Verdict.HOLDS_WITHIN,
        numbers={
            "band_mm": 1e3 * ERROR_BAND,
            "limits_N": low.tension_min,
            "suspended_mm": 1e3 * low.suspended,
            "mixed_mm": 1e3 * low.mixed,
            "bound_54_mm": [1e3 * f.axis_error_max for f in bound],
            "bound_54_lowest_N": [f.tension_min for f in bound],
        },
        panels=(draw.panel(figure, "Empirical model, over the lowest tension that the load sharing may use."),),
    )


def _worst(runs: tuple[sl.Confirmation, sl.Confirmation]) -> float:
    return max(figures(run).error_max for run in runs)
