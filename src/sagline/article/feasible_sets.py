"""Study of figures 3 to 5: tensions and lengths for which the platform end of a cable is at a given position."""

from __future__ import annotations

import numpy as np

import sagline as sl
from sagline.article.drawing import axes, chapter, finding, shades
from sagline.article.regressions import ANGLE, GRAVITY, End, end_at_angle, fit_line, simulated_cable
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.plot.sheet import BLUE, VERMILLION
from sagline.present.page import Chapter, Finding

CORNERS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)])  # corners of |x| + |z| = 1
CHORD = 10.0  # [m]
TOLERANCES = (0.01, 0.001, 0.0001)  # [m]
TENSIONS = np.linspace(10.0, 500.0, 200)  # [N]
PSI_TENSIONS = np.array([30.0, 60.0, 120.0, 200.0, 300.0, 400.0])  # [N]
SHOWN = 2  # index of the length for which the set psi is drawn separately
LOW_PART = 50.0  # lowest tension of the curve [N], as in the article


class FeasibleSets:
    """Sets psi for some lengths, curve Psi for all lengths, and the line pi that is fitted to the projection of Psi."""

    def __init__(
        self, cable: sl.Cable, end: End, tolerance: float, tensions: Array, psi_tensions: Array, points: int = 80
    ) -> None:
        """Exact computation of the article's sets psi at `psi_tensions` [N], and of its curve Psi at `tensions` [N]."""
        # For a given L, each T gives one B, and each B needs one T. The outline of psi is therefore the set of all T
        # for which B is on the outline of the tolerance, |dx| + |dz| = epsilon_max around B_d. A search is not
        # necessary. Source: Gia Luan & Truong Thinh 2020, (20), (21), figures 3 to 5, statements 1 and 2
        if points % 4:
            raise sl.InvalidValueError("points", points, "a multiple of 4", "The outline has four edges.")
        # end: desired position B_d of the platform end
        # tolerance: epsilon_max of (20) [m]
        self.cable, self.end, self.tolerance = cable, end, tolerance
        model, stretch = sl.Catenary(), float(np.hypot(*end)) / end[0]
        curve = model.from_tension(cable, *end, tensions * stretch, GRAVITY)
        # lengths L of the sets psi [m], shape (s,)
        self.psi_lengths = model.from_tension(cable, *end, psi_tensions * stretch, GRAVITY).unstrained_length
        outline = np.asarray(end) + tolerance * _diamond(points)
        around = model.from_length(cable, outline[:, 0], outline[:, 1], self.psi_lengths[:, None], GRAVITY)
        # outlines of the sets psi in the (T_x, T_z) plane [N], shape (s, points, 2)
        self.psi = np.stack((around.horizontal_tension, around.vertical_force), axis=-1)
        # tensions: T_x along the curve Psi [N], shape (t,)
        # vertical: T_z along the curve Psi [N], shape (t,)
        self.tensions, self.vertical = curve.horizontal_tension, curve.vertical_force
        self.lengths = curve.unstrained_length  # L along the curve Psi [m], shape (t,)
        # slope a_pi and intercept b_pi [N] of the line pi through the points (T_x, T_z)
        self.line = fit_line(self.tensions, self.vertical)

    @property
    def tangent(self) -> float:
        """Slope tan phi of the line pi according to equation (26) of the article."""
        return self.end[1] / self.end[0]

    @property
    def half_weight(self) -> float:
        """Magnitude w D/2 of the intercept according to equation (28) of the article: half of the weight [N]."""
        return 0.5 * float(self.cable.linear_density) * GRAVITY * float(np.hypot(*self.end))


def _diamond(points: int) -> Array:
    """Points on |x| + |z| = 1, shape (points + 1, 2); the last point is equal to the first."""
    share = np.linspace(0.0, 4.0, points + 1)
    edges = np.arange(5.0)
    return np.stack([np.interp(share, edges, CORNERS[:, k]) for k in range(2)], axis=-1)


def feasible_chapter() -> Chapter:
    """Chapter about the tensions for which the end of a cable is at a point, exactly or within a tolerance."""
    end = end_at_angle(CHORD)
    studies = [FeasibleSets(simulated_cable(), end, e, TENSIONS, PSI_TENSIONS) for e in TOLERANCES]
    return chapter("feasible-sets", (_psi(studies), _curve(studies[0]), _line(studies[0])), chord=CHORD, angle=ANGLE)


