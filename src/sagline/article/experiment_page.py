"""Page about an experiment: Table 2 and figures 25 to 27, compared with the article."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import numpy as np

from sagline import control
from sagline.article.drawing import Drawing, cables_over_time, chapter, error_panels, finding
from sagline.article.experiment import SPEED, STOP, Experiment
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.files.writing import plain
from sagline.plot.sheet import BLUE, VERMILLION
from sagline.present.page import Chapter, Finding, Table, page, table_of, write_page

NAMES = ("experiment.html", "experiment.json")
TITLE = "The experiment, repeated"
NOTATION = (
    "An error is the true position minus the desired position. "
    "The true position of a twin is known; the true position of a prototype must be measured."
)
JERK = 2.0  # duration of the phase with jerk in the article [s]
AREA = 600.0  # area of the circle that shows the largest error [pt^2]


def write_experiment(result: Experiment, folder: Path | str, how: str) -> Path:
    """Write a self-contained HTML page about the experiment, and a JSON file with all numbers of the page."""
    chapter = experiment_chapter(result, how)
    lead = (
        "Gia Luan & Truong Thinh, Appl. Sci. 2020, 10(15), 5318, section 7: home, ten points, home, with a stop at "
        f"each. {how}"
    )
    made = f"Made by sagline {version('sagline')}: sagline experiment article."
    numbers = {finding.key: plain(finding.numbers) for finding in chapter.findings}
    text = page(TITLE, lead, NOTATION, [chapter], None, made, summary=False)
    return write_page(folder, NAMES, text, numbers)[0]


def experiment_chapter(result: Experiment, how: str) -> Chapter:
    """Chapter about the result of an experiment; how: sentence about the machine and its controller."""
    return chapter(
        "experiment", (_stops(result), _cells(result), _lengths(result), _space(result), _run(result)), how=how
    )


def _stops(result: Experiment) -> Finding:
    table = result.table
    worst, ours, theirs = int(np.argmax(result.distance)), 1e3 * result.distance, 1e3 * table.distance
    shown = table_of(
        "The ten points; null-space error: largest tension error of a cable in the null space of the structure matrix",
        ("point", [*table.points, "mean"], ""),
        ("desired x, y, z [m]", [*(_joined(place, ".2f") for place in table.desired), ""], ""),
        ("article: error x, y, z [mm]", [*(_joined(1e3 * error, ".0f") for error in table.error), ""], ""),
        ("article [mm]", [*theirs, theirs.mean()], ".1f"),
        ("ours: error x, y, z [mm]", [*(_joined(1e3 * error, "+.3f") for error in result.error), ""], ""),
        ("ours [mm]", [*(n(each, ".3f") for each in ours), n(ours.mean(), ".4f")], ""),
        ("null-space error [N]", [*result.null_error, ""], ".1f"),
    )
    return finding(
        "stops",
        numbers={
            "error_mm": 1e3 * result.error,
            "distance_mm": ours,
            "mean_mm": ours.mean(),
            "article_distance_mm": 1e3 * table.distance,
            "estimated_m": result.estimated,
            "null_error_N": result.null_error,
            "largest_mm": ours.max(),
            "back_mm": 1e3 * np.linalg.norm(result.back),
        },
        data=(shown,),
        article_least=theirs.min(),
        article_largest=theirs.max(),
        article_mean=theirs.mean(),
        worst_point=table.points[worst],
    )


def _cells(result: Experiment) -> Finding:
    off, cells, early = result.cells - result.planned, result.cells, result.time < JERK
    at_stops = result.tension - result.planned_tension
    return finding(
        "load-cells",
        numbers={
            "least_N": cells.min(),
            "largest_N": cells.max(),
            "off_plan_N": np.abs(off).max(),
            "off_plan_at_first_N": np.abs(off[early]).max(),
            "off_plan_at_stops_N": np.abs(at_stops).max(),
        },
        panels=(_courses(result, cells, "load cells [N]", "Load cells; stops (dashed) take no time here."),),
    )


def _lengths(result: Experiment) -> Finding:
    lengths = result.lengths
    caption = "Lengths from the encoders, minus the lengths at home. The ten stops (dashed) take no time here."
    return finding(
        "encoders",
        numbers={"least_m": lengths.min(), "largest_m": lengths.max()},
        panels=(_courses(result, 1e3 * lengths, "$L - L_{home}$ [mm]", caption),),
    )


def _courses(result: Experiment, values: Array, label: str, caption: str) -> Drawing:
    return (cables_over_time(result.time, values, label, 0.9, "cable {}", result.stops.tolist()), caption)


def _space(result: Experiment) -> Finding:
    table = result.table
    series = [
        (f"{who}, largest {n(1e3 * errors.max(), '.2g', 'mm')}", errors, AREA / errors.max(), color)
        for who, errors, color in (("article", table.distance, VERMILLION), ("ours", result.distance, BLUE))
    ]
    caption = "The points in the {}-z plane; areas show the errors, on separate scales."
    panels = error_panels(table.points, table.desired, series, caption)
    height = table.desired[:, 2]
    slopes = [float(np.polyfit(height, 1e3 * error[:, 2], 1)[0]) for error in (table.error, result.error)]
    return finding("space", numbers={"article_slope_mm_per_m": slopes[0], "slope_mm_per_m": slopes[1]}, panels=panels)


def _run(result: Experiment) -> Finding:
    told = [event for event in result.events if event.kind is not control.EventKind.STATE]
    rows = [
        ("duration", "about 14 min", n(result.duration / 60.0, ".1f", "min")),
        ("samples", "100 a second", "100 a second"),
        (
            "speed of the platform; duration of the stop at each point",
            "“low”; not measured yet",
            f"{SPEED:g} m/s at most, {STOP:g} s",
        ),
        ("the fastest winch", "", n(1e3 * result.winch_speed, ".0f", "mm/s")),
        ("largest distance between true position and set point, in motion", "", n(1e3 * result.farthest, ".2f", "mm")),
        ("largest distance between true and estimated position", "", n(1e3 * result.misjudged, ".2f", "mm")),
        ("share of the time at stops with an active tension loop", "", n(100.0 * result.acting, ".1f", "%")),
        ("largest change of a length at the stops", "", n(1e3 * np.abs(result.correction).max(), ".2f", "mm")),
        ("faults and notes", "", "; ".join(event.text for event in told) or "none"),
    ]
    return finding(
        "run",
        numbers={
            "duration_min": result.duration / 60.0,
            "winch_speed_mm_per_s": 1e3 * result.winch_speed,
            "farthest_mm": 1e3 * result.farthest,
            "misjudged_mm": 1e3 * result.misjudged,
            "acting_share": result.acting,
            "correction_mm": 1e3 * np.abs(result.correction).max(),
            "faults_and_notes": len(told),
        },
        data=(Table("The run", ("", "article", "ours"), rows),),
        notes=len(told) or "no",
    )


def _joined(values: Array, form: str) -> str:
    return ", ".join(n(each, form) for each in values)
