"""Chapter about the identification of the empirical model and of the material of a cable."""

from __future__ import annotations

import numpy as np

import sagline as sl
from sagline.article.drawing import axes, chapter, draw_errors, finding, map_axes, shades
from sagline.article.identify import EmpiricalFit, identify_empirical
from sagline.article.identify_cable import UNITS, CableFit, identify_cable
from sagline.article.regressions import simulated_cable
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.present.page import Chapter, Finding, Table, table_of

SPANS = np.linspace(1.0, 13.0, 13)  # spans that occur in the simulated robots [m]
RISES = np.linspace(-5.0, 4.0, 10)  # [m]
TENSIONS = np.linspace(20.0, 400.0, 77)  # [N]
TOLERANCES = (1e-3, 2e-3, 5e-3, 10e-3)  # [m]
EDGES, TICKS = np.outer(10.0 ** np.arange(-4.0, -1.0), (1.0, 2.0, 5.0)).ravel(), (1e-4, 1e-3, 1e-2)  # map range [m]
LINES = (1e-3, 5e-3, 1e-2)  # contour lines of the map [m]
SAMPLES, LENGTH_ERROR, TENSION_ERROR, SEED = 60, 1e-3, 1.0, 2020  # standard deviations of lengths [m] and tensions [N]
BOTH = ("linear_density", "axial_stiffness")
CASES = (  # for each set of synthetic measurements: lowest and highest chord tension [N], and the unknowns
    ("loose and taut", 30.0, 600.0, BOTH),
    ("taut only", 300.0, 600.0, BOTH),
    ("loose only", 15.0, 40.0, BOTH),
    ("loose and taut, zero of the encoder unknown", 30.0, 600.0, (*BOTH, "length_offset")),
)


def identify_chapter() -> Chapter:
    """Chapter with results of `identify_empirical` for the simulated cable, and of `identify_cable`."""
    fit = identify_empirical(simulated_cable(), SPANS, RISES, TENSIONS)
    return chapter("identify", (_constants(fit), _limits(fit), _measured()))


def _constants(fit: EmpiricalFit) -> Finding:
    figure, ax = map_axes("$T_x$ [N]", "span [m]")
    draw_errors(ax, fit.tensions, fit.spans, fit.position_error.max(axis=1), EDGES, TICKS, LINES)
    rows = [
        (name, n(estimate.value, ".4f"), f"{n(estimate.low, '.4f')} to {n(estimate.high, '.4f')}", unit)
        for name, estimate, unit in (("k_h", fit.k_h, "m/s²"), ("k_p", fit.k_p, "m²/s⁴"))
    ]
    sampled = f"{len(fit.spans)} spans and {len(fit.tensions)} tensions"
    return finding(
        "empirical-fit",
        numbers={
            "spans_m": SPANS,
            "rises_m": RISES,
            "tensions_N": TENSIONS,
            "k_h": fit.k_h._asdict(),
            "k_p": fit.k_p._asdict(),
            "largest_position_error_m": fit.position_error.max(),
        },
        panels=((figure, f"Position error (20), the largest value over all rises, for {sampled}."),),
        data=(Table("The constants", ("constant", "value", "95 % interval", "unit"), rows),),
        spans_last=SPANS[-1],
        rises_last=RISES[-1],
        tensions_last=TENSIONS[-1],
    )


def _limits(fit: EmpiricalFit) -> Finding:
    figure, ax = axes("lowest $T_x$ [N]", "largest cable weight $wL$ [N]")
    frontier = {}
    for tolerance, color in zip(TOLERANCES, shades(len(TOLERANCES)), strict=True):
        frontier[tolerance] = np.array([fit.weight_max(tolerance, tension) for tension in fit.tensions])
        ax.plot(fit.tensions, frontier[tolerance], color=color, linewidth=1.3, label=n(1e3 * tolerance, unit="mm"))
    caption = "Weight of the heaviest cable over the lowest tension, for four tolerances."
    limits = [
        {"tolerance_m": each, "tension_min_N": fit.tension_min(each), "weight_max_N": fit.weight_max(each)}
        for each in TOLERANCES
    ]
    shown = table_of(
        "Limits that keep the position error (20) below a tolerance",
        ("tolerance", [n(1e3 * each, unit="mm") for each in TOLERANCES], ""),
        ("T_x,min [N]", [limit["tension_min_N"] for limit in limits], ".3g"),
        ("w_max, all tensions [N]", [limit["weight_max_N"] for limit in limits], ".2f"),
        ("w_max, T_x ≥ 100 N [N]", [fit.weight_max(each, 100.0) for each in TOLERANCES], ".2f"),
    )
    return finding(
        "validity-limits", numbers={"limits": limits}, panels=((figure, caption, "position error"),), data=(shown,)
    )


def _measured() -> Finding:
    cable, rows, numbers = simulated_cable(), [], []
    for name, lowest, highest, unknowns in CASES:
        fit = _made_up_fit(cable, lowest, highest, unknowns)
        found = zip(unknowns, fit.values, fit.standard_error, strict=True)
        values = [n(value, unit=UNITS[unknown], uncertainty=error) for unknown, value, error in found]
        values += ["–"] * (3 - len(unknowns))
        tensions, told = f"{name} ({n(lowest)} to {n(highest, unit='N')})", "; ".join(fit.warnings) or "none"
        rows.append((tensions, *values, n(fit.chi_squared, ".2f"), told))
        saved = ("names", "values", "standard_error", "correlation", "warnings")
        numbers.append({"case": name, **{each: getattr(fit, each) for each in saved}})
    head = ("chord tensions", "ρ", "EA", "offset", "χ² per freedom", "warnings")
    return finding(
        "cable-fit",
        numbers={
            "measurements": SAMPLES,
            "linear_density_kg_per_m": cable.linear_density,
            "axial_stiffness_N": cable.axial_stiffness,
            "length_error_m": LENGTH_ERROR,
            "tension_error_N": TENSION_ERROR,
            "cases": numbers,
        },
        data=(Table("Results, with the standard uncertainty of the last digits in parentheses", head, rows),),
    )


def _made_up_fit(cable: sl.Cable, lowest: float, highest: float, unknowns: tuple[str, ...]) -> CableFit:
    """Identify `cable` from synthetic measurements with noise, at chord tensions from `lowest` to `highest` [N]."""
    random = np.random.default_rng(SEED)
    span, rise = random.uniform(2.0, 12.0, SAMPLES), random.uniform(-4.0, 2.0, SAMPLES)
    tension: Array = random.uniform(lowest, highest, SAMPLES)
    state = sl.Catenary().from_tension(cable, span, rise, tension)
    length = state.unstrained_length + random.normal(0.0, LENGTH_ERROR, SAMPLES)
    measured = state.frame_end_tension + random.normal(0.0, TENSION_ERROR, SAMPLES)
    data = span, rise, length, measured
    return identify_cable(*data, length_error=LENGTH_ERROR, tension_error=TENSION_ERROR, unknowns=unknowns)