def _psi(studies: list[FeasibleSets]) -> Finding:
    extents = np.array([np.ptp(study.psi[SHOWN, :, 0]) for study in studies])
    length = float(studies[0].psi_lengths[SHOWN])
    figure, ax = axes("$T_x$ [N]", "$T_z$ [N]")
    for study, color in zip(studies, shades(len(studies)), strict=True):
        outline = study.psi[SHOWN]
        ax.plot(outline[:, 0], outline[:, 1], color=color, linewidth=1.3, label=n(1e3 * study.tolerance, unit="mm"))
    along = np.array(studies[0].end) / CHORD
    second, bx = axes("along the chord [N]", "across it [N]")
    middle = studies[-1].psi[SHOWN].mean(axis=0)
    for study, color in zip(studies[:2], shades(len(studies)), strict=False):
        away, label = study.psi[SHOWN] - middle, n(1e3 * study.tolerance, unit="mm")
        bx.plot(away @ along, away @ (-along[1], along[0]), color=color, linewidth=1.3, label=label)
    bx.set_ylim(-0.2, 0.3)
    legend = r"tolerance $\epsilon_{max}$"
    caption = "The same sets relative to their middle, along and across the chord; the scales differ."
    ratio = extents[:-1] / extents[1:]
    return finding(
        "psi",
        numbers={
            "unstrained_length_m": length,
            "tolerance_m": list(TOLERANCES),
            "extent_N": extents,
            "times_smaller": ratio,
        },
        panels=(
            (figure, f"The set ψ for L = {n(length, '.5g', 'm')} and three tolerances.", legend),
            (second, caption, legend),
        ),
    )


def _curve(study: FeasibleSets) -> Finding:
    figure, ax = axes("$T_x$ [N]", "$d = L - D$ [mm]")
    ax.plot(study.tensions, 1e3 * (study.lengths - CHORD), color=BLUE, linewidth=1.3, label=r"$\Psi$, exact")
    for k, (length, outline) in enumerate(zip(study.psi_lengths, study.psi, strict=True)):
        height = np.full(2, 1e3 * (length - CHORD))
        label = rf"$\psi$, $\epsilon_{{max}}$ = {n(1e3 * study.tolerance, unit='mm')}" if k == 0 else "_"
        ax.plot([outline[:, 0].min(), outline[:, 0].max()], height, color=VERMILLION, linewidth=2.2, label=label)
    ax.set_xlim(0.0, TENSIONS[-1])
    return finding(
        "psi-curve",
        numbers={
            "tension_first_N": TENSIONS[0],
            "tension_last_N": TENSIONS[-1],
            "d_first_m": study.lengths[0] - CHORD,
            "d_last_m": study.lengths[-1] - CHORD,
            "strictly_falling": bool(np.all(np.diff(study.lengths) < 0.0)),
        },
        panels=((figure, "The curve Ψ over T_x, with the sets ψ of six lengths as segments."),),
    )


def _line(study: FeasibleSets) -> Finding:
    slope, intercept = study.line
    rest = study.vertical - (slope * study.tensions + intercept)
    taut = study.tensions >= LOW_PART
    from_article = study.vertical - (study.tangent * study.tensions + study.half_weight)
    figure, ax = axes("$T_x$ [N]", "$T_z$ [N]")
    ax.plot(study.tensions, study.vertical, color=BLUE, linewidth=2.4, alpha=0.5, label="exact")
    ax.plot(study.tensions, study.vertical - rest, color="black", linewidth=0.9, label=r"line $\pi$")
    second, bx = axes("$T_x$ [N]", "away from the line [N]")
    bx.plot(study.tensions, rest, color=BLUE, linewidth=1.3, label=r"fitted line")
    bx.plot(study.tensions, from_article, color=VERMILLION, linewidth=1.3, label=r"$\tan\varphi\, T_x + wD/2$")
    bx.axhline(0.0, color="0.6", linewidth=0.6)
    return finding(
        "line-pi",
        numbers={
            "r_squared": np.corrcoef(study.tensions, study.vertical)[0, 1] ** 2,
            "slope": slope,
            "tangent": study.tangent,
            "intercept_N": intercept,
            "half_weight_N": study.half_weight,
            "deviation_N": _largest(rest),
            "deviation_from_tangent_N": _largest(from_article),
            "taut_from_N": LOW_PART,
            "taut_deviation_from_tangent_N": _largest(from_article[taut]),
        },
        panels=(
            (figure, "The projection of Ψ and the fitted line."),
            (second, "The difference: the exact T_z minus the line."),
        ),
    )


def _largest(values: Array) -> float:
    return float(np.abs(values).max())
