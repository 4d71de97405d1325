"""Errors of the five cable models, and the ranges in which they are sufficient."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

import sagline as sl
from sagline.article.drawing import Drawings, axes, draw_errors, legend_above, logarithmic_with_floor, map_axes
from sagline.article.identify import end_position_error
from sagline.article.sampling import GRAVITY, simulated_cable
from sagline.article.texts import chapter, finding
from sagline.core.arrays import Array, checked
from sagline.core.numbers import n
from sagline.plot.sheet import COLORS, LINE_STYLES, TICK
from sagline.present.page import Chapter, Finding, Panel, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MODELS: tuple[sl.CableModel, ...] = (
    sl.Straight(),
    sl.Elastic(),
    sl.Empirical(),
    sl.Parabolic(),
    sl.Catenary(),
)  # from the least to the most accurate model
CHORDS = np.geomspace(1.0, 30.0, 41)  # [m]
TENSIONS = np.geomspace(5.0, 2000.0, 61)  # [N]
TOLERANCE = 1e-3  # [m]
FLOOR = 1e-9  # smallest drawn error [m]
EDGES, LINES = 10.0 ** np.arange(-9.0, 1.0), (1e-4, 1e-3, 1e-2)  # filled contours and contour lines of the maps [m]
TICKS = (1e-9, 1e-6, 1e-3, 1.0)  # [m]
FINE_CHORDS, FINE_TENSIONS = np.geomspace(1.0, 30.0, 140), np.geomspace(5.0, 2000.0, 180)  # abscissae of the maps
FINE_DENSITIES = np.geomspace(0.01, 1.0, 140)  # [kg/m]
FINE_ANGLES = np.radians(np.linspace(-85.0, 0.0, 140))  # the platform end is below the frame end
REFERENCE = {"chord": 10.0, "angle": float(np.radians(-30.0)), "density": 0.067, "tension": 100.0}
USES = ((3.0, 300.0), (10.0, 300.0), (10.0, 50.0), (10.0, 15.0), (25.0, 100.0))  # chord [m], tension [N] of the table


@dataclass(frozen=True, slots=True, eq=False)
class _ModelErrors:
    """Errors of the five models relative to the exact model, for every combination of four quantities of a cable.

    All models have the same horizontal tension. The length error is therefore the error of the length at a winch. The
    position error is |dx| + |dz| of (20): the distance of the desired position from the end of an exact cable that has
    the model's force and length.
    """

    models: tuple[sl.CableModel, ...]  # the models, shape (5,)
    axial_stiffness: float  # EA [N]
    chords: Array  # D [m], shape (c,)
    angles: Array  # phi [rad], shape (a,)
    densities: Array  # rho [kg/m], shape (r,)
    tensions: Array  # chord tension tau [N], shape (t,)
    length_error: Array  # L of the model minus the exact value [m], shape (5, c, a, r, t)
    force_error: Array  # T_z of the model minus the exact value [N], shape (5, c, a, r, t)
    position_error: Array  # position error [m], shape (5, c, a, r, t)

    def sufficient(self, tolerance: float) -> Array:
        """The least accurate of the sufficient models, for each cable."""
        within = np.abs(self.length_error) <= tolerance
        coarsest: Array = np.argmax(within, axis=0).astype(np.float64)
        return coarsest


def model_errors(
    axial_stiffness: float, chords: ArrayLike, angles: ArrayLike, densities: ArrayLike, tensions: ArrayLike
) -> _ModelErrors:
    """Compare the five models on a grid."""
    axes = (
        checked(chords, "chords", "m", shape=(None,), above=0.0),
        checked(angles, "angles", "rad", shape=(None,)),
        checked(densities, "densities", "kg/m", shape=(None,), above=0.0),
        checked(tensions, "tensions", "N", shape=(None,), above=0.0),
    )
    chord, angle, density, tension = np.meshgrid(*axes, indexing="ij")
    cable, span, rise = sl.Cable(density, axial_stiffness), chord * np.abs(np.cos(angle)), chord * np.sin(angle)
    states = [model.from_tension(cable, span, rise, tension, GRAVITY) for model in MODELS]
    exact = states[-1]
    return _ModelErrors(
        MODELS,
        float(axial_stiffness),
        *axes,
        length_error=np.stack([state.unstrained_length - exact.unstrained_length for state in states]),
        force_error=np.stack([state.vertical_force - exact.vertical_force for state in states]),
        position_error=np.stack([end_position_error(state) for state in states]),
    )


def models_chapter() -> Chapter:
    """Chapter about the choice of a cable model for a controller."""
    cable = simulated_cable()
    draw = Drawings("models")
    return chapter(
        "models",
        (_maps(draw), _sufficient(draw), _slices(draw), _examples()),
        axial_stiffness=cable.axial_stiffness,
        reference=REFERENCE,
    )


def _name(model: object) -> str:
    return type(model).__name__


def _study(**varied: Array) -> _ModelErrors:
    """Errors as a function of the given quantities; all other quantities have their reference values."""
    at = (varied.get(name, np.array([REFERENCE[name]])) for name in ("chord", "angle", "density", "tension"))
    return model_errors(float(simulated_cable().axial_stiffness), *at)


def _maps(draw: Drawings) -> Finding:
    study = _study(chord=CHORDS, tension=TENSIONS)
    errors = np.abs(study.length_error[:-1, :, 0, 0, :])
    drawn = _study(chord=FINE_CHORDS, tension=FINE_TENSIONS).length_error[:-1, :, 0, 0, :]
    names = [_name(model) for model in study.models[:-1]]
    within = {name: float(np.mean(error <= TOLERANCE)) for name, error in zip(names, errors, strict=True)}
    return finding(
        "length-error-maps",
        numbers={"share_within_1_mm": within},
        panels=tuple(_map(error, f"{name}: length error.", draw) for name, error in zip(names, drawn, strict=True)),
        shares=", ".join(f"{name} {n(100 * share, '.3g', '%')}" for name, share in within.items()),
    )


def _map(error: Array, caption: str, draw: Drawings) -> Panel:
    figure, ax = map_axes("chord tension [N]", "chord [m]")
    _logarithmic(ax)
    draw_errors(ax, FINE_TENSIONS, FINE_CHORDS, error, EDGES, TICKS, LINES)
    return draw.panel(figure, caption)


def _sufficient(draw: Drawings) -> Finding:
    over_chord = _study(chord=CHORDS, tension=TENSIONS).sufficient(TOLERANCE)[:, 0, 0, :]
    fine = (
        _study(chord=FINE_CHORDS, tension=FINE_TENSIONS).length_error[:, :, 0, 0, :],
        _study(density=FINE_DENSITIES, tension=FINE_TENSIONS).length_error[:, 0, 0],
        _study(angle=FINE_ANGLES, tension=FINE_TENSIONS).length_error[:, 0, :, 0, :],
    )
    names = [_name(model) for model in MODELS]
    shares = {name: float(np.mean(over_chord == k)) for k, name in enumerate(names)}
    return finding(
        "sufficient-model",
        numbers={"share_of_map": shares},
        panels=(
            _choice("chord [m]", FINE_CHORDS, fine[0], "Error over chord and tension.", draw),
            _choice("linear density [kg/m]", FINE_DENSITIES, fine[1], "Error over density and tension.", draw),
            _choice("angle below level [°]", -np.degrees(FINE_ANGLES), fine[2], "Error over angle and tension.", draw),
        ),
    )


def _choice(label: str, heights: Array, errors: Array, caption: str, draw: Drawings) -> Panel:
    """Map of the least accurate sufficient model; at its borders, a length error has the allowed size."""
    names = [_name(model) for model in MODELS]
    colors = matplotlib.colormaps["viridis_r"](0.9 * np.arange(len(names)) / (len(names) - 1))
    figure, ax = map_axes("chord tension [N]", label)
    ax.add_patch(Rectangle((0.0, 0.0), 1.0, 1.0, transform=ax.transAxes, color=colors[-1], zorder=0.5))
    for error, color in zip(errors[-2::-1], colors[-2::-1], strict=True):  # less accurate models on top
        band = ax.contourf(FINE_TENSIONS, heights, error, levels=[-TOLERANCE, TOLERANCE], colors=[color])
        band.set_rasterized(True)
    if heights is FINE_CHORDS:
        _logarithmic(ax)
    else:
        ax.set_xscale("log")
        ax.set_yscale("log" if heights is FINE_DENSITIES else "linear")
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    scale = matplotlib.cm.ScalarMappable(norm, ListedColormap(colors))
    bar = figure.colorbar(scale, ax=ax, ticks=range(len(names)), pad=0.02)
    bar.ax.set_yticklabels(names, fontsize=TICK)
    bar.ax.tick_params(length=0.0)
    return draw.panel(figure, caption)


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
        error = 1e3 * np.abs(study.length_error).reshape(len(study.models), -1)
        x = -np.degrees(course) if quantity == "angle" else course
        ax.set_prop_cycle(linestyle=LINE_STYLES)
        for model, row, color in zip(study.models[:-1], error, COLORS, strict=False):
            ax.plot(x, row, color=color, linewidth=1.3, label=_name(model))
        ax.axhline(1e3 * TOLERANCE, color="0.6", linewidth=0.7, linestyle=":")
        logarithmic_with_floor(ax, 1e3 * FLOOR, f"below {n(FLOOR, '.3g', 'm')}")
        if quantity != "angle":
            ax.set_xscale("log")
        legend_above(ax)
        panels.append(draw.panel(figure, f"Over the {names[quantity].split(' [')[0]}."))
        worst[quantity] = {_name(model): float(row.max()) for model, row in zip(study.models[:-1], error, strict=False)}
    return finding(
        "length-error-slices",
        numbers={"largest_error_mm": worst},
        panels=panels,
        empirical=", ".join(f"{n(worst[q]['Empirical'], '.2g', 'mm')} over the {q}" for q in worst),
        parabolic=", ".join(n(worst[q]["Parabolic"], ".2g", "mm") for q in worst),
    )


def _examples() -> Finding:
    density = REFERENCE["density"]
    rows, numbers = [], []
    for chord, tension in USES:
        study = _study(chord=np.array([chord]), tension=np.array([tension]))
        length, force = (1e3 * study.length_error.ravel(), study.force_error.ravel())
        weight = density * GRAVITY * chord
        rows.append(
            (
                f"{n(chord, unit='m')}, {n(tension, unit='N')}, wD/τ = {n(weight / tension, '.2g')}",
                *(n(x, "+.2g", "mm") for x in length[:-1]),
            )
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
    return finding(
        "model-examples",
        numbers={"angle_below_level_deg": -np.degrees(REFERENCE["angle"]), "examples": numbers},
        data=(Table("Length minus exact length", ("cable", *names), rows),),
    )


def _logarithmic(ax: Axes) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_yticks([1, 2, 5, 10, 20], labels=["1", "2", "5", "10", "20"])
    ax.minorticks_off()
