"""`sagline identify`: linear density, stiffness and empirical model of a measured cable."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import Output, TextTable, number_text, values_of
from sagline.cli.terminal import show_json, show_note, show_text, working
from sagline.core.numbers import n

if TYPE_CHECKING:
    from sagline.files.table import Measurements


PLACES = ("frame-end", "platform-end", "chord")
STEPS = 25  # number of samples along each axis of the working range
TABLE = "-cable.csv"
TOLERANCE = 5e-3  # position error that the printed range keeps [m]; the article states 6 mm


def identify(
    file: Path = opt.argument(opt.NEEDED, "CSV", "Columns span, rise, length, tension. Units in the heads: span [mm]."),
    length_error: float = opt.quantity(
        0.001, "LENGTH", "Standard error of a measured length, 0.002 or '2 mm'.", "m", above=0.0
    ),
    tension_error: float = opt.quantity(
        1, "FORCE", "Standard error of a measured tension, 5 or '5 N'.", "N", above=0.0
    ),
    tension_at: str = opt.choice("frame-end", "PLACE", "Place of the tension measurement", PLACES),
    offset: bool = opt.flag(
        False, "Estimate the zero offset of the measured lengths as a further parameter.", "--offset/--no-offset"
    ),
    files: opt.Files = opt.TABLE_FILES,
) -> None:
    """Estimate the linear density, the axial stiffness and the empirical model of a measured cable.

    Large standard errors and warnings show which parameters are weakly identifiable.

    For example:

        sagline identify cable.csv
        sagline identify cable.csv --length-error "2 mm" --tension-at platform-end --offset
    """
    from sagline.article.identify_cable import UNITS

    output = Output(files, file.stem, (), (), TABLE)
    data = sl.load_measurements(file)
    with working(f"{file.name}: identifying"):
        cable = sl.identify_cable(
            *data,
            length_error=length_error,
            tension_error=tension_error,
            tension_at=cast(Any, tension_at.replace("-", "_")),
            unknowns=["linear_density", "axial_stiffness", *["length_offset"] * offset],
        )
        model = _model(cable, data)
    numbers = zip(cable.names, cable.values, cable.standard_error, strict=True)
    rows = [(name, float(value), float(error), UNITS[name]) for name, value, error in numbers]
    for name, estimate, unit in (("k_h", model.k_h, "m/s²"), ("k_p", model.k_p, "m²/s⁴")):
        rows.append((name, estimate.value, estimate.high - estimate.value, unit))
    output.table(TABLE, lambda: [("name", "value", "standard error", "unit"), *rows])
    if files.as_json:
        show_json(_record(cable, model))
        return
    texts = [[name, number_text(value, ".5g"), number_text(error, ".2g"), unit] for name, value, error, unit in rows]
    verdict = f"chi-squared per degree of freedom: {number_text(cable.chi_squared, '.3g')}"
    title = f"{len(data.span)} measurements"
    grid = TextTable(["", "value", "standard error", "unit"], texts, title, left=frozenset({0, 3}))
    grid.show(f"{verdict} (about 1 if the standard errors are right)")
    show_text(
        f"The empirical model with k_h, k_p has position errors below {n(1e3 * TOLERANCE, 'g', 'mm')} in the "
        f"measured range if T_x is above {n(model.tension_min(TOLERANCE), '.3g', 'N')}."
    )
    output.show()
    for warning in cable.warnings:
        show_note("Warning: ", warning, style="bold yellow")


def _model(cable: sl.CableFit, data: Measurements) -> sl.EmpiricalFit:
    """The empirical model over the measured range of spans, rises and tensions."""
    horizontal = data.tension * data.span / np.hypot(data.span, data.rise)
    spans, rises, tensions = (np.linspace(each.min(), each.max(), STEPS) for each in (data.span, data.rise, horizontal))
    return sl.identify_empirical(cable.cable, spans, rises, tensions)


def _record(cable: sl.CableFit, model: sl.EmpiricalFit) -> dict[str, Any]:
    return {
        "values": dict(zip(cable.names, cable.values, strict=True)),
        "standard_errors": dict(zip(cable.names, cable.standard_error, strict=True)),
        **values_of(cable, "covariance", "correlation", "chi_squared", "warnings"),
        "empirical": {
            "k_h": model.k_h._asdict(),
            "k_p": model.k_p._asdict(),
            "tolerance_m": TOLERANCE,
            "tension_min_N": model.tension_min(TOLERANCE),
            "weight_max_N": model.weight_max(TOLERANCE),
        },
    }
