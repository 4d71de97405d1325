"""Findings about possible causes of the errors of Table 2, alone and combined, and about the limits of ten poses."""

from __future__ import annotations

from typing import Any

import numpy as np

from sagline.article.drawing import Drawings, axes, legend_above
from sagline.article.explanations import Explanation, corrected_aic
from sagline.article.machine import ANCHORS, DEAD, DENSITY, LOAD, MODULUS, PULLEY, ZERO
from sagline.article.sampling import fit_line
from sagline.article.ten_poses import TenPoses, Trend
from sagline.article.texts import finding
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, VERMILLION
from sagline.present.page import Finding, Panel, Table

COUNTS = ("one parameter", "two parameters", "three parameters")
SHOWN = 8  # number of rows with two parameters, and with three, in the table of explanations
FEW = 6e-3  # an explanation is good if its remaining error is at most this [m]
PRINTING = 1e-3 / np.sqrt(12.0)  # standard deviation of the rounding of positions to whole millimeters [m]
NOTHING = 0.95  # a model explains nothing if its remaining error exceeds this share of the measured error
ALIKE = 0.2  # a slope over height counts as zero below this share of the measured slope
AS_MEASURED = 0.15  # a slope counts as equal to the measured slope below this relative difference
LOWEST, HIGHEST = "P8", "P7"


def best_explanations(study: TenPoses, draw: Drawings) -> Finding:
    """Finding: the best explanations, and the benefit of more parameters."""
    one, two, three = (study.best(count) for count in (1, 2, 3))
    second = study.explanations[1][1]
    alone = {found.parameters[0].name: found for found in study.explanations[0]}
    beside = {name: study.explanation(ZERO, PULLEY, name) for name in (DEAD, MODULUS, LOAD)}
    ratios = [_ratio(beside[name], name) for name in (MODULUS, LOAD)]
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
        panels=tuple(_panel(study, study.best(k + 1), name, draw) for k, name in enumerate(COUNTS)),
        data=(_table(study),),
        one=one,
        two=two,
        three=three,
        second=second,
        one_values=_values(one),
        two_values=_values(two),
        three_values=_values(three),
        dead_cable=_told(beside[DEAD], DEAD),
        modulus=_told(beside[MODULUS], MODULUS),
        load=_told(beside[LOAD], LOAD),
        modulus_alone=alone[MODULUS],
        density_alone=alone[DENSITY],
        second_values=_values(second),
    )


def limits_of_ten_points(study: TenPoses) -> Finding:
    """Finding: limits of ten points, and the parameters that ten points cannot separate."""
    few = [found for found in study.explanations[1] if found.rms < FEW]
    named = all(found.names & {PULLEY, ANCHORS} for found in few)
    zeros = 1e3 * study.single_zero
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
        data=(
            Table(
                "Standard deviation of the zero offset of each cable, if it is estimated from ten points",
                ("", *(f"cable {i}" for i in range(zeros.size))),
                [("zero offset of its length [mm]", *(n(x, ".0f") for x in zeros))],
            ),
        ),
        every="Every" if named else "Not every",
        least_zero=zeros.min(),
        largest_zero=zeros.max(),
    )


def _table(study: TenPoses) -> Table:
    shown = [group if k == 0 else group[:SHOWN] for k, group in enumerate(study.explanations)]
    rest = study.table.error - study.model_error
    rms, worst = float(np.sqrt(np.mean(rest**2))), float(np.linalg.norm(rest, axis=1).max())
    found = [("nothing off", rms, worst, rms, corrected_aic(rms, rest.size, 0))]
    found += [(_values(one), one.rms, one.worst, one.left_out, one.aicc) for group in shown for one in group]
    return Table(
        f"No parameter, one parameter, and the best {SHOWN} with two and with three; in parentheses: uncertainty",
        ("off by", "remaining, rms [mm]", "remaining, worst pose [mm]", "left-out pose, rms [mm]", "AICc"),
        [
            (text, n(1e3 * left, ".2f"), n(1e3 * far, ".1f"), n(1e3 * out, ".2f"), n(aicc, ".1f"))
            for text, left, far, out, aicc in found
        ],
    )


