"""The polygon of feasible tensions, with the points that ways of sharing the load choose in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from sagline.arguments import instance
from sagline.errors import InvalidValueError
from sagline.plot.sheet import COLORS, GAP_COLOR, TICK, axes_or_new, dressed, legend_outside
from sagline.tension.polygon import TensionPolygon

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

MARKERS = "osD^v<>pPX*h"


def polygon(shape: TensionPolygon, points: Mapping[str, ArrayLike] | None = None, ax: Axes | None = None) -> Axes:
    """The feasible polygon in coordinates of the null space, each side named by its limit.

    Args:
        shape: The polygon, of `tension_polygon`, for two redundant cables.
        points: Name -> chord tensions (m,), drawn where they lie in it; NaN are left out. None for none.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If there is no polygon to draw, or points are no tensions of its cables.
    """
    if instance(shape, TensionPolygon, "shape").vertices.shape[1] != 2 or len(shape.vertices) == 0:
        raise InvalidValueError(
            "polygon",
            f"{len(shape.vertices)} points with {shape.vertices.shape[1]} coordinates",
            "a polygon of two redundant cables",
            "Choose a feasible pose of a robot with n + 2 cables.",
        )
    points = instance({} if points is None else points, Mapping, "points")  # type: ignore[type-abstract]
    places = {str(name): shape.coordinates(tensions) for name, tensions in points.items()}
    if wrong := [name for name, place in places.items() if place.ndim != 1]:
        raise InvalidValueError(
            f"points[{wrong[0]!r}]", "a batch of tensions", "those of one pose", "Give them one by one."
        )
    ax = axes_or_new(ax, height=4.5)
    corners = np.asarray(shape.vertices)
    ax.fill(*corners.T, facecolor=GAP_COLOR, alpha=0.25, edgecolor="none")
    middle = corners.mean(axis=0)
    for k, side in enumerate(shape.sides):
        ends = corners[[k, (k + 1) % len(corners)]]
        ax.plot(*ends.T, color="0.3", linewidth=1.0, linestyle="-" if side else ":")
        if side is not None:
            place = ends.mean(axis=0)
            out = place - middle
            ax.annotate(
                f"cable {side.cable} {side.limit}",
                place,
                xytext=12.0 * out / (np.linalg.norm(out) or 1.0),
                textcoords="offset points",
                ha="center",
                va="center",
                fontsize=TICK,
                color="0.3",
            )
    for k, (name, place) in enumerate(places.items()):
        if np.isfinite(place).all():
            color, marker = COLORS[k % len(COLORS)], MARKERS[k % len(MARKERS)]
            ax.plot(*place, marker, color=color, markersize=6.0, markeredgecolor="white", label=name, linestyle="none")
    dressed(ax, r"$\lambda_1$ [N]", r"$\lambda_2$ [N]")
    ax.set_aspect("equal")
    ax.margins(0.12)
    if any(np.isfinite(place).all() for place in places.values()):
        legend_outside(ax)
    return ax
