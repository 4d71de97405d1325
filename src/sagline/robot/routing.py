"""Routing of cables between exit points and drums: friction, and catenaries between guides.

For lengths, energy and stiffness, the kernels assume a straight guided cable without friction between exit point and
drum. This module computes the difference between actual and assumed unstrained length. See docs/model.md, section 10.

With friction, the tensions on the two sides of a bend of angle psi differ by the factor exp(mu psi), and the bearing of
the pulley takes the share f of the tension. While a drum winds in, both effects increase the tension at the drum. The
weight of the cable on the pulley is included to first order. Between guides, a cable is a catenary. Along a cable
without friction, T + T^2/(2 EA) - w z is constant, which gives the tension at the other end.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any, Final, TypeAlias

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel, CableState
from sagline.cables.models import Catenary, Elastic
from sagline.core.arrays import LARGEST, Array, Flags, Indices, locked
from sagline.kernels import codes
from sagline.robot.batch import outward, refuse_slanted, winches_of
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

# Bend angles and tensions depend on each other. Each iteration adds at least one correct digit to both.
PASSES: Final = 40
STEPS: Final = 60  # iterations of Newton's method for one span
_TOLERANCE: Final = 1e-15  # relative change of a length at convergence
_TENSION_TOLERANCE: Final = 1e-14  # relative change of a tension at convergence
_BALANCED: Final = 1e-12  # relative tolerance of tensions
_STEP: Final = 1e-6  # relative step of the tension for its numerical derivative
_TINY: Final = 1e-300


# Three arrays (N, m): unstrained length of the cables on the pulleys [m]; unstrained length between pulleys and drums
# [m], NaN for a cable that is too slack for a catenary; tension at the drums [N].
_Routing: TypeAlias = tuple[Array, Array, Array]


class _ExitState:
    """Cables at their exit points P, fields of shape (K,)."""

    def __init__(self, state: Equilibrium, robot: Robot, winches: Winch, known: Flags, cable: Indices) -> None:
        contact = state.contact
        assert contact is not None
        material, exact = robot.cables, state.cables.model.code == codes.CATENARY
        # tension: T_A at the exit point P [N]
        # stiffness: EA [N]
        self.tension, self.stiffness = _exit_tension(state)[known], material.axial_stiffness[cable]
        # w [N/m]; 0 for a cable model without weight between P and the drum
        self.weight = material.linear_density[cable] * robot.gravity * exact
        # wrap: psi [rad]
        # entry: +1 for a cable that enters its pulley from below, -1 from above
        self.wrap, self.entry = contact.wrap_angle[known], winches.swivel_axis[cable, 2]
        # sine: sin psi
        # radius: R [m]
        self.sine, self.radius = np.sin(self.wrap), winches.pulley_radius[cable]
        across = self.sine[:, None] * outward(robot, state.pose)[known][:, :2]
        # unit tangent at P, toward the platform, shape (K, 3)
        self.tangent = np.concatenate((across, (self.entry * np.cos(self.wrap))[:, None]), axis=-1)
        sign = np.zeros(self.wrap.shape) if contact.winding is None else contact.winding[known]
        self.friction = sign * winches.pulley_friction[cable]  # mu; negative while paying out, 0 at rest
        # 1 + f while winding in, 1 - f while paying out, 1 at rest
        self.rolling = 1.0 + sign * winches.rolling_friction[cable]

    def entering(self, bend: Array) -> Array:
        """Tension [N] on the drum side of the pulley, if the cable has an additional bend [rad] at the frame anchor."""
        rubbed = self.tension * np.exp(self.friction * (self.wrap + bend)) * self.rolling
        drop = 2.0 * self.weight * self.radius * self.entry * self.sine / self.stiffness
        return tension_after(rubbed, drop, self.stiffness)


def differs(robot: Robot | tuple[Robot, ...], winding: Array | None) -> bool:
    """True if guides, or friction with the directions `winding`, make lengths differ from lengths of the kernels."""
    rubs = winding is not None and bool(winding.any())
    return any(
        each.guides is not None or (rubs and bool(each.pulley_friction.any() or each.rolling_friction.any()))
        for each in winches_of(robot)
    )


def with_routing(state: Equilibrium, winding: Array | None) -> Equilibrium:
    """Equilibrium in which lengths include guides and friction between exit points and drums."""
    # winding: +1 winding in, -1 paying out, 0 at rest, (m,) or (N, m); None for no friction. The length is NaN for a
    # cable that is too slack for a catenary between guides. Without guides and friction, `state` itself is returned.
    if state.contact is None or (winding is None and not differs(state.robot, None)):
        return state
    kept = None if winding is None else locked(np.array(np.broadcast_to(winding, state.cables.shape)))
    contact = replace(state.contact, winding=kept)
    if differs(state.robot, kept):
        wrapped, dead, _ = actual_routing(replace(state, contact=contact))
        contact = replace(contact, wrapped_length=locked(wrapped), dead_length=locked(dead))
    return replace(state, contact=contact)


def kernel_length(state: Equilibrium) -> Array:
    """Unstrained lengths [m] that the kernels use, which are lengths of straight guided cables without friction."""
    contact = state.contact
    if contact is None or not differs(state.robot, contact.winding) or state.cables.model.code == codes.STRAIGHT:
        return state.unstrained_length
    plain = replace(state, contact=replace(contact, winding=None))
    wrapped, dead, _ = actual_routing(plain, guided=True)
    return locked(state.free_length + (wrapped + dead))


def actual_routing(state: Equilibrium, *, guided: bool = False) -> _Routing:
    """Lengths and tensions of the routing; guided: True for straight guided cables in place of catenaries."""
    if isinstance(state.robot, Robot):
        return _routing_of_robot(state, state.robot, guided=guided)
    parts = [_routing_of_robot(state[i], one, guided=guided) for i, one in enumerate(state.robot)]
    wrapped, dead, tension = (np.stack(each) for each in zip(*parts, strict=True))
    return wrapped, dead, tension


def _routing_of_robot(state: Equilibrium, robot: Robot, *, guided: bool) -> _Routing:
    contact, winches, shape = state.contact, robot.winches, state.cables.shape
    assert contact is not None
    if winches is None or not winches.anything_behind:
        return np.zeros(shape), np.zeros(shape), _exit_tension(state)
    refuse_slanted(robot)
    # friction does not change the length of a cable that does not stretch
    if state.cables.model.code == codes.STRAIGHT:
        dead = np.broadcast_to(winches.dead_cable, shape)
        return winches.pulley_radius * contact.wrap_angle, dead, _exit_tension(state)
    found = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    known = np.isfinite(_exit_tension(state))
    if not known.any():
        return found
    cable = np.broadcast_to(np.arange(shape[-1]), shape)[known]
    leaving = _ExitState(state, robot, winches, known, cable)
    if guided or winches.guides is None:
        part = _straight_run(leaving, winches.dead_cable[cable], winches.dead_rise[cable])
    else:
        part = _guided_spans(leaving, winches, robot, state.cables.model, cable)[:2]
    for whole, some in zip(found, (_wrapped_length(leaving), *part), strict=True):
        whole[known] = some
    return found


def guide_forces(state: Equilibrium) -> Array:
    """Forces [N] of the guided cables on frame anchors, guides and drums, world axes, (..., m, k + 1, 3)."""
    # The order is from the frame anchor to the drum. The robot must have k guides per cable.
    robot, winches = state.one_robot, state.one_robot.winches
    assert winches is not None
    assert winches.guides is not None
    refuse_slanted(robot)
    known = np.isfinite(_exit_tension(state))
    cable = np.broadcast_to(np.arange(known.shape[-1]), known.shape)[known]
    found = np.full((*known.shape, winches.guides.shape[1] + 1, 3), np.nan)
    leaving = _ExitState(state, robot, winches, known, cable)
    found[known] = _guided_spans(leaving, winches, robot, state.cables.model, cable)[2]
    return found


def _exit_tension(state: Equilibrium) -> Array:
    """Tensions [N] at the exit points P: frame-end tensions in the exact model, chord tensions in all other models."""
    cables = state.cables
    return cables.frame_end_tension if cables.model.code == codes.CATENARY else state.chord_tension


def tension_after(tension: Array, drop: Array, stiffness: Array) -> Array:
    """Tension [N] at another point of a cable, where (1 + strain)^2 is smaller by `drop` than for `tension`."""
    strain = tension / stiffness
    gained = strain * (2.0 + strain) - drop  # (1 + strain)^2 - 1
    with np.errstate(invalid="ignore"):
        return np.asarray(stiffness * gained / (1.0 + np.sqrt(1.0 + gained)))


def _wrapped_length(at: _ExitState) -> Array:
    """Unstrained length on the pulleys [m]."""
    strain = at.tension / at.stiffness
    strained = 1.0 + strain
    beta = at.weight * at.radius / at.stiffness
    falls = at.entry * beta * (1.0 - np.cos(at.wrap) - at.wrap * at.sine)
    rubs = at.friction != 0.0
    friction = np.where(rubs, at.friction, 1.0)
    # with friction: ln((1 + e exp(mu psi))/E)/mu; without friction: psi e/E
    stretched = np.log1p(strain / strained * np.expm1(friction * at.wrap)) / friction
    stretched = np.where(rubs, stretched, at.wrap * strain / strained)
    return np.asarray(at.radius * (at.wrap - stretched - falls / strained**3))


def _straight_run(at: _ExitState, length: Array, rise: Array) -> tuple[Array, Array]:
    """Unstrained length of straight guided cables between pulley and drum [m], and tension at the drum [N]."""
    first = at.entering(np.zeros(1))
    last = tension_after(first, 2.0 * at.weight * rise / at.stiffness, at.stiffness)
    return 2.0 * length / (2.0 + (first + last) / at.stiffness), last


def _guided_spans(
    at: _ExitState, winches: Winch, robot: Robot, model: CableModel, cable: Indices
) -> tuple[Array, Array, Array]:
    """Unstrained length between pulley and drum [m], and tension at the drum [N], of cables with guides."""
    # Also returns the forces on anchors, guides and drums (K, k + 1, 3) [N]. Tensions and bend angles depend on each
    # other, and are computed alternately until convergence.
    assert winches.guides is not None
    # frame anchors A and guides, in the order toward the drum
    points = np.concatenate((winches.guides, robot.frame_anchors[:, None]), axis=1)[cable, ::-1]
    hanging = Catenary() if model.code == codes.CATENARY else Elastic()
    material = Cable(robot.cables.linear_density[cable], robot.cables.axial_stiffness[cable])
    axis, eyelet = winches.swivel_axis[cable], at.radius == 0.0
    # An eyelet at the frame anchor bends the cable between the direction of the last span and the exit direction. At a
    # pulley, the span meets the direction of the swivel axis.
    onward = np.where(eyelet[:, None], at.tangent, axis)
    at = copy(at)
    at.wrap = np.where(eyelet, 0.0, at.wrap)
    steps = points[:, :-1] - points[:, 1:]
    along = steps / np.linalg.norm(steps, axis=-1, keepdims=True)
    bends = [_angle(along[:, j], along[:, j - 1] if j else onward) for j in range(steps.shape[1])]
    length = np.full(at.tension.shape, np.nan)
    tension, forces = length, np.full(points.shape, np.nan)
    for _ in range(PASSES):
        last, length, leaving = length, np.zeros(length.shape), onward
        tension = at.entering(bends[0])
        forces[:] = 0.0
        for j, step in enumerate(np.moveaxis(steps, 1, 0)):
            if j:
                tension = tension * np.exp(at.friction * bends[j])
            span = _span(hanging, material, step, tension, robot.gravity)
            length, tension = length + span.unstrained_length, span.frame_end_tension
            upper, lower = _end_forces(span, step)
            forces[:, j] -= upper
            forces[:, j + 1] += lower
            bends[j], leaving = _angle(_unit(upper), leaving), _unit(lower)
        settled = np.isnan(length) | (np.abs(length - last) <= _TOLERANCE * length)
        if settled.all() or not at.friction.any():
            break
    return length, tension, forces


def _span(model: CableModel, cable: Cable, step: Array, tension: Array, gravity: float) -> CableState:
    """Catenaries over the vectors `step` (K, 3) [m] with `tension` [N] at the platform-side ends; NaN if impossible."""
    # If the chord tension grows, the tension at the end first decreases to a minimum and then increases. Catenaries
    # with a smaller end tension than this minimum do not exist.
    level, rise = np.hypot(step[:, 0], step[:, 1]), step[:, 2]
    weight = 0.0 if model.weightless else cable.linear_density * gravity
    least = 1e-9 * cable.axial_stiffness

    def missed(chord: Array) -> tuple[Array, CableState]:
        state = model.from_tension(cable, level, rise, np.clip(chord, least, LARGEST / 2.0), gravity)
        return state.platform_end_tension - tension, state

    chord = np.nan_to_num(tension - 0.5 * weight * rise, nan=0.0)
    for _ in range(STEPS):
        chord = np.maximum(chord, least)
        wrong, _ = missed(chord)
        slope = (missed(chord * (1.0 + _STEP))[0] - wrong) / (_STEP * chord)
        with np.errstate(invalid="ignore", divide="ignore"):
            move = np.where(slope > _STEP, wrong / slope, 0.0)
        chord = chord - np.nan_to_num(move, nan=0.0)
        if not (np.abs(move) > _TENSION_TOLERANCE * chord).any():
            break
    wrong, state = missed(chord)
    lost = ~(np.abs(wrong) <= _BALANCED * tension) | ~(chord > least)
    gone: dict[str, Any] = {
        name: locked(np.where(lost, np.nan, getattr(state, name)))
        for name in ("unstrained_length", "horizontal_tension", "vertical_force", "chord_tension")
    }
    return replace(state, **gone)


def _end_forces(span: CableState, step: Array) -> tuple[Array, Array]:
    """Forces (K, 3) [N] along both ends of catenaries over the vectors `step`; the forces point toward the platform."""
    outward = step[:, :2] / np.maximum(np.hypot(step[:, 0], step[:, 1])[:, None], _TINY)
    level, vertical = span.horizontal_tension[:, None] * outward, span.vertical_force
    upper, lower = (np.column_stack((level, end)) for end in (vertical, vertical - span.cable_weight))
    return upper, lower


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), _TINY))


def _angle(one: Array, other: Array) -> Array:
    """Angles (K,) [rad] between the unit vectors `one` and `other`, both (K, 3)."""
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(one - other, axis=-1), np.linalg.norm(one + other, axis=-1)))
