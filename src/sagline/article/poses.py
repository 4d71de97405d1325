"""Chapter about Table 2 and figures 25 to 27, and about possible causes of the errors of Table 2."""

from __future__ import annotations

from typing import Any

import numpy as np

from sagline.article import explanations as causes
from sagline.article.drawing import Drawing, axes, cables_over_time, chapter, error_panels, finding
from sagline.article.regressions import fit_line
from sagline.article.ten_poses import TenPoses, tour
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, COLORS, LINE_STYLES, VERMILLION
from sagline.present.page import Chapter, Finding, Table, table_of

AREA = 2e4  # area of a circle that shows an error, per meter of the error [pt^2/m]


def poses_chapter() -> Chapter:
    """Chapter about the ten poses of the prototype, and about possible causes of their errors."""
    study = TenPoses()
    last = [find(study) for find in (_space, _trends, _best_explanations, _limits_of_ten_points)]
    return chapter("poses", [_table(study), _single_causes(study), _tour(), *last])


def _table(study: TenPoses) -> Finding:
    table, plan = study.table, study.plan
    difference = np.abs(table.distance - table.printed_error).max()
    model = np.linalg.norm(study.model_error, axis=1).max()
    shown = table_of(
        "The ten poses, with their plan by sagline",
        ("pose", table.points, ""),
        ("desired x, y, z [m]", [", ".join(n(x, ".2f") for x in place) for place in table.desired], ""),
        ("error x, y, z [mm]", [", ".join(n(1e3 * x, ".0f") for x in error) for error in table.error], ""),
        ("distance [mm]", 1e3 * table.distance, ".4f"),
        ("printed [mm]", 1e3 * table.printed_error, ".4f"),
        ("L planned [m]", [_span(each, ".3f") for each in plan.unstrained_length], ""),
        ("tension at the winch [N]", [_span(each, ".0f") for each in plan.state.cables.frame_end_tension], ""),
    )
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
        data=(shown,),
    )


def _tour() -> Finding:
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
        figure = cables_over_time(path.time, values, label, 0.9, stops=stops.tolist())
        panels.append((figure, caption))
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


def _space(study: TenPoses) -> Finding:
    table = study.table
    caption = "The poses in the {}-z plane; areas show the positioning errors."
    panels = error_panels(table.points, table.desired, [("", table.distance, AREA, BLUE)], caption)
    height, rise = table.desired[:, 2], 1e3 * table.error[:, 2]
    slope, intercept = fit_line(height, rise)
    figure, ax = axes("$z$ desired [m]", "vertical error [mm]")
    ax.plot(height, rise, "o", color=BLUE, markersize=4.0, label="measured")
    ends = np.array([height.min(), height.max()])
    ax.plot(ends, slope * ends + intercept, color="black", linewidth=0.9, label="line")
    panels.append((figure, "Actual minus desired height of the platform."))
    tension = study.plan.horizontal_tension.mean(axis=1)
    against = float(np.corrcoef(tension, table.distance)[0, 1])
    return finding(
        "error-in-space",
        numbers={
            "slope_mm_per_m": slope,
            "r_squared": np.corrcoef(height, rise)[0, 1] ** 2,
            "correlation_with_tension": against,
            "lowest_vertical_error_mm": rise.min(),
        },
        panels=panels,
        fall=-slope,
    )


