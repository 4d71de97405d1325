"""What can be wrong with a machine, class by class: what it does to the ten poses, and whether it fits Table 2."""

from __future__ import annotations

import numpy as np

from sagline.article.explanations import Explanation
from sagline.article.fits import fit_line
from sagline.article.machine import ANCHORS, PULLEY
from sagline.article.ten_poses import TenPoses, Trend
from sagline.core.numbers import n
from sagline.report.blocks import Finding, Table, Verdict

NOTHING = 0.95  # of what was measured: what leaves more explains nothing
ALIKE = 0.2  # of the measured slope over height: less is the same everywhere
AS_MEASURED = 0.15  # of it: nearer is the measured one
LOWEST, HIGHEST = "P8", "P7"


def classes(study: TenPoses) -> Finding:
    """Every class alone: an example of it, its best value, what that leaves, and why."""
    ranked = study.explanations[0]
    alone = {found.parameters[0].name: found for found in ranked}
    slopes = {name: _slope(study, found) for name, found in alone.items()}
    measured = 1e3 * float(study.height_line.slope)
    falling = [name for name in slopes if abs(slopes[name] - measured) <= AS_MEASURED * abs(measured)]
    none = [one.parameters[0].name for one in ranked if one.rms > NOTHING * study.measured_rms]
    pair, low, high = study.best(2), study.table.points.index(LOWEST), study.table.points.index(HIGHEST)
    dead, error = 1e3 * study.dead_meter[:, 2], 1e3 * study.table.error[:, 2]
    names = " and ".join(sorted(parameter.name for parameter in pair.parameters))
    return Finding(
        key="classes",
        title="what each imperfection does, and which fits",
        statement="",
        measured=f"The platform sits too high, most of all where it is low: {n(study.measured_rms * 1e3, '.1f', 'mm')} "
        f"in the root mean square of all coordinates, and {n(-measured, '.1f', 'mm')} less with every meter up. What "
        "explains that must lift the platform, and lift it most near the floor.\n\n"
        f"Alone, only {_listed(falling)} has that slope, but leaves {n(1e3 * alone[PULLEY].rms, '.1f', 'mm')}: it does "
        "nothing at home, where the encoders are set, and lowers the platform above it. "
        f"{ANCHORS.capitalize()} leaves least, {n(1e3 * alone[ANCHORS].rms, '.1f', 'mm')}, but lifts every pose alike. "
        f"Two together do better: {names} leave {n(1e3 * pair.rms, '.1f', 'mm')}.\n\n"
        f"Nothing is explained by {_listed(none)}. Dead cable, which seems likely behind a winch, is refuted: a meter "
        f"of it moves {HIGHEST} by {n(dead[high], '+.0f', 'mm')} where {n(error[high], '+.0f', 'mm')} were measured, "
        f"and {LOWEST} by {n(dead[low], '+.0f', 'mm')} where {n(error[low], '+.0f', 'mm')} were.\n\n"
        "No tension loop mends any of them: it can change only such lengths as leave the platform where it is. "
        "“sagline experiment article --true” drives a machine that is off, and shows it; a calibration mends them.",
        verdict=Verdict.OURS,
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
        data=(_table(study, alone, slopes),),
    )


def _table(study: TenPoses, alone: dict[str, Explanation], slopes: dict[str, float]) -> Table:
    trends = {trend.parameter.name: trend for trend in study.trends}
    return Table(
        "One imperfection at a time; best alone: the value that fits Table 2 best, none beyond what we think plausible",
        ("off", "for example", "moves, mean [mm]", "best alone", "its slope [mm/m]", "leaves, rms [mm]", "so"),
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
        return "falls with height as measured"
    if found.at_limit[0]:
        return "too small, even at the limit"
    if abs(slope) <= ALIKE * abs(measured):
        return "lifts every pose alike"
    return "grows with height: the wrong way" if slope * measured < 0.0 else "falls with height, by another slope"


def _slope(study: TenPoses, found: Explanation) -> float:
    """Change of the vertical error with the height, as an explanation predicts it [mm/m]."""
    return float(fit_line(study.table.desired[:, 2], 1e3 * found.predicted[:, 2]).slope)


def _listed(names: list[str]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{', '.join(names[:-1])} and {names[-1]}"
