"""Cables whose mass does not swing: how they lie when their ends move, and what their stretch takes out of a mode."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.stiffness import Modes, stiffness

POINTS = 40  # of Gauss, along a cable: to seven digits for one that sags by a third of its span
_TINY = np.finfo(float).tiny


def end_motions(state: Equilibrium, shape: Array) -> Array:
    """Displacement of the platform ends in motions of the platform.

    Args:
        state: A single state.
        shape: Motions (displacement of the center of mass, rotation vector), one a column, shape (6, n).

    Returns:
        Shape (m, 3, n).
    """
    robot = state.one_robot
    levers = state.pose.transform(robot.platform_anchors) - state.pose.transform(robot.center_of_mass)
    turned = np.cross(shape[3:].T, levers[:, None])  # (m, n, 3)
    return np.asarray(shape[:3] + np.swapaxes(turned, 1, 2))


def stretch_losses(state: Equilibrium, platform: Modes, loss_time: float) -> Array:
    """Damping ratio that the loss in the cables' stretch gives each massless mode, to first order.

    Half the loss factor omega eta, times the share of the mode's elastic energy that is in the stretch of the hanging
    cables; the rest is in what they sag.

    Args:
        state: A single state.
        platform: Its modes.
        loss_time: Eta of the stretch [s].

    Returns:
        Shape (n,).

    Source:
        docs/vibration.md.
    """
    omega = 2.0 * np.pi * platform.frequency
    if loss_time == 0.0:
        return np.zeros_like(omega)
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    tangent, _, stretch = _along(state, 0.5 * (1.0 + node))
    share = 0.5 * weight * stretch[:, None]
    compliance = np.einsum("ms,msi,msj->mij", share, tangent, tangent)
    force = stiffness(state).cable_stiffness @ end_motions(state, platform.shape)
    energy = np.einsum("min,mij,mjn->n", force, compliance, force)
    return np.asarray(0.5 * omega * loss_time * energy / omega**2)


def following(state: Equilibrium, ends: Array, count: int) -> Array:
    """Displacement of the cables that follow their platform ends without inertia, to first order.

    Args:
        state: A single state.
        ends: Displacement of the platform ends, shape (m, 3).
        count: Points at equal steps of unstrained length, from frame to platform end.

    Returns:
        Shape (m, count, 3).
    """
    middles = (np.arange(count - 1) + 0.5) / (count - 1)
    tangent, sag, stretch = _along(state, middles)
    outer = tangent[..., :, None] * tangent[..., None, :]
    slope = stretch[:, None, None, None] * outer + sag[..., None, None] * (np.eye(3) - outer)
    summed = np.concatenate((np.zeros((len(ends), 1, 3, 3)), np.cumsum(slope, axis=1)), axis=1)
    force = np.linalg.solve(summed[:, -1], ends[..., None])
    return np.asarray((summed @ force[:, None])[..., 0])


def _along(state: Equilibrium, place: Array) -> tuple[Array, Array, Array]:
    """Unit tangents (m, s, 3) at shares of the length (s,), the length over what holds it across, and over EA.

    Across its tangent a cable gives way by L (1/N + 1/EA), along it by L/EA [m/N].
    """
    cables, robot = state.cables, state.one_robot
    length = cables.unstrained_length[:, None]
    weight = np.zeros_like(length) if cables.model.weightless else cables.cable_weight[:, None]
    up = cables.vertical_force[:, None] - weight * (1.0 - place)
    along = np.broadcast_to(cables.horizontal_tension[:, None], up.shape)
    run = (state.pose.transform(robot.platform_anchors) - state.exit_point)[:, :2]
    level = run / np.maximum(np.linalg.norm(run, axis=1, keepdims=True), _TINY)
    force = np.concatenate((along[..., None] * level[:, None], up[..., None]), axis=-1)
    size = np.linalg.norm(force, axis=-1)
    stretch = cables.unstrained_length / np.broadcast_to(cables.cable.axial_stiffness, cables.shape)
    return force / size[..., None], length / size + stretch[:, None], stretch
