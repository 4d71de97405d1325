"""Flexibility of free cables: derivatives by force, length and material, stretch losses, quasi-static displacements."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from sagline.cables.model import CableState
from sagline.core.arrays import Array
from sagline.kernels.dynamics import string as columns
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import cable_slopes, motions_of_ends
from sagline.statics.stiffness import Modes
from sagline.statics.strings import Strings, strings_of

_SMOOTH = 0.1  # up to this value of w L/(N_A + N_B), twelve integration points are exact except for rounding
_POINTS, _SHARES = (0.5 * np.array(values) for values in np.polynomial.legendre.leggauss(12))
_ALONG, _ACROSS, _UP = 0, 1, 2  # axes of a cable
_TINY = np.finfo(float).tiny


class _CatenaryState:
    """Cables in their planes, fields of shape (..., m)."""

    def __init__(self, cables: CableState, weight: Array) -> None:
        # weight: weight per length [N/m]
        # length: unstrained length [m]
        self.weight, self.length = weight, cables.unstrained_length
        # h: horizontal force [N]
        # b: vertical force at the platform end [N]
        self.h, self.b = cables.horizontal_tension, cables.vertical_force
        self.a = self.b - weight * self.length  # vertical force at the frame end [N]
        # size_a: tension at the frame end [N]
        # size_b: tension at the platform end [N]
        self.size_a, self.size_b = np.hypot(self.h, self.a), np.hypot(self.h, self.b)
        self.product = self.size_a * self.size_b  # N_A N_B, product of the tensions at the ends [N^2]
        self.slope = (self.a + self.b) / (self.size_a + self.size_b)  # mean slope (V_A + V_B)/(N_A + N_B)
        self.smooth = weight * self.length <= _SMOOTH * (self.size_a + self.size_b)  # true for nearly straight cables


class Flexibility:
    """Derivatives of the displacement of a cable's platform end per force, without pulleys and dead length."""

    def __init__(self, state: Equilibrium, force: Array) -> None:
        """Derivatives of the free spans; `force`: on the platform ends, (..., m, 3) [N]."""
        cables = state.cables
        length = cables.unstrained_length
        stiffness = np.broadcast_to(cables.cable.axial_stiffness, length.shape)
        gravity = 0.0 if cables.model.weightless else cables.gravity
        weight = gravity * np.broadcast_to(cables.cable.linear_density, length.shape)
        axes = _axes(force)
        with np.errstate(all="ignore"):
            hung = _CatenaryState(cables, weight)
            slack = (hung.size_b == 0.0) & (weight == 0.0)
            by_force, by_weight, outer = _by_force(hung), _by_weight(hung), _outer(hung)
            by_length = flexibility_per_length(np.stack((hung.h, np.zeros_like(hung.h), hung.a), axis=-1), stiffness)

        def world(matrix: Array) -> Array:
            held = np.where(slack[..., None, None], 0.0, matrix)
            return np.asarray(np.swapaxes(axes, -1, -2) @ held @ axes)

        by_force = np.where(slack[..., None, None, None], 0.0, by_force)
        # with respect to the force on the platform end, symmetric in all axes [m/N^2], shape (..., m, 3, 3, 3)
        self.by_force = np.einsum("...abc,...ai,...bj,...ck->...ijk", by_force, axes, axes, axes, optimize=True)
        # by_length: with respect to the length of cable added at the frame end [1/N], shape (..., m, 3, 3)
        # by_density: with respect to the linear density [m^2/(N kg)], shape (..., m, 3, 3)
        self.by_length, self.by_density = world(by_length), gravity * world(by_weight)
        # with respect to the axial stiffness [m/N^2], shape (..., m, 3, 3)
        self.by_stiffness = world(np.eye(3) * (-length / stiffness**2)[..., None, None])
        # stretch part: integral of t t^T/EA ds with the tangent t [m/N], shape (..., m, 3, 3)
        self.stretch = world(outer / stiffness[..., None, None])


def _axes(force: Array) -> Array:
    """Horizontal, normal and upward axes of a cable, as rows, (..., m, 3, 3); arbitrary if the force is vertical."""
    level = np.hypot(force[..., 0], force[..., 1])
    vertical = level == 0.0
    x = np.where(vertical, 1.0, force[..., 0]) / np.where(vertical, 1.0, level)
    y = np.where(vertical, 0.0, force[..., 1]) / np.where(vertical, 1.0, level)
    axes = np.zeros((*force.shape, 3))
    axes[..., _ALONG, 0], axes[..., _ALONG, 1] = x, y
    axes[..., _ACROSS, 0], axes[..., _ACROSS, 1] = -y, x
    axes[..., _UP, 2] = 1.0
    return axes


def flexibility_per_length(force: Array, stiffness: Array | float) -> Array:
    """Flexibility per length C at points of cables with given forces (..., 3) and EA (...), shape (..., 3, 3)."""
    size = np.linalg.norm(force, axis=-1)[..., None, None]
    tangent = force[..., :, None] * force[..., None, :] / size**2
    return np.asarray(np.eye(3) / np.asarray(stiffness)[..., None, None] + (np.eye(3) - tangent) / size)