def _trends(study: TenPoses) -> Finding:
    height = study.table.desired[:, 2]
    pairs = [axes("$z$ desired [m]", "vertical error [mm]") for _ in range(2)]
    for _, ax in pairs:
        ax.plot(height, 1e3 * study.table.error[:, 2], "ko", markersize=4.0, label="measured")
    fine = np.array([height.min(), height.max()])
    slopes = {name: study.height_slope(error) for name, error in study.trends.items()}
    listed = []
    for k, parameter in enumerate(causes.PARAMETERS):
        ax, error = pairs[k // 5][1], study.trends[parameter.name]
        label = f"{parameter.name} {n(parameter.typical, '+g', parameter.unit)}"
        slope, intercept = fit_line(height, 1e3 * error[:, 2])
        look = {"color": COLORS[k % 5], "linestyle": LINE_STYLES[k % 5]}
        ax.plot(fine, slope * fine + intercept, **look, linewidth=1.2, label=label)
        listed.append((label, error, slopes[parameter.name]))
    for _, ax in pairs:
        ax.set_ylim(-25.0, 85.0)
    measured = study.height_slope(study.table.error)
    listed.append(("measured", study.table.error, measured))
    rows = [(name, *(n(1e3 * z, ".1f") for z in error[:, 2]), n(slope, "+.1f")) for name, error, slope in listed]
    falling = [name for name, slope in slopes.items() if slope * measured > 1e-3 * abs(slope)]
    captions = (
        "Measured vertical errors over height, and trends that single parameters predict.",
        "Trends of the other parameters.",
    )
    shown = Table(
        "Predicted vertical error [mm] at the ten poses, and its slope over height [mm/m]",
        ("off by", *study.table.points, "slope"),
        rows,
    )
    return finding(
        "one-parameter-off",
        numbers={"height_slope_mm_per_m": slopes, "measured_slope_mm_per_m": measured},
        panels=[(figure, caption) for (figure, _), caption in zip(pairs, captions, strict=True)],
        data=(shown,),
        stiffer=slopes[causes.MODULUS],
        falling=", ".join(falling),
    )


def _span(values: Array, form: str) -> str:
    return f"{n(values.min(), form)} to {n(values.max(), form)}"


COUNTS = ("one parameter", "two parameters", "three parameters")
SHOWN = 8  # number of table rows for explanations by two parameters, and for explanations by three
FEW = 6e-3  # largest remaining error of a good explanation [m]
PRINTING = 1e-3 / np.sqrt(12.0)  # standard deviation of the rounding of positions to whole millimeters [m]
NOTHING = 0.95  # a model explains nothing if its remaining error exceeds this share of the measured error
ALIKE = 0.2  # a slope over height counts as zero if it is less than this share of the measured slope
AS_MEASURED = 0.15  # largest relative difference of a slope that counts as equal to the measured slope
LOWEST, HIGHEST = "P8", "P7"


def _best_explanations(study: TenPoses) -> Finding:
    """Finding about the best explanations of the measured errors by one, two and three parameters."""
    one, two, three = (study.best(count) for count in (1, 2, 3))
    second = study.explanations[1][1]
    alone = {found.parameters[0].name: found for found in study.explanations[0]}
    beside = {
        name: study.explanation(causes.ZERO, causes.PULLEY, name) for name in (causes.DEAD, causes.MODULUS, causes.LOAD)
    }
    places = [(beside[name], beside[name].place(name)) for name in (causes.MODULUS, causes.LOAD)]
    ratios = [abs(found.values[k]) / found.deviation[k] for found, k in places]  # from zero error, in deviations
    far = float(np.ceil(10.0 * max(ratios))) / 10.0
    inside = min(found.aicc for found in study.explanations[2] if not found.at_limit.any())
    count = sum(len(group) for group in study.explanations)
    return finding(
        "explanations",
        numbers={
            "models": count,
            "measured_rms_mm": 1e3 * study.measured_rms,
            "explanations": [[_numbers(found) for found in group] for group in study.explanations],
            "three_inside_aicc_above_best_two": inside - two.aicc,
            "second_two_aicc_above_best_two": second.aicc - two.aicc,
            "modulus_and_load_within_deviations": far,
        },
        panels=tuple(_panel(study, study.best(k + 1), name) for k, name in enumerate(COUNTS)),
        data=(_table_of_explanations(study),),
        one=one,
        two=two,
        three=three,
        second=second,
        dead_cable=beside[causes.DEAD].value(causes.DEAD),
        modulus=beside[causes.MODULUS].value(causes.MODULUS),
        load=beside[causes.LOAD].value(causes.LOAD),
        modulus_alone=alone[causes.MODULUS],
        density_alone=alone[causes.DENSITY],
    )


def _limits_of_ten_points(study: TenPoses) -> Finding:
    """Finding about parameters that the measured errors of ten poses cannot separate or determine."""
    few = [found for found in study.explanations[1] if found.rms < FEW]
    named = all(found.names & {causes.PULLEY, causes.ANCHORS} for found in few)
    zeros = 1e3 * study.single_zero
    shown = Table(
        "Standard deviation of the zero offset of each cable, if it is estimated from ten points",
        ("", *(f"cable {i}" for i in range(zeros.size))),
        [("zero offset of its length [mm]", *(n(x, ".0f") for x in zeros))],
    )
    return finding(
        "ten-points",
        numbers={
            "printing_rms_mm": 1e3 * PRINTING,
            "pulley_imitated_by_zero_and_anchor_height": study.imitated,
            "single_zero_deviation_mm": zeros,
            "few_mm": 1e3 * FEW,
            "pairs_that_leave_few": len(few),
            "pairs": len(study.explanations[1]),
            "best_two_over_printing": study.best(2).rms / PRINTING,
            "pulley_or_anchor_height_in_all_of_them": named,
        },
        data=(shown,),
        every="Every" if named else "Not every",
        least_zero=zeros.min(),
        largest_zero=zeros.max(),
    )


def _table_of_explanations(study: TenPoses) -> Table:
    shown = [group if k == 0 else group[:SHOWN] for k, group in enumerate(study.explanations)]
    rest = study.table.error - study.model_error
    rms, worst = float(np.sqrt(np.mean(rest**2))), float(np.linalg.norm(rest, axis=1).max())
    found = [("nothing off", rms, worst, rms, causes.corrected_aic(rms, rest.size, 0))]
    found += [(one.text, one.rms, one.worst, one.left_out, one.aicc) for group in shown for one in group]
    return Table(
        f"No parameter, one parameter, and the best {SHOWN} with two and with three; in parentheses: uncertainty",
        ("off by", "remaining, rms [mm]", "remaining, worst pose [mm]", "left-out pose, rms [mm]", "AICc"),
        [
            (text, n(1e3 * left, ".2f"), n(1e3 * far, ".1f"), n(1e3 * out, ".2f"), n(aicc, ".1f"))
            for text, left, far, out, aicc in found
        ],
    )


def _panel(study: TenPoses, found: causes.Explanation, count: str) -> Drawing:
    figure, ax = axes("$z$ desired [m]", "error [mm]")
    height = study.table.desired[:, 2]
    for axis, name, color, marker in ((2, "z", VERMILLION, "o"), (1, "y", BLUE, "s")):
        ax.plot(height, 1e3 * study.table.error[:, axis], marker, color=color, markersize=4.5, label=f"{name} measured")
        look: dict[str, Any] = {"color": color, "markersize": 7.0, "markerfacecolor": "none"}
        ax.plot(height, 1e3 * found.predicted[:, axis], marker, **look, label=f"{name} explained")
    return figure, f"Best explanation by {count}: {found.text}."


def _numbers(found: causes.Explanation) -> dict[str, Any]:
    names = [parameter.name for parameter in found.parameters]
    return {
        "values": dict(zip(names, found.values, strict=True)),
        "deviations": dict(zip(names, found.deviation, strict=True)),
        "at_limit": [name for name, limit in zip(names, found.at_limit, strict=True) if limit],
        "rms_mm": 1e3 * found.rms,
        "worst_mm": 1e3 * found.worst,
        "left_out_rms_mm": 1e3 * found.left_out,
        "aicc": found.aicc,
    }


def _single_causes(study: TenPoses) -> Finding:
    """Finding about each parameter alone: typical effect, best value, remaining error, and reason for this error."""
    ranked = study.explanations[0]
    alone = {found.parameters[0].name: found for found in ranked}
    slopes = {name: study.height_slope(found.predicted) for name, found in alone.items()}
    measured = study.height_slope(study.table.error)
    falling = [name for name in slopes if abs(slopes[name] - measured) <= AS_MEASURED * abs(measured)]
    none = [one.parameters[0].name for one in ranked if one.rms > NOTHING * study.measured_rms]
    pair, low, high = study.best(2), study.table.points.index(LOWEST), study.table.points.index(HIGHEST)
    dead, error = 1e3 * study.dead_meter[:, 2], 1e3 * study.table.error[:, 2]
    names = " and ".join(sorted(parameter.name for parameter in pair.parameters))
    return finding(
        "classes",
        numbers={
            "measured_rms_mm": 1e3 * study.measured_rms,
            "measured_slope_mm_per_m": measured,
            "left_mm": {name: 1e3 * found.rms for name, found in alone.items()},
            "slope_of_best_mm_per_m": slopes,
            "two_left_mm": 1e3 * pair.rms,
            "dead_meter_mm": {LOWEST: dead[low], HIGHEST: dead[high]},
            "measured_mm": {LOWEST: error[low], HIGHEST: error[high]},
            "explain_nothing": none,
            "fall_as_measured": falling,
        },
        data=(_table_of_classes(study, alone, slopes),),
        fall=-measured,
        falling=_listed(falling),
        pulley=alone[causes.PULLEY],
        anchors_name=causes.ANCHORS,
        anchors=alone[causes.ANCHORS],
        names=names,
        no_cause=_listed(none),
    )


def _table_of_classes(study: TenPoses, alone: dict[str, causes.Explanation], slopes: dict[str, float]) -> Table:
    head = ["off", "for example", "mean displacement [mm]", "best value", "slope [mm/m]"]
    measured = (study.height_slope(study.table.error), "+.1f"), (1e3 * study.measured_rms, ".1f")
    return Table(
        "Single imperfections; the best value is the plausible value that agrees best with Table 2",
        [*head, "remaining error, rms [mm]", "remark"],
        [_row(study, found, slopes[name]) for name, found in alone.items()]
        + [("as measured", "", "", "", *(n(value, form) for value, form in measured), "")],
    )


def _row(study: TenPoses, found: causes.Explanation, slope: float) -> tuple[str, ...]:
    parameter, limit = found.parameters[0], " (limit)" if found.at_limit[0] else ""
    return (
        parameter.name,
        n(parameter.typical, "+g", parameter.unit),
        n(1e3 * np.linalg.norm(study.trends[parameter.name], axis=1).mean(), ".1f"),
        f"{n(found.values[0], '+.3g', parameter.unit)}{limit}",
        n(slope, "+.1f"),
        n(1e3 * found.rms, ".1f"),
        _remark(study, found, slope),
    )


def _remark(study: TenPoses, found: causes.Explanation, slope: float) -> str:
    measured = study.height_slope(study.table.error)
    if found.rms > NOTHING * study.measured_rms:
        return "explains nothing"
    if abs(slope - measured) <= AS_MEASURED * abs(measured):
        return "decreases with height as measured"
    if found.at_limit[0]:
        return "too small, even at the limit"
    if abs(slope) <= ALIKE * abs(measured):
        return "raises all poses equally"
    return (
        "increases with height, which is opposite to the measurement"
        if slope * measured < 0.0
        else "decreases with height, with another slope"
    )


def _listed(names: list[str]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} and {names[-1]}"
