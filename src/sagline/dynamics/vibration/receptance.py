"""Receptance of the platform, from component modes or exact, and its peak."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.core.progress import blocks
from sagline.dynamics.vibration.component_modes import CableComponents, PlaneModes, component_modes, stretch_stiffness
from sagline.dynamics.vibration.dynamic_stiffness import Complex, Damping, moving_stiffness
from sagline.dynamics.vibration.robot_modes import StateModes, VibrationModel

LOWEST: Final = 1.0  # [Hz], modes up to this frequency are always included
TAKEN: Final = 1.6  # modes up to this factor times the highest frequency are included
# losses couple modes up to this factor times the highest frequency; they damp each higher mode separately
COUPLED: Final = 1.5
BLOCK: Final = 128  # frequencies per block


# component modes of one state, and loss matrices of their stretch (None without loss)
FixedEndModes: TypeAlias = tuple[CableComponents, Array | None]


class Receptance(NamedTuple):
    """Model of the platform's receptance."""

    model: VibrationModel  # model of one state, with a leading axis 1
    matrix: Array  # stiffness of the platform, not symmetric with an external moment, shape (6, 6)
    cables: Array  # stiffness of the cables at their platform ends, shape (m, 3, 3)
    damping: Damping  # energy losses

    def fixed_end_modes(self, up_to: float) -> FixedEndModes:
        """Fixed-end modes of the cables up to the frequency `up_to` [Hz]."""
        components = component_modes(self.model.strings, 0, max(TAKEN * up_to, LOWEST))
        return components, stretch_stiffness(components) if self.damping.loss_time > 0.0 else None

    def by_modes(self, frequency: Array, held: FixedEndModes) -> tuple[Complex, Complex]:
        """Two compliances: with cable mass, computed from the modes of the cables, and with massless cables."""
        # shapes: frequency (F,) [Hz]; returns (F, 6, 6)
        found = np.empty((2, frequency.size, 6, 6), dtype=np.complex128)
        for part in blocks(frequency.size, BLOCK):
            moving, still = self._moving(*held, 2.0 * np.pi * frequency[part])
            found[0, part] = self._compliance(frequency[part], moving)
            found[1, part] = self._compliance(frequency[part], still)
        return found[0], found[1]

    def exact(self, frequency: Array) -> Complex:
        """Compliance (F, 6, 6), computed from the exact dynamic stiffness of the cables; `frequency` (F,) [Hz]."""
        strings = self.model.strings
        moving = moving_stiffness(strings, frequency, self.damping)
        moving -= 2j * self.damping.modal_damping * self.cables  # the whole stiffness already includes modal damping
        moving[:, ~strings.taut[0]] = 0.0
        return self._compliance(frequency, moving)

    def _compliance(self, frequency: Array, moving: Complex) -> Complex:
        """Compliance: inverse of the dynamic stiffness. `moving` (F, m, 3, 3): dynamic part of cables' stiffness."""
        model, omega = self.model, 2.0 * np.pi * frequency[:, None, None]
        ends, freedom = model.ends[0], model.freedom
        on_platform = np.einsum("mai,fmab,mbj->fij", ends, moving, ends, optimize=True)
        whole = (1.0 + 2j * self.damping.modal_damping) * self.matrix + on_platform - omega**2 * model.mass[0]
        with np.errstate(all="ignore"):
            return np.asarray(freedom.T @ np.linalg.inv(freedom @ whole @ freedom.T) @ freedom)

    def _moving(self, components: CableComponents, lost: Array | None, omega: Array) -> tuple[Complex, Complex]:
        """Dynamic part of the cables' stiffness: first with cable mass, then without, (F, m, 3, 3) each."""
        mesh, model = components.mesh, self.model
        density = mesh.density[:, None, None]
        square = omega**2 - 1j * omega * self.damping.air_damping / density[:, 0]  # (t, F)
        loss = 1.0 + 2j * self.damping.modal_damping
        moving = np.zeros((omega.size, model.strings.taut.shape[1], 3, 3), dtype=np.complex128)
        still = np.zeros_like(moving)
        moving[:, mesh.taut] = -np.swapaxes(square, 0, 1)[..., None, None] * components.still[mesh.taut]
        aside = _driven_stiffness(components.normal, square, loss)
        if lost is None:
            inside = _driven_stiffness(components.plane, square, loss)
        else:
            scaled = np.asarray(1j * loss * self.damping.loss_time * omega, dtype=np.complex128)
            inside, bare = _driven_stiffness_with_loss(components.plane, square, loss, lost, scaled)
            still[:, mesh.taut] = _in_world(bare, mesh.axes[:, ::2])
            inside += bare
        moving[:, mesh.taut] += _in_world(inside, mesh.axes[:, ::2]) + _in_world(aside, mesh.axes[:, 1:2])
        return moving, still


def _in_world(own: Complex, axes: Array) -> Complex:
    """Matrices (F, t, 3, 3) in world axes, converted from matrices (t, F, d, d) along directions (t, d, 3)."""
    return np.asarray(np.einsum("tai,tfab,tbj->ftij", axes, own, axes, optimize=True))