def _by_force(hung: _CatenaryState) -> Array:
    """Integral of dC/df, (..., 3, 3, 3)."""
    h, a, b, product = hung.h, hung.a, hung.b, hung.product
    sine_a, sine_b = a / hung.size_a, b / hung.size_b
    turned = _turned(hung)
    lifted = -hung.length * hung.slope / product
    cubes = (hung.size_a**2 + product + hung.size_b**2) / product**3
    steep = hung.length * hung.slope * cubes  # -(N_B^-3 - N_A^-3)/w
    mean = 0.5 * hung.length * (hung.size_a**-3 + hung.size_b**-3)
    return _symmetric(
        {
            (_ALONG, _ALONG, _ALONG): -turned * (sine_b**2 + sine_b * sine_a + sine_a**2),
            (_ALONG, _ALONG, _UP): lifted + h**2 * steep,
            (_ALONG, _UP, _UP): -h * (mean - 0.5 * (a + b) * steep),
            (_UP, _UP, _UP): -(h**2) * steep,
            (_ALONG, _ACROSS, _ACROSS): -turned,
            (_ACROSS, _ACROSS, _UP): lifted,
        }
    )


def _turned(hung: _CatenaryState) -> Array:
    """Integral of h/N^3, which is (sine_b - sine_a)/(h w), without cancellation."""
    cosine = (hung.h**2 + hung.a * hung.b) / hung.product
    near = hung.length / hung.product * hung.h * (1.0 / hung.size_a + 1.0 / hung.size_b) / (1.0 + cosine)
    far = (hung.b / hung.size_b - hung.a / hung.size_a) / (hung.h * hung.weight)
    return np.where(cosine > 0.0, near, far)


def _by_weight(hung: _CatenaryState) -> Array:
    """Derivative (..., 3, 3) with respect to the weight per length, at a constant force on the platform end."""
    h, product = hung.h, hung.product
    lifted = -hung.length * hung.slope / product
    turned = _turned(hung)
    across = 2.0 * np.arctanh(hung.weight * hung.length / (hung.size_a + hung.size_b)) / hung.weight
    whole = _plane_of(across - h * turned, across, h * lifted, h * turned)  # part of the flexibility without EA
    force = np.stack((h, np.zeros_like(h), hung.b), axis=-1)
    # this part is homogeneous of degree -1 in force and weight
    steep = -(whole + np.einsum("...abc,...c->...ab", _by_force(hung), force)) / hung.weight[..., None, None]
    size, h, v, below = _points(hung)
    drop = -v / size**3
    even = _plane_of(
        drop * (1.0 - 3.0 * (h / size) ** 2),
        drop,
        -h / size**3 * (1.0 - 3.0 * (v / size) ** 2),
        3.0 * drop * (h / size) ** 2,
    )
    even = -np.einsum("...p,...pab->...ab", below * hung.length[..., None] * _SHARES, even)
    return np.asarray(np.where(hung.smooth[..., None, None], even, steep))


def _outer(hung: _CatenaryState) -> Array:
    """Integral of t t^T, (..., 3, 3)."""
    none, length = np.zeros_like(hung.h), hung.length
    turned = np.arctan2(hung.h * hung.weight * length, hung.h**2 + hung.a * hung.b)
    level = hung.h * turned / hung.weight
    mixed = hung.h * np.log(hung.size_b / hung.size_a) / hung.weight
    steep = _plane_of(level, none, mixed, length - level)
    size, h, v, _ = _points(hung)
    even = _plane_of((h / size) ** 2, np.zeros_like(v), h * v / size**2, (v / size) ** 2)
    even = np.einsum("...p,...pab->...ab", length[..., None] * _SHARES, even)
    return np.asarray(np.where(hung.smooth[..., None, None], even, steep))


def _points(hung: _CatenaryState) -> tuple[Array, Array, Array, Array]:
    """Tension, horizontal and vertical force at integration points, and the length from the platform end, (..., P)."""
    below = (0.5 - _POINTS) * hung.length[..., None]
    v = hung.b[..., None] - hung.weight[..., None] * below
    h = np.broadcast_to(hung.h[..., None], v.shape)
    return np.hypot(h, v), h, v, below


def _plane_of(along: Array, across: Array, mixed: Array, up: Array) -> Array:
    """Matrices (..., 3, 3) from their in-plane elements and their normal element, without coupling terms."""
    whole = np.zeros((*along.shape, 3, 3))
    whole[..., _ALONG, _ALONG], whole[..., _ACROSS, _ACROSS], whole[..., _UP, _UP] = along, across, up
    whole[..., _ALONG, _UP] = whole[..., _UP, _ALONG] = mixed
    return whole


def _symmetric(parts: dict[tuple[int, int, int], Array]) -> Array:
    """Tensor that is symmetric in all three axes, with the independent elements `parts`."""
    whole = np.zeros((*next(iter(parts.values())).shape, 3, 3, 3))
    for place, values in parts.items():
        for turned in permutations(place):
            whole[..., turned[0], turned[1], turned[2]] = values
    return whole


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
    compliance = Flexibility(state, slopes.force).stretch + behind[:, :, None] * behind[:, None, :]
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
