"""Chapter about the errors of the five cable models, and about the ranges in which each model is sufficient."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

import sagline as sl
from sagline.article.drawing import Drawing, axes, chapter, draw_errors, finding, logarithmic_with_floor, map_axes
from sagline.article.regressions import GRAVITY, simulated_cable
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import COLORS, LINE_STYLES, TICK
from sagline.present.page import Chapter, Finding, Table

MODELS: tuple[sl.CableModel, ...] = (
    sl.Straight(),
    sl.Elastic(),
    sl.Empirical(),
    sl.Parabolic(),
    sl.Catenary(),
)  # the least accurate model comes first
NAMES = tuple(type(model).__name__ for model in MODELS)
CHORDS = np.geomspace(1.0, 30.0, 41)  # [m]
TENSIONS = np.geomspace(5.0, 2000.0, 61)  # [N]
TOLERANCE = 1e-3  # [m]
FLOOR = 1e-9  # smallest drawn error [m]
EDGES, LINES = 10.0 ** np.arange(-9.0, 1.0), (1e-4, 1e-3, 1e-2)  # filled contours and contour lines of the maps [m]
TICKS = (1e-9, 1e-6, 1e-3, 1.0)  # [m]
FINE_CHORDS, FINE_TENSIONS = np.geomspace(1.0, 30.0, 140), np.geomspace(5.0, 2000.0, 180)  # grid of the maps
FINE_DENSITIES = np.geomspace(0.01, 1.0, 140)  # [kg/m]
FINE_ANGLES = np.radians(np.linspace(-85.0, 0.0, 140))  # [rad], negative: the platform end is below the frame end
REFERENCE = {"chord": 10.0, "angle": float(np.radians(-30.0)), "density": 0.067, "tension": 100.0}
USES = ((3.0, 300.0), (10.0, 300.0), (10.0, 50.0), (10.0, 15.0), (25.0, 100.0))  # table: chord [m], tension [N]


def model_errors(axial_stiffness: float, *axes: ArrayLike) -> tuple[Array, Array]:
    """Errors of L [m] and T_z [N], (5, c, a, r, t), for chords [m], angles [rad], densities [kg/m] and tensions [N]."""
    # All models have the same chord tension. The error of L is therefore the length error at the winch.
    chord, angle, density, tension = np.meshgrid(*axes, indexing="ij")
    cable, span, rise = sl.Cable(density, axial_stiffness), chord * np.abs(np.cos(angle)), chord * np.sin(angle)
    states = [model.from_tension(cable, span, rise, tension, GRAVITY) for model in MODELS]
    exact = states[-1]
    length_error = np.stack([state.unstrained_length - exact.unstrained_length for state in states])
    return length_error, np.stack([state.vertical_force - exact.vertical_force for state in states])


def sufficient_models(length_error: Array, tolerance: float) -> Array:
    """Index of the least accurate model with a length error of at most `tolerance` [m], for each cable."""
    return np.asarray(np.argmax(np.abs(length_error) <= tolerance, axis=0))


def models_chapter() -> Chapter:
    """Chapter about the choice of the cable model in a controller."""
    cable = simulated_cable()
    findings = _maps(), _sufficient(), _slices(), _examples()
    return chapter("models", findings, axial_stiffness=cable.axial_stiffness, reference=REFERENCE)


def _study(**varied: Array) -> tuple[Array, Array]:
    """Errors of all models for the quantities in `varied`; all other quantities have reference values."""
    at = (varied.get(name, np.array([REFERENCE[name]])) for name in ("chord", "angle", "density", "tension"))
    return model_errors(float(simulated_cable().axial_stiffness), *at)


def _maps() -> Finding:
    errors = np.abs(_study(chord=CHORDS, tension=TENSIONS)[0][:-1, :, 0, 0, :])
    drawn = _study(chord=FINE_CHORDS, tension=FINE_TENSIONS)[0][:-1, :, 0, 0, :]
    within = {name: float(np.mean(error <= TOLERANCE)) for name, error in zip(NAMES[:-1], errors, strict=True)}
    return finding(
        "length-error-maps",
        numbers={"share_within_1_mm": within},
        panels=[_map(error, f"{name}: length error.") for name, error in zip(NAMES[:-1], drawn, strict=True)],
        shares=", ".join(f"{name} {n(100 * share, '.3g', '%')}" for name, share in within.items()),
    )


def _map(error: Array, caption: str) -> Drawing:
    figure, ax = map_axes("chord tension [N]", "chord [m]")
    _logarithmic(ax)
    draw_errors(ax, FINE_TENSIONS, FINE_CHORDS, error, EDGES, TICKS, LINES)
    return figure, caption


def _sufficient() -> Finding:
    over_chord = sufficient_models(_study(chord=CHORDS, tension=TENSIONS)[0], TOLERANCE)
    fine = (
        _study(chord=FINE_CHORDS, tension=FINE_TENSIONS)[0][:, :, 0, 0, :],
        _study(density=FINE_DENSITIES, tension=FINE_TENSIONS)[0][:, 0, 0],
        _study(angle=FINE_ANGLES, tension=FINE_TENSIONS)[0][:, 0, :, 0, :],
    )
    shares = {name: float(np.mean(over_chord == k)) for k, name in enumerate(NAMES)}
    return finding(
        "sufficient-model",
        numbers={"share_of_map": shares},
        panels=(
            _choice("chord [m]", FINE_CHORDS, fine[0], "Error over chord and tension."),
            _choice("linear density [kg/m]", FINE_DENSITIES, fine[1], "Error over density and tension."),
            _choice("angle below level [°]", -np.degrees(FINE_ANGLES), fine[2], "Error over angle and tension."),
        ),
    )


def _choice(label: str, heights: Array, errors: Array, caption: str) -> Drawing:
    """Map that shows the least accurate sufficient model; `heights`: values on the vertical axis."""
    colors = matplotlib.colormaps["viridis_r"](0.9 * np.arange(len(NAMES)) / (len(NAMES) - 1))
    figure, ax = map_axes("chord tension [N]", label)
    ax.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, color=colors[-1], zorder=0.5))
    for error, color in zip(errors[-2::-1], colors[-2::-1], strict=True):  # less accurate models are on top
        band = ax.contourf(FINE_TENSIONS, heights, error, levels=[-TOLERANCE, TOLERANCE], colors=[color])
        band.set_rasterized(True)
    if heights is FINE_CHORDS:
        _logarithmic(ax)
    else:
        ax.set_xscale("log")
        ax.set_yscale("log" if heights is FINE_DENSITIES else "linear")
    norm = BoundaryNorm(np.arange(len(NAMES) + 1) - 0.5, len(NAMES))
    scale = matplotlib.cm.ScalarMappable(norm, ListedColormap(colors))
    bar = figure.colorbar(scale, ax=ax, ticks=range(len(NAMES)), pad=0.02)
    bar.ax.set_yticklabels(NAMES, fontsize=TICK)
    bar.ax.tick_params(length=0.0)
    return figure, caption


def _slices() -> Finding:
    courses = {
        "chord": ("chord [m]", CHORDS),
        "angle": ("angle below level [°]", np.radians(np.linspace(-89.0, 0.0, 45))),
        "density": ("linear density [kg/m]", np.geomspace(0.005, 1.0, 40)),
        "tension": ("chord tension [N]", TENSIONS),
    }
    panels, worst = [], {}
    for quantity, (label, course) in courses.items():
        figure, ax = axes(label, "length error [mm]")
        error = 1e3 * np.abs(_study(**{quantity: course})[0]).reshape(len(MODELS), -1)
        x = -np.degrees(course) if quantity == "angle" else course
        ax.set_prop_cycle(linestyle=LINE_STYLES)
        for name, row, color in zip(NAMES[:-1], error, COLORS, strict=False):
            ax.plot(x, row, color=color, linewidth=1.3, label=name)
        ax.axhline(1e3 * TOLERANCE, color="0.6", linewidth=0.7, linestyle=":")
        logarithmic_with_floor(ax, 1e3 * FLOOR, f"below {n(FLOOR, '.3g', 'm')}")
        if quantity != "angle":
            ax.set_xscale("log")
        panels.append((figure, f"Over the {label.split(' [')[0]}."))
        worst[quantity] = {name: float(row.max()) for name, row in zip(NAMES[:-1], error, strict=False)}
    return finding("length-error-slices", numbers={"largest_error_mm": worst}, panels=panels)


def _examples() -> Finding:
    density = REFERENCE["density"]
    rows, numbers = [], []
    for chord, tension in USES:
        errors = _study(chord=np.array([chord]), tension=np.array([tension]))
        length, force = 1e3 * errors[0].ravel(), errors[1].ravel()
        weight = density * GRAVITY * chord
        name = f"{n(chord, unit='m')}, {n(tension, unit='N')}, wD/τ = {n(weight / tension, '.2g')}"
        rows.append((name, *(n(x, "+.2g", "mm") for x in length[:-1])))
        off = {"length_error_mm": length, "force_error_N": force}
        off_by_model = {each: dict(zip(NAMES, values, strict=True)) for each, values in off.items()}
        numbers.append({"chord_m": chord, "tension_N": tension, **off_by_model})
    return finding(
        "model-examples",
        numbers={"angle_below_level_deg": -np.degrees(REFERENCE["angle"]), "examples": numbers},
        data=(Table("Length minus exact length", ("cable", *NAMES[:-1]), rows),),
    )


def _logarithmic(ax: Axes) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_yticks([1, 2, 5, 10, 20], labels=["1", "2", "5", "10", "20"])
    ax.minorticks_off()