def _panel(study: TenPoses, found: Explanation, count: str, draw: Drawings) -> Panel:
    figure, ax = axes("$z$ desired [m]", "error [mm]")
    height = study.table.desired[:, 2]
    for axis, name, color, marker in ((2, "z", VERMILLION, "o"), (1, "y", BLUE, "s")):
        ax.plot(height, 1e3 * study.table.error[:, axis], marker, color=color, markersize=4.5, label=f"{name} measured")
        ax.plot(
            height,
            1e3 * found.predicted[:, axis],
            marker,
            color=color,
            markersize=7.0,
            markerfacecolor="none",
            label=f"{name} explained",
        )
    legend_above(ax)
    return draw.panel(figure, f"Best explanation by {count}: {_values(found)}.")


def _numbers(found: Explanation) -> dict[str, Any]:
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


def _values(found: Explanation) -> str:
    return ", ".join(f"{parameter.name} {_told(found, parameter.name)}" for parameter in found.parameters)


def _told(found: Explanation, name: str) -> str:
    """Text of a value with its standard uncertainty, or with a mark if the value is at a limit."""
    k = [parameter.name for parameter in found.parameters].index(name)
    value, unit = found.values[k], found.parameters[k].unit
    if found.at_limit[k]:
        return f"{n(value, '+.3g', unit)} (limit)"
    return n(value, unit=unit, uncertainty=found.deviation[k])


def _ratio(found: Explanation, name: str) -> float:
    """Distance of a value from its nominal value, in standard deviations."""
    k = [parameter.name for parameter in found.parameters].index(name)
    return float(abs(found.values[k]) / found.deviation[k])


def single_causes(study: TenPoses) -> Finding:
    """Finding: each class of parameters alone, with an example, the best value, the remaining error and its reason."""
    ranked = study.explanations[0]
    alone = {found.parameters[0].name: found for found in ranked}
    slopes = {name: _slope(study, found) for name, found in alone.items()}
    measured = 1e3 * float(study.height_line.slope)
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
        pulley=alone[PULLEY],
        anchors_name=ANCHORS,
        anchors=alone[ANCHORS],
        names=names,
        no_cause=_listed(none),
    )


def _table_of_classes(study: TenPoses, alone: dict[str, Explanation], slopes: dict[str, float]) -> Table:
    trends = {trend.parameter.name: trend for trend in study.trends}
    return Table(
        "Single imperfections; the best value is the plausible value that agrees best with Table 2",
        (
            "off",
            "for example",
            "mean displacement [mm]",
            "best value",
            "slope [mm/m]",
            "remaining error, rms [mm]",
            "remark",
        ),
        [_row(trends[name], found, slopes[name], _so(study, found, slopes[name])) for name, found in alone.items()]
        + [
            (
                "as measured",
                "",
                "",
                "",
                n(1e3 * study.height_line.slope, "+.1f"),
                n(1e3 * study.measured_rms, ".1f"),
                "",
            )
        ],
    )


def _row(trend: Trend, found: Explanation, slope: float, told: str) -> tuple[str, ...]:
    parameter, limit = trend.parameter, " (limit)" if found.at_limit[0] else ""
    return (
        parameter.name,
        n(parameter.typical, "+g", parameter.unit),
        n(1e3 * np.linalg.norm(trend.error, axis=1).mean(), ".1f"),
        f"{n(found.values[0], '+.3g', parameter.unit)}{limit}",
        n(slope, "+.1f"),
        n(1e3 * found.rms, ".1f"),
        told,
    )


def _so(study: TenPoses, found: Explanation, slope: float) -> str:
    measured = 1e3 * float(study.height_line.slope)
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


def _slope(study: TenPoses, found: Explanation) -> float:
    """Change of the vertical error with height that an explanation predicts [mm/m]."""
    return float(fit_line(study.table.desired[:, 2], 1e3 * found.predicted[:, 2]).slope)


def _listed(names: list[str]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} and {names[-1]}"
