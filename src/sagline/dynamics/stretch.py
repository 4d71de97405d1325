"""What the stretch of cables whose mass does not swing takes out of the platform's modes."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.stiffness import Modes, stiffness

POINTS = 40  # of Gauss, along a cable: to seven digits for one that sags by a third of its span


def stretch_losses(state: Equilibrium, platform: Modes, loss_time: float) -> Array:
    """Damping ratio that the loss in the cables' stretch gives each massless mode, to first order.

    Half the loss factor omega eta, times the share of the mode's elastic energy that is in the stretch of the cables;
    the rest is in what they sag.

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
    levers = state.pose.transform(state.one_robot.platform_anchors) - _center(state)
    ends = platform.shape[:3] + np.cross(platform.shape[3:].T[None], levers[:, None]).transpose(0, 2, 1)  # (m, 3, n)
    force = stiffness(state).cable_stiffness @ ends
    energy = np.einsum("min,mij,mjn->n", force, _stretch_compliance(state), force)
    return np.asarray(0.5 * omega * loss_time * energy / omega**2)


def _center(state: Equilibrium) -> Array:
    return np.asarray(state.pose.transform(state.one_robot.center_of_mass))


def _stretch_compliance(state: Equilibrium) -> Array:
    """Integral of t t^T/EA along each cable, t its tangent, world axes [m/N], shape (m, 3, 3)."""
    cables, robot = state.cables, state.one_robot
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    length = cables.unstrained_length[:, None]
    below = 0.5 * length * (1.0 - node)  # L - s
    drop = np.zeros_like(below) if cables.model.weightless else cables.cable.linear_density[:, None] * cables.gravity
    up = cables.vertical_force[:, None] - drop * below
    along = np.broadcast_to(cables.horizontal_tension[:, None], up.shape)
    run = (state.pose.transform(robot.platform_anchors) - state.exit_point)[:, :2]
    level = run / np.maximum(np.linalg.norm(run, axis=1, keepdims=True), np.finfo(float).tiny)
    force = np.concatenate((along[..., None] * level[:, None], up[..., None]), axis=-1)
    tangent = force / np.linalg.norm(force, axis=-1, keepdims=True)
    share = 0.5 * length * weight / np.broadcast_to(cables.cable.axial_stiffness, cables.shape)[:, None]
    return np.asarray(np.einsum("ms,msi,msj->mij", share, tangent, tangent))
