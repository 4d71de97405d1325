"""How anchors follow one of them: mirrored, turned about the vertical, or by the same shift."""

from __future__ import annotations

from itertools import combinations
from typing import Any, Final, TypeAlias

import numpy as np

from sagline.core.arguments import choice
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError

Symmetry: TypeAlias = str
MIRRORED: Final = tuple("".join(axes) for count in (1, 2, 3) for axes in combinations("xyz", count))
NAMES: Final = (*MIRRORED, "turned", "together")
_ON_PLANE: Final = 1e-9  # of the extent of the anchors


def symmetry_of(given: Any) -> Symmetry | None:
    """One of the symmetries, or None.

    Raises:
        InvalidValueError: If it is neither.
    """
    return None if given is None else str(choice(given, "symmetry", NAMES))


def followed(
    symmetry: Symmetry | None, anchors: Array, along: Array, bounds: tuple[Array, Array], item: str
) -> list[tuple[int | None, Array]]:
    """How far each anchor is shifted along each direction, per meter of shift of the one that leads.

    Args:
        symmetry: One of `NAMES`, or None for anchors that move by themselves.
        anchors: Where they are [m], shape (c, 3); the first one leads.
        along: Directions, shape (K, 3).
        bounds: Least and largest shifts [m], shape (K,) each.
        item: How messages call it.

    Returns:
        For each that leads its place among the anchors (None for all of them), and shifts of shape (K, c, 3).

    Raises:
        InvalidValueError: If an anchor could pass the plane it is mirrored in, or turns about no axis.
    """
    count = len(anchors)
    if symmetry is None:
        alone = np.eye(count)
        return [(i, along[:, None, :] * alone[i][None, :, None]) for i in range(count)]
    if symmetry == "together":
        return [(None, np.repeat(along[:, None, :], count, axis=1))]
    if symmetry == "turned":
        return [(None, _turned(anchors, along, item))]
    return [(None, _mirrored(symmetry, anchors, along, bounds, item))]


def _turned(anchors: Array, along: Array, item: str) -> Array:
    away = anchors[:, :2] - anchors[:, :2].mean(axis=0)
    if np.linalg.norm(away, axis=1).min() <= _ON_PLANE * max(float(np.ptp(anchors)), 1.0):
        step = 'Choose "together", or leave the anchor on the axis out of cables.'
        raise InvalidValueError(f"{item}: symmetry", "'turned' with an anchor on the axis", "anchors around it", step)
    angle = np.arctan2(away[:, 1], away[:, 0])
    angle -= angle[0]
    shifts = np.repeat(along[:, None, :], len(anchors), axis=1)
    shifts[..., 0] = np.cos(angle) * along[:, None, 0] - np.sin(angle) * along[:, None, 1]
    shifts[..., 1] = np.sin(angle) * along[:, None, 0] + np.cos(angle) * along[:, None, 1]
    return shifts


def _mirrored(symmetry: str, anchors: Array, along: Array, bounds: tuple[Array, Array], item: str) -> Array:
    """The side on which an anchor is says which way it goes; on the plane it stays there."""
    shifts = np.repeat(along[:, None, :], len(anchors), axis=1)
    for axis in ("xyz".index(name) for name in symmetry):
        low, high = float(anchors[:, axis].min()), float(anchors[:, axis].max())
        plane = 0.5 * (low + high)
        away = anchors[:, axis] - plane
        side = np.where(np.abs(away) <= _ON_PLANE * max(high - low, 1.0), 0.0, np.sign(away))
        if side[0] == 0.0:
            side = np.zeros_like(side)  # the one that leads stays on the plane, and so do all
        lead, side = side[0], side * side[0]
        shifts[..., axis] *= side
        inward = -np.minimum(*(bound * along[:, axis] * lead for bound in bounds)).sum()
        room = float(np.abs(away[side != 0.0]).min(initial=np.inf))
        if inward >= room:
            name = "xyz"[axis]
            value, allowed = f"up to {inward:g} m inward", f"< {room:g} m, where the plane {name} = {plane:g} m is"
            step = f"Anchors would pass through those that mirror them: narrow the bounds along {name}."
            raise InvalidValueError(f"{item}: the shift along {name}", value, allowed, step)
    return shifts
