"""Chapter about Table 2 and figures 25 to 27."""

from __future__ import annotations

import numpy as np

from sagline.article.causes import best_explanations, limits_of_ten_points, single_causes
from sagline.article.drawing import Drawings, axes, cables_over_time, error_panels, legend_above
from sagline.article.machine import Parameter
from sagline.article.sampling import fit_line
from sagline.article.ten_poses import TenPoses, ten_poses, tour
from sagline.article.texts import chapter, finding
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, COLORS, LINE_STYLES
from sagline.present.page import Chapter, Finding, Table, table_of

AREA = 2e4  # area of a circle per meter of error [pt^2/m]


def poses_chapter() -> Chapter:
    """Chapter about the ten poses of the prototype, and about possible causes of their errors."""
    study = ten_poses()
    draw = Drawings("poses")
    return chapter(
        "poses",
        (
            _table(study),
            single_causes(study),
            _tour(draw),
            _space(study, draw),
            _trends(study, draw),
            best_explanations(study, draw),
            limits_of_ten_points(study),
        ),
    )


def _table(study: TenPoses) -> Finding:
    table, plan = study.table, study.plan
    difference = np.abs(table.distance - table.printed_error).max()
    model = np.linalg.norm(study.model_error, axis=1).max()
    return finding(
        "table-2",
        numbers={
            "largest_difference_mm": 1e3 * difference,
            "model_error_max_mm": 1e3 * model,
            "distance_mm": 1e3 * table.distance,
            "unstrained_length_m": plan.unstrained_length,
            "horizontal_tension_N": plan.horizontal_tension,
            "frame_end_tension_N": plan.state.cables.frame_end_tension,
        },
        data=(
            table_of(
                "The ten poses, with their plan by sagline",
                ("pose", table.points, ""),
                ("desired x, y, z [m]", [", ".join(n(x, ".2f") for x in place) for place in table.desired], ""),
                ("error x, y, z [mm]", [", ".join(n(1e3 * x, ".0f") for x in error) for error in table.error], ""),
                ("distance [mm]", 1e3 * table.distance, ".4f"),
                ("printed [mm]", 1e3 * table.printed_error, ".4f"),
                ("L planned [m]", [_span(each, ".3f") for each in plan.unstrained_length], ""),
                ("tension at the winch [N]", [_span(each, ".0f") for each in plan.state.cables.frame_end_tension], ""),
            ),
        ),
    )


def _tour(draw: Drawings) -> Finding:
    plan, stops = tour()
    path, cables = plan.path, plan.state.cables
    assert path is not None
    panels = []
    for values, label, caption in (
        (cables.frame_end_tension, "tension at the winch [N]", "Planned tensions, to be compared with figure 25."),
        (
            1e3 * (cables.unstrained_length - cables.unstrained_length[0]),
            "$L - L_{home}$ [mm]",
            "Planned lengths minus the lengths at home, to be compared with figure 26.",
        ),
    ):
        figure, _ = cables_over_time(path.time, values, label, 0.9, stops=stops.tolist())
        panels.append(draw.panel(figure, caption))
    tension = cables.frame_end_tension
    return finding(
        "tour",
        numbers={
            "frame_end_tension_min_N": tension.min(),
            "frame_end_tension_max_N": tension.max(),
            "feasible_share": float(np.mean(plan.feasible)),
        },
        panels=panels,
        feasible="yes" if plan.feasible.all() else "no",
    )


def _space(study: TenPoses, draw: Drawings) -> Finding:
    table = study.table
    caption = "The poses in the {}-z plane; areas show the positioning errors."
    panels = error_panels(table.points, table.desired, [("", table.distance, AREA, BLUE)], caption, draw)
    line, height = study.height_line, table.desired[:, 2]
    figure, ax = axes("$z$ desired [m]", "vertical error [mm]")
    ax.plot(height, 1e3 * table.error[:, 2], "o", color=BLUE, markersize=4.0, label="measured")
    ends = np.array([height.min(), height.max()])
    ax.plot(ends, 1e3 * (line.slope * ends + line.intercept), color="black", linewidth=0.9, label="line")
    legend_above(ax)
    panels.append(draw.panel(figure, "Actual minus desired height of the platform."))
    tension = study.plan.horizontal_tension.mean(axis=1)
    against = float(np.corrcoef(tension, table.distance)[0, 1])
    return finding(
        "error-in-space",
        numbers={
            "slope_mm_per_m": 1e3 * line.slope,
            "r_squared": line.r_squared,
            "correlation_with_tension": against,
            "lowest_vertical_error_mm": 1e3 * table.error[:, 2].min(),
        },
        panels=panels,
        fall=-1e3 * line.slope,
    )


def _trends(study: TenPoses, draw: Drawings) -> Finding:
    height = study.table.desired[:, 2]
    figure, ax = axes("$z$ desired [m]", "vertical error [mm]")
    ax.plot(height, 1e3 * study.table.error[:, 2], "ko", markersize=4.0, label="measured")
    second, bx = axes("$z$ desired [m]", "vertical error [mm]")
    bx.plot(height, 1e3 * study.table.error[:, 2], "ko", markersize=4.0, label="measured")
    fine = np.array([height.min(), height.max()])
    for k, trend in enumerate(study.trends):
        axis = ax if k < 5 else bx
        line = fit_line(height, 1e3 * trend.error[:, 2])
        course = line.slope * fine + line.intercept
        look = {"color": COLORS[k % 5], "linestyle": LINE_STYLES[k % 5]}
        axis.plot(fine, course, **look, linewidth=1.2, label=_typical(trend.parameter))
    for axis in (ax, bx):
        axis.set_ylim(-25.0, 85.0)
        legend_above(axis)
    listed = [(_typical(trend.parameter), trend.error, trend.height_slope) for trend in study.trends]
    listed.append(("measured", study.table.error, float(1e3 * study.height_line.slope)))
    rows = [(name, *(n(1e3 * z, ".1f") for z in error[:, 2]), n(slope, "+.1f")) for name, error, slope in listed]
    slopes = {trend.parameter.name: trend.height_slope for trend in study.trends}
    falling = [name for name, slope in slopes.items() if slope * study.height_line.slope > 1e-6 * abs(slope)]
    return finding(
        "one-parameter-off",
        numbers={"height_slope_mm_per_m": slopes, "measured_slope_mm_per_m": 1e3 * study.height_line.slope},
        panels=(
            draw.panel(figure, "Measured vertical errors over height, and trends that single parameters predict."),
            draw.panel(second, "Trends of the other parameters."),
        ),
        data=(
            Table(
                "Predicted vertical error [mm] at the ten poses, and its slope over height [mm/m]",
                ("off by", *study.table.points, "slope"),
                rows,
            ),
        ),
        stiffer=slopes[study.trends[0].parameter.name],
        falling=", ".join(falling),
    )


def _typical(parameter: Parameter) -> str:
    """Text of a parameter with its typical error."""
    return f"{parameter.name} {n(parameter.typical, '+g', parameter.unit)}"


def _span(values: Array, form: str) -> str:
    return f"{n(values.min(), form)} to {n(values.max(), form)}"
