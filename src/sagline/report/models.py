"""Chapter: which cable model is good enough where."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm

from sagline.arrays import Array
from sagline.article.errata_cables import simulated_cable
from sagline.article.model_errors import MODELS, ModelErrors, model_errors
from sagline.article.sampling import GRAVITY
from sagline.plot.sheet import COLORS, LABEL, TICK, Sheet
from sagline.report.blocks import Chapter, Finding, Panel, Table, Verdict, n
from sagline.report.drawing import Drawings, axes, legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CHORDS = np.geomspace(1.0, 30.0, 41)  # m
TENSIONS = np.geomspace(5.0, 2000.0, 61)  # N
ANGLES = np.radians(np.linspace(-85.0, 0.0, 31))  # suspended: the platform end is below the frame end
DENSITIES = np.geomspace(0.01, 1.0, 31)  # kg/m
TOLERANCE = 1e-3  # m
FLOOR = 1e-6  # m: errors below a micrometer are drawn as one
REFERENCE = {"chord": 10.0, "angle": float(np.radians(-30.0)), "density": 0.067, "tension": 100.0}
USES = ((3.0, 300.0), (10.0, 300.0), (10.0, 50.0), (10.0, 15.0), (25.0, 100.0))  # chord [m], tension [N] of the table


def models_chapter() -> Chapter:
    """The page an engineer opens to decide which model a controller needs."""
    cable = simulated_cable()
    draw = Drawings("models")
    return Chapter(
        "models",
        "How good each model is, and where",
        f"Lengths by the five cable models against the exact one, at the same horizontal tension. EA = "
        f"{n(1e-3 * cable.axial_stiffness)} kN (simulation), cables that hang down from the frame end. Where not "
        f"varied: chord {n(REFERENCE['chord'])} m, 30° below level, {n(REFERENCE['density'])} kg/m, chord tension "
        f"{n(REFERENCE['tension'])} N.",
        (_maps(draw), _sufficient(draw), _slices(draw), _examples()),
    )


def _name(model: object) -> str:
    return type(model).__name__


def _study(**varied: Array) -> ModelErrors:
    """Errors with the given quantities varied and the others at their reference."""
    at = (varied.get(name, np.array([REFERENCE[name]])) for name in ("chord", "angle", "density", "tension"))
    return model_errors(float(simulated_cable().axial_stiffness), *at)


def _maps(draw: Drawings) -> Finding:
    study = _study(chord=CHORDS, tension=TENSIONS)
    errors = np.abs(study.length_error[:-1, :, 0, 0, :])
    names = [_name(model) for model in study.models[:-1]]
    within = {name: float(np.mean(error <= TOLERANCE)) for name, error in zip(names, errors, strict=True)}
    return Finding(
        key="length-error-maps",
        title="length error over chord and tension",
        statement="",
        measured="Within 1 mm of the exact length, of the points of this map: "
        + ", ".join(f"{name} {n(100 * share, '.3g')} %" for name, share in within.items())
        + ". Where the straight cable seems good for a moment, stretch and sag cancel.",
        verdict=Verdict.OURS,
        numbers={"share_within_1_mm": within},
        panels=tuple(_map(error, f"{name}: length error.", draw) for name, error in zip(names, errors, strict=True)),
    )


def _map(error: Array, caption: str, draw: Drawings) -> Panel:
    figure, ax = _wide("chord tension [N]", "chord [m]")
    shown, norm = np.maximum(1e3 * error, 1e3 * FLOOR), LogNorm(1e3 * FLOOR, 1e3)
    mesh = ax.pcolormesh(TENSIONS, CHORDS, shown, norm=norm, cmap="magma_r", shading="nearest", rasterized=True)
    lines = ax.contour(TENSIONS, CHORDS, 1e3 * error, levels=[0.1, 1.0, 10.0], colors="black", linewidths=0.7)
    ax.clabel(lines, fmt=lambda level: f"{level:g} mm", fontsize=TICK - 1.0)
    _logarithmic(ax)
    bar = figure.colorbar(mesh, ax=ax, pad=0.02)
    bar.set_label("length error [mm]", fontsize=LABEL - 1.0)
    bar.ax.tick_params(labelsize=TICK - 1.0)
    return draw.panel(figure, caption)


def _sufficient(draw: Drawings) -> Finding:
    over_chord = _study(chord=CHORDS, tension=TENSIONS).sufficient(TOLERANCE)[:, 0, 0, :]
    over_density = _study(density=DENSITIES, tension=TENSIONS).sufficient(TOLERANCE)[0, 0]
    over_angle = _study(angle=ANGLES, tension=TENSIONS).sufficient(TOLERANCE)[0, :, 0, :]
    names = [_name(model) for model in MODELS]
    shares = {name: float(np.mean(over_chord == k)) for k, name in enumerate(names)}
    return Finding(
        key="sufficient-model",
        title="the coarsest model that is good to a millimeter",
        statement="",
        measured="The straight cable never knows its stretch; the elastic one fails where cables are long, heavy or "
        "loose; the empirical and the parabolic one fill the gap to the exact model, which "
        f"{n(100 * shares['Catenary'], '.2g')} % of the first map needs for 1 mm.",
        verdict=Verdict.OURS,
        numbers={"share_of_map": shares},
        panels=(
            _choice("chord [m]", CHORDS, over_chord, "Over chord and tension.", draw),
            _choice("linear density [kg/m]", DENSITIES, over_density, "Over density and tension.", draw),
            _choice("angle below level [°]", -np.degrees(ANGLES), over_angle, "Over angle and tension.", draw),
        ),
    )


def _choice(label: str, heights: Array, enough: Array, caption: str, draw: Drawings) -> Panel:
    names = [_name(model) for model in MODELS]
    colors = [matplotlib.colormaps["viridis_r"](0.9 * k / (len(names) - 1)) for k in range(len(names))]
    figure, ax = _wide("chord tension [N]", label)
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    mesh = ax.pcolormesh(
        TENSIONS, heights, enough, cmap=ListedColormap(colors), norm=norm, shading="nearest", rasterized=True
    )
    if heights is CHORDS:
        _logarithmic(ax)
    else:
        ax.set_xscale("log")
        ax.set_yscale("log" if heights is DENSITIES else "linear")
    bar = figure.colorbar(mesh, ax=ax, ticks=range(len(names)), pad=0.02)
    bar.ax.set_yticklabels(names, fontsize=TICK - 0.5)
    bar.ax.tick_params(length=0.0)
    return draw.panel(figure, caption)


def _wide(x: str, y: str) -> tuple[Sheet, Axes]:
    """Axes with room for a color bar."""
    figure, ax = axes(x, y)
    figure.subplots_adjust(left=0.13, right=0.9)
    return figure, ax


def _slices(draw: Drawings) -> Finding:
    names = {
        "chord": "chord [m]",
        "angle": "angle below level [°]",
        "density": "linear density [kg/m]",
        "tension": "chord tension [N]",
    }
    courses = {
        "chord": CHORDS,
        "angle": np.radians(np.linspace(-89.0, 0.0, 45)),
        "density": np.geomspace(0.005, 1.0, 40),
        "tension": TENSIONS,
    }
    panels, worst = [], {}
    for quantity, course in courses.items():
        study = _study(**{quantity: course})
        figure, ax = axes(names[quantity], "length error [mm]")
        error = 1e3 * np.maximum(np.abs(study.length_error).reshape(len(study.models), -1), FLOOR)
        x = -np.degrees(course) if quantity == "angle" else course
        for model, row, color in zip(study.models[:-1], error, COLORS, strict=False):
            ax.plot(x, row, color=color, linewidth=1.3, label=_name(model))
        ax.axhline(1e3 * TOLERANCE, color="0.6", linewidth=0.7, linestyle=":")
        ax.set_yscale("log")
        if quantity != "angle":
            ax.set_xscale("log")
        legend(ax, columns=2, loc="lower right" if quantity == "chord" else "lower left")
        panels.append(draw.panel(figure, f"Over the {names[quantity].split(' [')[0]}."))
        worst[quantity] = {_name(model): float(row.max()) for model, row in zip(study.models[:-1], error, strict=False)}
    return Finding(
        key="length-error-slices",
        title="length error over each quantity alone",
        statement="",
        measured="Along these lines the largest errors of the empirical model are "
        + ", ".join(f"{n(worst[q]['Empirical'], '.2g')} mm over the {q}" for q in worst)
        + "; of the parabolic one "
        + ", ".join(f"{n(worst[q]['Parabolic'], '.2g')}" for q in worst)
        + " mm. The exact model is the zero they are measured from.",
        verdict=Verdict.OURS,
        numbers={"largest_error_mm": worst},
        panels=tuple(panels),
    )


def _examples() -> Finding:
    density = REFERENCE["density"]
    rows, numbers = [], []
    for chord, tension in USES:
        study = _study(chord=np.array([chord]), tension=np.array([tension]))
        length, force = (1e3 * study.length_error.ravel(), study.force_error.ravel())
        weight = density * GRAVITY * chord
        rows.append(
            (f"{n(chord)} m, {n(tension)} N, wD/τ = {n(weight / tension, '.2g')}", *(n(x, "+.2g") for x in length[:-1]))
        )
        numbers.append(
            {
                "chord_m": chord,
                "tension_N": tension,
                "length_error_mm": dict(zip(map(_name, study.models), length, strict=True)),
                "force_error_N": dict(zip(map(_name, study.models), force, strict=True)),
            }
        )
    names = [_name(model) for model in study.models[:-1]]
    return Finding(
        key="model-examples",
        title="five cables as examples",
        statement="",
        measured="Errors in length [mm] at the same horizontal tension; "
        f"{n(-np.degrees(REFERENCE['angle']))}° below level. As a rule wD/τ decides: the "
        "sag term is D (wD cos φ/τ)²/24, what the shallow models leave out is smaller by that square again.",
        verdict=Verdict.OURS,
        numbers={"angle_below_level_deg": -np.degrees(REFERENCE["angle"]), "examples": numbers},
        data=(Table("Length less the exact one [mm]", ("cable", *names), rows),),
    )


def _logarithmic(ax: Axes) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_yticks([1, 2, 5, 10, 20], labels=["1", "2", "5", "10", "20"])
    ax.minorticks_off()
    ax.grid(visible=False)
