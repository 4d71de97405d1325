"""Routing between exit points and drums: friction, and catenary spans between guides.

Kernels model this routing as a straight, guided cable without friction, also for energy and stiffness. This module
computes the difference of unstrained length between the actual routing and this model; docs/model.md, section 10.

With friction, the tensions on the two sides of a bend of angle psi differ by the factor exp(mu psi), and the bearing of
the pulley takes the share f of the tension. Both effects increase the tension toward the drum while winding in. The
weight of the cable on the pulley is included to first order, as without friction. Between guides a cable is a catenary.
The tension of its far end follows from T + T^2/(2 EA) - w z, which is constant along a cable without friction.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from sagline.cables.cable import Cable
from sagline.cables.model import CableModel, CableState
from sagline.cables.models import Catenary, Elastic
from sagline.core.arrays import LARGEST, Array, Flags, Indices, locked
from sagline.kernels import codes
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

# iterations between bend angles and tensions, which depend on each other; each adds at least one correct digit
PASSES: Final = 40
STEPS: Final = 60  # iterations of Newton's method for one span
_TOLERANCE: Final = 1e-15  # relative change of a length
_TENSION_TOLERANCE: Final = 1e-14  # relative change of a tension
_BALANCED: Final = 1e-12  # relative tolerance of tensions
_STEP: Final = 1e-6  # relative step of the tension for its numerical derivative
_TINY: Final = 1e-300


# Unstrained length of the cables on the pulleys [m]; their unstrained length between pulleys and drums [m], NaN if a
# cable is too slack for a catenary; and their tension at the drums [N]; all (N, m)
_Routing: TypeAlias = tuple[Array, Array, Array]


class _ExitState(NamedTuple):
    """State of K cables at their exit points, arrays of shape (K,)."""

    tension: Array  # T_A at the exit point P [N]
    weight: Array  # w [N/m]; 0 if the cable model has no weight between P and the drum
    stiffness: Array  # EA [N]
    wrap: Array  # psi [rad]
    sine: Array  # sin psi
    tangent: Array  # unit tangent at P, toward the platform, shape (K, 3)
    radius: Array  # R [m]
    entry: Array  # +1 if a cable enters from below, -1 if from above
    friction: Array  # mu, with the sign of the winding
    rolling: Array  # 1 + f while winding in, 1 - f while paying out, 1 at rest

    def entering(self, bend: Array) -> Array:
        """Tension [N] on the drum side of the pulley, after an additional bend [rad] at the frame anchor."""
        rubbed = self.tension * np.exp(self.friction * (self.wrap + bend)) * self.rolling
        drop = 2.0 * self.weight * self.radius * self.entry * self.sine / self.stiffness
        return _tension_after(rubbed, drop, self.stiffness)


def differs(robot: Robot | tuple[Robot, ...], winding: Array | None) -> bool:
    """True if the routing differs from a straight guided cable without friction; winding: +1, -1 and 0, or None."""
    winches = [one.winches for one in ((robot,) if isinstance(robot, Robot) else robot) if one.winches is not None]
    rubs = winding is not None and bool(winding.any())
    return any(
        each.guides is not None or (rubs and bool(each.pulley_friction.any() or each.rolling_friction.any()))
        for each in winches
    )


def with_routing(state: Equilibrium, winding: Array | None) -> Equilibrium:
    """Equilibrium with the lengths of the actual routing between exit points and drums.

    winding: +1 winding in, -1 paying out, 0 at rest, (m,) or (N, m); None: no friction. The lengths are NaN for a cable
    that is too slack for a catenary between its guides. Without guides and friction, `state` is returned.
    """
    if state.contact is None or (winding is None and not differs(state.robot, None)):
        return state
    kept = None if winding is None else locked(np.array(np.broadcast_to(winding, state.cables.shape)))
    contact = replace(state.contact, winding=kept)
    if differs(state.robot, kept):
        wrapped, dead, _ = actual_routing(replace(state, contact=contact))
        contact = replace(contact, wrapped_length=locked(wrapped), dead_length=locked(dead))
    return replace(state, contact=contact)


def kernel_length(state: Equilibrium) -> Array:
    """Unstrained lengths of straight guided cables, for the kernels [m]."""
    contact = state.contact
    if contact is None or not differs(state.robot, contact.winding) or state.cables.model.code == codes.STRAIGHT:
        return state.unstrained_length
    plain = replace(state, contact=replace(contact, winding=None))
    wrapped, dead, _ = _routing(plain, guided=True)
    return locked(state.free_length + (wrapped + dead))


def actual_routing(state: Equilibrium) -> _Routing:
    """The actual routing with guides, and with friction if the contact of `state` has winding directions."""
    return _routing(state, guided=False)


def _routing(state: Equilibrium, *, guided: bool) -> _Routing:
    """Compute the routing, separately for each of several robots; guided: True for straight guided cables."""
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
    # a cable that does not stretch has the same length with and without friction
    if state.cables.model.code == codes.STRAIGHT:
        dead = np.broadcast_to(winches.dead_cable, shape)
        return winches.pulley_radius * contact.wrap_angle, dead, _exit_tension(state)
    found = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, np.nan)
    known = np.isfinite(_exit_tension(state))
    if not known.any():
        return found
    cable = np.broadcast_to(np.arange(shape[-1]), shape)[known]
    leaving = _exit_state(state, robot, winches, known, cable)
    if guided or winches.guides is None:
        part = _straight_run(leaving, winches.dead_cable[cable], winches.dead_rise[cable])
    else:
        points = np.concatenate((winches.guides, robot.frame_anchors[:, None]), axis=1)[:, ::-1]
        part = _guided_spans(leaving, points[cable], winches, robot, state.cables.model, cable)
    for whole, some in zip(found, (_wrapped_length(leaving), *part), strict=True):
        whole[known] = some
    return found


def _exit_tension(state: Equilibrium) -> Array:
    """Tensions at the exit points P in the cable model [N]. They vary along the cable only in the exact model."""
    cables = state.cables
    return cables.frame_end_tension if cables.model.code == codes.CATENARY else state.chord_tension


def _exit_state(state: Equilibrium, robot: Robot, winches: Winch, known: Flags, cable: Indices) -> _ExitState:
    cables, contact = state.cables, state.contact
    assert contact is not None
    material = robot.cables
    weight = np.zeros(cables.shape[-1])
    if cables.model.code == codes.CATENARY:
        weight = material.linear_density * robot.gravity
    ends = state.pose.position[..., None, :] + robot.platform_anchors @ np.swapaxes(state.pose.matrix, -1, -2)
    level = (ends - robot.frame_anchors)[..., :2][known]
    outward = level / np.maximum(np.linalg.norm(level, axis=-1, keepdims=True), _TINY)
    wrap, entry = contact.wrap_angle[known], winches.swivel_axis[cable, 2]
    sine = np.sin(wrap)
    sign = np.zeros(wrap.shape) if contact.winding is None else contact.winding[known]
    return _ExitState(
        _exit_tension(state)[known],
        weight[cable],
        material.axial_stiffness[cable],
        wrap,
        sine,
        np.concatenate((sine[:, None] * outward, (entry * np.cos(wrap))[:, None]), axis=-1),
        winches.pulley_radius[cable],
        entry,
        sign * winches.pulley_friction[cable],
        1.0 + sign * winches.rolling_friction[cable],
    )


def _tension_after(tension: Array, drop: Array, stiffness: Array) -> Array:
    """Tension [N] at a point where (1 + strain)^2 is smaller by a given drop; T + T^2/(2 EA) - w z is constant."""
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
    # ln((1 + e exp(mu psi))/E)/mu with friction; psi e/E without
    stretched = np.log1p(strain / strained * np.expm1(friction * at.wrap)) / friction
    stretched = np.where(rubs, stretched, at.wrap * strain / strained)
    return np.asarray(at.radius * (at.wrap - stretched - falls / strained**3))


def _straight_run(at: _ExitState, length: Array, rise: Array) -> tuple[Array, Array]:
    """Unstrained length of straight guided cables [m], and the tension at the drum [N]."""
    first = at.entering(np.zeros(1))
    last = _tension_after(first, 2.0 * at.weight * rise / at.stiffness, at.stiffness)
    return 2.0 * length / (2.0 + (first + last) / at.stiffness), last


def _guided_spans(
    at: _ExitState, points: Array, winches: Winch, robot: Robot, model: CableModel, cable: Indices
) -> tuple[Array, Array]:
    """Unstrained length between pulley and drum [m], and tension at the drum [N]; points (K, k + 1, 3), starting at A.

    Tensions and bend angles depend on each other. Iterations compute them alternately.
    """
    hanging = Catenary() if model.code == codes.CATENARY else Elastic()
    material = Cable(robot.cables.linear_density[cable], robot.cables.axial_stiffness[cable])
    axis, eyelet = winches.swivel_axis[cable], at.radius == 0.0
    # an eyelet at the frame anchor bends the cable from the drum-side span to its exit direction; at a pulley, the span
    # begins along the swivel axis
    onward = np.where(eyelet[:, None], at.tangent, axis)
    at = at._replace(wrap=np.where(eyelet, 0.0, at.wrap))
    steps = points[:, :-1] - points[:, 1:]
    along = steps / np.linalg.norm(steps, axis=-1, keepdims=True)
    bends = [_angle(along[:, j], along[:, j - 1] if j else onward) for j in range(steps.shape[1])]
    length = np.full(at.tension.shape, np.nan)
    tension = length
    for _ in range(PASSES):
        last, length, leaving = length, np.zeros(length.shape), onward
        tension = at.entering(bends[0])
        for j, step in enumerate(np.moveaxis(steps, 1, 0)):
            if j:
                tension = tension * np.exp(at.friction * bends[j])
            span = _span(hanging, material, step, tension, robot.gravity)
            length, tension = length + span.unstrained_length, span.frame_end_tension
            arriving, departing = _tangents(span, step)
            bends[j], leaving = _angle(arriving, leaving), departing
        settled = np.isnan(length) | (np.abs(length - last) <= _TOLERANCE * length)
        if settled.all() or not at.friction.any():
            break
    return length, tension


def _span(model: CableModel, cable: Cable, step: Array, tension: Array, gravity: float) -> CableState:
    """Catenaries over steps (K, 3) with given tension at the upper ("platform") ends; NaN if there is no solution.

    As the chord tension grows, the upper tension first falls to a minimum and then rises. No catenary has a smaller
    upper tension than this minimum.
    """
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


def _tangents(span: CableState, step: Array) -> tuple[Array, Array]:
    """Unit tangents of catenaries at both ends of a step, in the direction of the platform."""
    level = np.hypot(step[:, 0], step[:, 1])[:, None]
    outward = step[:, :2] / np.maximum(level, _TINY)

    def tangent(vertical: Array) -> Array:
        force = np.concatenate((span.horizontal_tension[:, None] * outward, vertical[:, None]), axis=-1)
        return np.asarray(force / np.maximum(np.linalg.norm(force, axis=-1, keepdims=True), _TINY))

    return tangent(span.vertical_force), tangent(span.vertical_force - span.cable_weight)


def _angle(one: Array, other: Array) -> Array:
    """Angles between unit vectors (K, 3)."""
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(one - other, axis=-1), np.linalg.norm(one + other, axis=-1)))
