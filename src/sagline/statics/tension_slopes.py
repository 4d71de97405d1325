"""How the tensions at the frame ends change with the platform's motion and the cables' lengths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.several import pulleys_of
from sagline.statics.slopes import CableSlopes

_TINY = 1e-300
_LONGER = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])  # the last column is a meter of the cable's own


class TensionSlopes(NamedTuple):
    """Derivatives of the tension at each cable's frame end.

    Attributes:
        by_motion: By (displacement of the center of mass, rotation vector) at fixed lengths, shape (..., m, 6)
            [N/m, N/rad].
        by_length: By the cable's own length, the platform held, shape (..., m) [N/m].
    """

    by_motion: Array
    by_length: Array


def tension_slopes(state: Equilibrium, slopes: CableSlopes) -> TensionSlopes:
    """How the tensions at the frame ends change.

    Args:
        state: An equilibrium, single or N of them.
        slopes: Of its cables.

    Returns:
        The slopes; NaN where the state has no lengths.
    """
    unit = np.eye(6)
    ends = unit[:, :3] + np.cross(unit[:, 3:], slopes.levers[..., None, :])
    forces = np.concatenate((ends @ np.swapaxes(slopes.blocks, -1, -2), slopes.by_length[..., None, :]), axis=-2)
    if state.contact is None:
        found = _at_anchors(state, slopes, forces)
    else:
        ends = np.concatenate((ends, np.zeros_like(slopes.levers)[..., None, :]), axis=-2)
        found = _leaving(state, slopes, forces, ends)
    return TensionSlopes(found[..., :6], found[..., 6])


def _at_anchors(state: Equilibrium, slopes: CableSlopes, forces: Array) -> Array:
    """Of cables that hang from their anchors, by the change of the force on each platform end, (..., m, 7, 3)."""
    cables = state.cables
    at_frame, forces = slopes.force.copy(), forces.copy()
    at_frame[..., 2] -= cables.cable_weight
    forces[..., 2] -= _weight(state)[..., None] * _LONGER
    # a cable without force pulls nowhere
    direction = at_frame / np.maximum(np.linalg.norm(at_frame, axis=-1, keepdims=True), _TINY)
    slope: Array = np.einsum("...ik,...ijk->...ij", direction, forces)
    return slope


def _leaving(state: Equilibrium, slopes: CableSlopes, forces: Array, ends: Array) -> Array:
    """Of cables that leave pulleys, from H = T + T^2/(2 EA) - w z, which is one number from end to end.

    Args:
        state: The state.
        slopes: Of its cables.
        forces: Change of the force on each platform end, shape (..., m, 7, 3).
        ends: Motion of each platform end, of the same shape.
    """
    cables, contact = state.cables, state.contact
    assert contact is not None
    stiffness, weight = cables.cable.axial_stiffness, _weight(state)
    at_end, leaving = cables.platform_end_tension, cables.frame_end_tension
    by_end = np.einsum("...ik,...ijk->...ij", slopes.force / np.maximum(at_end, _TINY)[..., None], forces)
    whole = (1.0 + at_end / stiffness)[..., None] * by_end - weight[..., None] * ends[..., 2]
    radius, entry = pulleys_of(state.robot)
    turned = forces.copy()
    turned[..., 2] -= weight[..., None] * _LONGER
    sine, cosine = np.sin(contact.wrap_angle), np.cos(contact.wrap_angle)
    level = slopes.force[..., :2] / np.maximum(cables.horizontal_tension, _TINY)[..., None]
    around = np.concatenate((level * cosine[..., None], (-entry * sine)[..., None]), axis=-1)
    angle = np.einsum("...ik,...ijk->...ij", around / np.maximum(leaving, _TINY)[..., None], turned)
    raised = (weight * radius * entry * cosine)[..., None] * angle
    slope: Array = (whole + raised) / (1.0 + leaving / stiffness)[..., None]
    return slope


def _weight(state: Equilibrium) -> Array:
    """Weight of the cables a length, as their model sees it [N/m], shape (..., m)."""
    cables = state.cables
    weight = 0.0 if cables.model.weightless else cables.cable.linear_density * cables.gravity
    return np.broadcast_to(weight, cables.shape)
