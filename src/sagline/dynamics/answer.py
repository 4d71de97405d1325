"""The platform's compliance against oscillating wrenches, by the modes of its cables and exactly."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.core.progress import blocks
from sagline.dynamics.cable_dynamics import Complex, moving_stiffness
from sagline.dynamics.component_modes import Components, Motions, component_modes, stretch_of_motions
from sagline.dynamics.damping import Damping
from sagline.dynamics.reduced import Setting

LOWEST: Final = 1.0  # Hz: modes up to there are taken at least
TAKEN: Final = 1.6  # of the highest frequency: modes up to there are taken
COUPLED: Final = 1.5  # of the same: losses couple modes up to there, those beyond lose each by itself
BLOCK: Final = 128  # frequencies at once


class Held(NamedTuple):
    """The cables of one state with both ends held.

    Attributes:
        components: Their motions.
        lost: What the loss in their stretch takes, as of `stretch_of_motions`; None if it takes nothing.
    """

    components: Components
    lost: Array | None


class Answer(NamedTuple):
    """What oscillating wrenches meet.

    Attributes:
        setting: Of one state, with a leading axis 1.
        matrix: Stiffness of the platform, not symmetric where a moment is given, shape (6, 6).
        cables: That of the cables' platform ends, shape (m, 3, 3).
        damping: What takes energy out.
    """

    setting: Setting
    matrix: Array
    cables: Array
    damping: Damping

    def held(self, up_to: float) -> Held:
        """What the cables do by themselves.

        Args:
            up_to: Highest frequency that is asked for [Hz].
        """
        components = component_modes(self.setting.strings, 0, max(TAKEN * up_to, LOWEST))
        return Held(components, stretch_of_motions(components) if self.damping.loss_time > 0.0 else None)

    def by_modes(self, frequency: Array, held: Held) -> tuple[Complex, Complex]:
        """The compliance by the modes of the cables, and that on massless cables.

        Args:
            frequency: [Hz], shape (F,).
            held: The cables, for these frequencies.

        Returns:
            Two arrays of shape (F, 6, 6).
        """
        found = np.empty((2, frequency.size, 6, 6), dtype=np.complex128)
        for part in blocks(frequency.size, BLOCK):
            moving, still = self._moving(*held, 2.0 * np.pi * frequency[part])
            found[0, part] = self._compliance(frequency[part], moving)
            found[1, part] = self._compliance(frequency[part], still)
        return found[0], found[1]

    def exactly(self, frequency: Array) -> Complex:
        """The compliance by the exact stiffness of the cables.

        Args:
            frequency: [Hz], shape (F,).

        Returns:
            Shape (F, 6, 6).
        """
        strings = self.setting.strings
        moving = moving_stiffness(strings, frequency, self.damping)
        moving -= 2j * self.damping.modal_damping * self.cables  # which the whole stiffness has already
        moving[:, ~strings.taut[0]] = 0.0
        return self._compliance(frequency, moving)

    def _compliance(self, frequency: Array, moving: Complex) -> Complex:
        """Inverse of what a wrench meets, moving what the cables add to their stiffness, (F, m, 3, 3)."""
        setting, omega = self.setting, 2.0 * np.pi * frequency[:, None, None]
        ends, freedom = setting.ends[0], setting.freedom
        on_platform = np.einsum("mai,fmab,mbj->fij", ends, moving, ends, optimize=True)
        whole = (1.0 + 2j * self.damping.modal_damping) * self.matrix + on_platform - omega**2 * setting.mass[0]
        with np.errstate(all="ignore"):
            return np.asarray(freedom.T @ np.linalg.inv(freedom @ whole @ freedom.T) @ freedom)

    def _moving(self, components: Components, lost: Array | None, omega: Array) -> tuple[Complex, Complex]:
        """What vibrating cables add to their stiffness, with their mass and without, (F, m, 3, 3) each."""
        mesh, setting = components.mesh, self.setting
        density = mesh.density[:, None, None]
        square = omega**2 - 1j * omega * self.damping.air_damping / density[:, 0]  # (t, F)
        loss = 1.0 + 2j * self.damping.modal_damping
        moving = np.zeros((omega.size, setting.strings.taut.shape[1], 3, 3), dtype=np.complex128)
        still = np.zeros_like(moving)
        moving[:, mesh.taut] = -np.swapaxes(square, 0, 1)[..., None, None] * components.still[mesh.taut]
        aside = _driven(components.normal, square, loss)
        if lost is None:
            inside = _driven(components.plane, square, loss)
        else:
            scaled = np.asarray(1j * loss * self.damping.loss_time * omega, dtype=np.complex128)
            inside, bare = _driven_with_stretch(components.plane, square, loss, lost, scaled)
            still[:, mesh.taut] = _in_world(bare, mesh.axes[:, ::2])
            inside += bare
        moving[:, mesh.taut] += _in_world(inside, mesh.axes[:, ::2]) + _in_world(aside, mesh.axes[:, 1:2])
        return moving, still


def _in_world(own: Complex, axes: Array) -> Complex:
    """Matrices (t, F, d, d) in directions (t, d, 3) as (F, t, 3, 3)."""
    return np.asarray(np.einsum("tai,tfab,tbj->ftij", axes, own, axes, optimize=True))


def _driven(motions: Motions, square: Complex, loss: complex) -> Complex:
    """What the motions add to the stiffness of the end that drives them, undamped but for all alike, (t, F, d, d)."""
    with np.errstate(all="ignore"):
        shares = square[..., None] ** 2 / (loss * motions.square[:, None] - square[..., None])
    return np.asarray(-np.einsum("tka,tfk,tkb->tfab", motions.drive, shares, motions.drive, optimize=True))


def _driven_with_stretch(
    motions: Motions, square: Complex, loss: complex, lost: Array, scaled: Complex
) -> tuple[Complex, Complex]:
    """The same with what is lost in stretch, by motions and end (t, d + k, d + k); and what is lost at rest alone."""
    d, factor = motions.drive.shape[2], scaled[None, :, None, None]
    by_end = -square[..., None, None] * motions.drive[:, None] + factor * lost[:, None, d:, :d]
    alone = loss * motions.square[:, None] - square[..., None]
    near = int((motions.square < COUPLED**2 * np.abs(square).max()).sum(axis=1).max())  # of each, ascending
    own = factor * lost[:, None, d : d + near, d : d + near]
    index = np.arange(near)
    own[..., index, index] += alone[..., :near]
    stretched = np.einsum("tkk->tk", lost[:, d:, d:])[:, None, near:]
    far = by_end[..., near:, :] / (alone[..., near:] + factor[..., 0] * stretched)[..., None]
    moved = np.concatenate((np.linalg.solve(own, by_end[..., :near, :]), far), axis=2)
    return -np.swapaxes(by_end, -1, -2) @ moved, factor * lost[:, None, :d, :d]
