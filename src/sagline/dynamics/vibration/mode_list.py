"""List of modes for display, and quasi-static displacements of cables."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.vibration.flexibility import flexibility
from sagline.dynamics.vibration.vibration import Vibration
from sagline.kernels.dynamics import string as columns
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import cable_slopes, motions_of_ends
from sagline.statics.stiffness import Modes, modes
from sagline.statics.strings import Strings, strings_of

EQUAL: Final = 1e-6  # energy shares with a smaller relative difference count as equal

_TINY = np.finfo(float).tiny


def end_displacements(state: Equilibrium, shape: Array) -> Array:
    """Displacements (m, 3, n) of the platform ends due to the platform motions `shape` (6, n)."""
    robot = state.one_robot
    return motions_of_ends((robot.platform_anchors - robot.center_of_mass) @ state.pose.matrix.T) @ shape


def stretch_losses(state: Equilibrium, platform: Modes, loss_time: float) -> Array:
    """Damping ratio of each massless mode due to the loss in the cables' stretch, to first order."""
    # The ratio is half the loss factor omega eta, times the share of the elastic energy that is in the stretch of the
    # cables, on both sides of their exit points. The rest of the energy is in sag and in the swivel motion. Shapes:
    # loss_time [s]; returns (n,) source: docs/model.md, section 11
    omega = 2.0 * np.pi * platform.frequency
    if loss_time == 0.0:
        return np.zeros_like(omega)
    slopes, strings = cable_slopes(state), strings_of(state)
    taut = strings.taut[0]
    behind = _behind(strings)
    compliance = flexibility(state, slopes.force).stretch + behind[:, :, None] * behind[:, None, :]
    force = slopes.blocks @ end_displacements(state, platform.shape)
    energy = np.einsum("min,mij,mjn->n", force[taut], compliance[taut], force[taut])
    return np.asarray(0.5 * omega * loss_time * energy / omega**2)


def quasi_static_displacements(state: Equilibrium, ends: Array, count: int) -> Array:
    """Quasi-static displacement of the cables, to first order, if their platform ends move by `ends`."""
    # shapes: ends (m, 3); returns (m, count, 3)
    middles = (np.arange(count - 1) + 0.5) / (count - 1)
    tangent, sag, stretch = _along(state, middles)
    outer = tangent[..., :, None] * tangent[..., None, :]
    slope = stretch[:, None, None, None] * outer + sag[..., None, None] * (np.eye(3) - outer)
    strings = strings_of(state)
    behind, normal = _behind(strings), strings.axes[0, :, 1]
    swivels = strings.table[0, :, columns.BEHIND_Y, None, None] * normal[:, :, None] * normal[:, None, :]
    exits = behind[:, :, None] * behind[:, None, :] + swivels
    summed = exits[:, None] + np.concatenate((np.zeros_like(slope[:, :1]), np.cumsum(slope, axis=1) / len(middles)), 1)
    force = np.linalg.solve(summed[:, -1], ends[..., None])
    return np.asarray((summed @ force[:, None])[..., 0])


def _behind(strings: Strings) -> Array:
    """Motion (m, 3) that the routing allows each exit point: its direction times the root of the compliance."""
    table, axes = strings.table[0], strings.axes[0]
    return np.asarray(table[:, columns.BEHIND_X, None] * axes[:, 0] + table[:, columns.BEHIND_Z, None] * axes[:, 2])


def _along(state: Equilibrium, place: Array) -> tuple[Array, Array, Array]:
    """Unit tangents (m, s, 3) at the length shares `place` (s,), and flexibilities across and along the cable."""
    # The flexibility of a cable is L (1/N + 1/EA) across its tangent and L/EA along it [m/N]
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


WITH_MASS, MASSLESS = "with cable mass", "massless"


class ListedMode(NamedTuple):
    """One mode."""

    number: int  # number of the mode within its kind, starting at 1
    kind: str  # "with cable mass" or "massless"
    frequency: float  # [Hz]
    platform_share: float  # platform share of the kinetic energy
    cable: int | None  # cable with the largest share of the energy; None if no cable has a share
    cable_share: float  # share of this cable
    loss: float  # damping ratio

    @property
    def name(self) -> str:
        """Name for the selection: "1", "massless 1"."""
        return f"{self.number}" if self.kind == WITH_MASS else f"{MASSLESS} {self.number}"

    @property
    def swings(self) -> str:
        """Name of the platform or cable with the largest share of the kinetic energy."""
        if self.cable is None or self.platform_share >= self.cable_share:
            return "platform"
        return f"cable {self.cable}"


def listed_modes(vibration: Vibration) -> list[ListedMode]:
    """All modes with cable mass, then all massless modes, each in ascending order."""
    share = vibration.cable_share
    # the first one if several cables are equal except for rounding
    most = np.argmax(share >= (1.0 - EQUAL) * share.max(axis=0), axis=0) if vibration.frequency.size else ()
    swinging = [
        ListedMode(
            k + 1,
            WITH_MASS,
            float(vibration.frequency[k]),
            float(vibration.platform_share[k]),
            int(cable),
            float(vibration.cable_share[cable, k]),
            float(vibration.loss[k]),
        )
        for k, cable in enumerate(most)
    ]
    damping, platform = vibration.damping, modes(vibration.state)
    losses = damping.modal_damping + stretch_losses(vibration.state, platform, damping.loss_time)
    return swinging + [
        ListedMode(k + 1, MASSLESS, float(frequency), 1.0, None, 0.0, float(losses[k]))
        for k, frequency in enumerate(platform.frequency)
        if np.isfinite(frequency)
    ]


def mode_correlation(vibration: Vibration) -> Array:
    """Similarity of each massless mode to each mode with cable mass (a share from 0 to 1), shape (n, K)."""
    # A share is the squared mass-weighted product of the platform motions of both modes. The sum of the shares of a
    # massless mode over all modes, including modes above `up_to`, is less than 1 because of the motion of the cables
    massless = modes(vibration.state).shape
    mass = np.linalg.pinv(massless @ massless.T)
    return np.asarray((massless.T @ mass @ vibration.shape) ** 2)