def _driven_stiffness(motions: PlaneModes, square: Complex, loss: complex) -> Complex:
    """Contribution of the fixed-end modes to the platform-end stiffness, with equal or no damping, (t, F, d, d)."""
    with np.errstate(all="ignore"):
        shares = square[..., None] ** 2 / (loss * motions.square[:, None] - square[..., None])
    return np.asarray(-np.einsum("tka,tfk,tkb->tfab", motions.drive, shares, motions.drive, optimize=True))


def _driven_stiffness_with_loss(
    motions: PlaneModes, square: Complex, loss: complex, lost: Array, scaled: Complex
) -> tuple[Complex, Complex]:
    """Contribution of fixed-end modes to the platform-end stiffness, with stretch loss; `lost` (t, d + k, d + k)."""
    d, factor = motions.drive.shape[2], scaled[None, :, None, None]
    by_end = -square[..., None, None] * motions.drive[:, None] + factor * lost[:, None, d:, :d]
    alone = loss * motions.square[:, None] - square[..., None]
    near = int((motions.square < COUPLED**2 * np.abs(square).max()).sum(axis=1).max())  # ascending for each cable
    own = factor * lost[:, None, d : d + near, d : d + near]
    index = np.arange(near)
    own[..., index, index] += alone[..., :near]
    stretched = np.einsum("tkk->tk", lost[:, d:, d:])[:, None, near:]
    far = by_end[..., near:, :] / (alone[..., near:] + factor[..., 0] * stretched)[..., None]
    moved = np.concatenate((np.linalg.solve(own, by_end[..., :near, :]), far), axis=2)
    return -np.swapaxes(by_end, -1, -2) @ moved, factor * lost[:, None, :d, :d]


ForceReceptance: TypeAlias = Callable[[Array], Complex]  # displacements per force (F, 3, 3) at frequencies (F,)

# the search omits modes whose response is below this share of the largest response at a mode
LIKELY: Final = 0.4
REFINEMENTS: Final = 2  # number of refinements of the search
CLOSER: Final = 5  # number of new frequencies between two adjacent frequencies
WIDTHS: Final = np.linspace(-3.0, 3.0, 7)  # search points about a mode, in units of half the peak width


def modal_receptance(found: StateModes, rest: Array, ratio: float) -> ForceReceptance:
    """Receptance from the modes of a robot. A common loss factor of the whole stiffness does not couple these modes."""
    # shapes: rest (3, 3)
    natural = (2.0 * np.pi * found.frequency) ** 2
    products = (found.platform[:3, None] * found.platform[None, :3]).reshape(9, -1)
    lossy = 1.0 + 2j * ratio
    beyond = (rest - (products @ (1.0 / natural)).reshape(3, 3)) / lossy

    def receptance(frequency: Array) -> Complex:
        terms = 1.0 / (lossy * natural - (2.0 * np.pi * frequency[:, None]) ** 2)
        return np.asarray(beyond + (terms @ products.T).reshape(-1, 3, 3))

    return receptance


def coupled_receptance(receptance: Receptance, up_to: float) -> ForceReceptance:
    """Function that computes the receptance up to the frequency `up_to` [Hz], for losses that couple the modes."""
    held = receptance.fixed_end_modes(up_to)
    return lambda frequency: receptance.by_modes(frequency, held)[0][:, :3, :3]


def peak_receptance(
    receptance: ForceReceptance, natural: Array, ratios: Array, damping: Damping
) -> tuple[float, float]:
    """Largest displacement per force in any direction, static or near a mode."""
    # shapes: natural (K,) [Hz]; ratios (K,); returns [m/N], [Hz]
    if damping == Damping():
        return np.inf, float(natural[0])
    around = np.concatenate(([0.0], natural))
    sizes = np.linalg.norm(receptance(around), axis=(1, 2))
    likely = np.flatnonzero(sizes[1:] >= LIKELY * sizes.max())
    near = natural[likely, None] * (1.0 + ratios[likely, None] * WIDTHS)
    frequency = np.unique(np.concatenate((around[:1], near.ravel())))
    for _ in range(REFINEMENTS):
        found = receptance(frequency)
        norms = np.sqrt(np.linalg.eigvalsh(np.swapaxes(found.conj(), -1, -2) @ found)[:, -1])
        best = int(np.argmax(norms))
        if not 0 < best < norms.size - 1:
            return float(norms[best]), float(frequency[best])
        top, before, after = (frequency[best + k] for k in (0, -1, 1))
        frequency = np.concatenate((np.linspace(before, top, CLOSER), np.linspace(top, after, CLOSER)[1:]))
    return _parabola_peak(np.array((before, top, after)), norms[best - 1 : best + 2])


def _parabola_peak(frequency: Array, norms: Array) -> tuple[float, float]:
    """Height and place of a peak from three values of `norms`, by a parabola through their inverse squares."""
    (before, after), flat = np.diff(frequency), norms**-2.0
    left, right = np.diff(flat) / (before, after)
    bend = (right - left) / (before + after)
    if not bend > 0.0:
        return float(norms[1]), float(frequency[1])
    slope = (left * after + right * before) / (before + after)
    off = -0.5 * slope / bend
    least = flat[1] + 0.5 * slope * off
    return float(least**-0.5), float(frequency[1] + off)
