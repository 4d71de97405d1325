"""Time-optimal motion along a curve with bounded jerk, computed by linear programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.trajectories.force_balance import ForceBalance, HalfPlanes
from sagline.dynamics.trajectories.segments import Curve
from sagline.kinematics.inverse import inverse
from sagline.robot.robot import Robot

Bounds: TypeAlias = Callable[[Array], HalfPlanes]  # additional half planes at given parameters

PIECES: Final = 100  # number of pieces of constant jerk
_ITERATIONS: Final = 40
_CONVERGED: Final = 1e-6  # the iterations stop at a smaller relative change of the time
_SLOWER: Final = 1.2  # initial time of the iterations, divided by the time without jerk bound
_NOTHING: Final = 1e-30
_SIDES: Final = 32  # number of directions in which a polygon's border is sampled


@dataclass(frozen=True, slots=True, eq=False)
class JerkProfile:
    """Motion with constant jerk of the parameter on each of P equally long pieces."""

    jerk: Array  # third derivative of the parameter with respect to normalized time, shape (P,)
    duration: float  # the time [s]

    def at(self, time: Array) -> Array:
        """Parameter and its first three time derivatives, shape (4, N)."""
        state = _integration_matrices(len(self.jerk)) @ self.jerk  # at the knots
        scaled = np.clip(time / self.duration, 0.0, 1.0) * len(self.jerk)
        k = np.minimum(scaled.astype(np.intp), len(self.jerk) - 1)
        h = (scaled - k) / len(self.jerk)
        place, speed, rate = state[:, k]
        jerk = self.jerk[k]
        values = (
            place + h * (speed + 0.5 * h * (rate + h / 3.0 * jerk)),
            speed + h * (rate + 0.5 * h * jerk),
            rate + h * jerk,
            jerk,
        )
        return np.stack([value / self.duration**order for order, value in enumerate(values)])


def _integration_matrices(pieces: int) -> Array:
    """Matrices that map the jerks of the P pieces to the parameter and its first two derivatives at the knots.

    Returns an array of shape (3, P + 1, P).
    """
    h = 1.0 / pieces
    # time since the start of each piece
    since = np.maximum(np.arange(pieces + 1)[:, None] - np.arange(pieces), 0.0) * h
    left = np.maximum(since - h, 0.0)  # time from the knot to the end of each piece
    return np.stack([(since**k - left**k) / f for k, f in ((3, 6.0), (2, 2.0), (1, 1.0))])


def fastest_jerk_profile(
    curve: Curve, robot: Robot, speeds: Bounds, limits: tuple[float, float], least: float
) -> JerkProfile | None:
    """The fastest rest-to-rest profile that was found within tension limits and jerk bounds."""
    # The problem is linear in the jerk and in the squared time, except for three quantities: the position at each share
    # of the time, the squared speed at this position, and the third power of the time. Each iteration updates these
    # quantities and solves a linear program. Units: limits [m/s^3]; least [s]
    from scipy.optimize import linprog  # this import takes longer than the rest of dynamics

    course = _first(curve, limits, least)
    state = _integration_matrices(PIECES)
    jet = curve.at(np.clip(state[0] @ course.jerk, 0.0, 1.0))
    balances = ForceBalance.at(robot, jet, inverse(robot, jet.pose))
    ends = np.hstack((state[:, -1], np.zeros((3, 1))))
    cost = np.append(np.zeros(PIECES), 1.0)
    for _ in range(_ITERATIONS):
        place, speed, rate = state @ course.jerk
        square = course.duration**2
        jet = curve.at(np.clip(place, 0.0, 1.0))
        balances = balances.at_poses(jet).near_motion(np.stack((rate, speed**2), axis=1) / square)
        planes = _without_redundant(balances.half_planes().joined(speeds(np.clip(place, 0.0, 1.0))))
        rows, bounds = zip(
            _within(planes, state, speed),
            (np.hstack((-state[1, 1:-1], np.zeros((PIECES - 1, 1)))), np.zeros(PIECES - 1)),  # no backward motion
            *(
                _jerk_rows(jet.rates[..., part], state, course, limit)
                for part, limit in zip((slice(0, 3), slice(3, 6)), limits, strict=True)
                if np.isfinite(limit)
            ),
            strict=True,
        )
        between = [(None, None)] * PIECES + [(0.5 * square, None)]
        found = linprog(cost, np.vstack(rows), np.concatenate(bounds), ends, [1.0, 0.0, 0.0], between, method="highs")
        if found.x is None:
            return None
        before, course = course, JerkProfile(found.x[:-1], float(np.sqrt(found.x[-1])))
        if abs(course.duration - before.duration) <= _CONVERGED * course.duration:
            break
    return course


def _first(curve: Curve, limits: tuple[float, float], least: float) -> JerkProfile:
    """Initial profile: 5th-degree polynomial, with a time that probably satisfies the limits."""
    middle = (np.arange(PIECES) + 0.5) / PIECES
    jerk = 60.0 - 360.0 * middle + 360.0 * middle**2
    state = _integration_matrices(PIECES)
    jerk -= state[:, -1].T @ np.linalg.solve(state[:, -1] @ state[:, -1].T, state[:, -1] @ jerk - (1.0, 0.0, 0.0))
    rates = curve.at(state[0] @ jerk).rates[0]
    extents = (np.linalg.norm(rates[:, part], axis=1).max() for part in (slice(0, 3), slice(3, 6)))
    times = [np.cbrt(60.0 * extent / limit) for extent, limit in zip(extents, limits, strict=True)]
    return JerkProfile(jerk, float(max(_SLOWER * least, *times)))


def _within(planes: HalfPlanes, state: Array, speed: Array) -> tuple[Array, Array]:
    """Rows (K r, P + 1) of the linear program for `planes` at each knot. Unknowns: the jerks, the squared time."""
    by_rate, by_square = (planes.rates[..., k, None] for k in range(2))
    left = by_rate * state[2][:, None] + by_square * 2.0 * speed[:, None, None] * state[1][:, None]
    rows = np.concatenate((left, -planes.bound[..., None]), axis=-1).reshape(-1, PIECES + 1)
    right = (planes.rates[..., 1] * speed[:, None] ** 2).ravel()
    size = np.maximum(np.abs(rows).max(axis=1), np.abs(right))
    size[size == 0.0] = 1.0
    return rows / size[:, None], right / size


def _jerk_rows(rates: Array, state: Array, course: JerkProfile, limit: float) -> tuple[Array, Array]:
    """Rows of the linear program: limits of the jerk R1 s''' + 3 R2 s' s'' + R3 s'^3 in some directions at knots."""
    # directions along the curve, across the curve and along the present jerk limit the magnitude of the final jerk;
    # shapes: rates (3, P + 1, 3)
    _, speed, rate = (values[:, None] for values in state @ course.jerk)
    first, second, third = rates
    rest = 3.0 * second * speed * rate + third * speed**3  # present value, which changes little between iterations
    rows, bounds = [], []
    square = course.duration**2
    for knots in (slice(None, -1), slice(1, None)):  # both ends of each piece
        whole = first[knots][..., None] * np.eye(PIECES)[:, None]
        now = whole @ course.jerk + rest[knots]
        along = _unit(first[knots])
        aside = rest[knots] - np.sum(rest[knots] * along, axis=1, keepdims=True) * along
        for direction in (along, -along, _unit(aside), -_unit(aside), _unit(now)):
            said = direction.any(axis=1)
            left = np.einsum("kc,kcp->kp", direction, whole)[said]
            rows.append(np.hstack((left / limit, np.full((len(left), 1), -1.5 * np.sqrt(square)))))
            bounds.append(-np.sum(direction * rest[knots], axis=1)[said] / limit - 0.5 * square**1.5)
    return np.vstack(rows), np.concatenate(bounds)


def _unit(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: Array = np.where(size > _NOTHING, vectors / np.where(size > _NOTHING, size, 1.0), 0.0)
    return unit


def _without_redundant(planes: HalfPlanes) -> HalfPlanes:
    """Select the half planes that bound the polygon in a sampled direction. All half planes contain the origin."""
    normed = planes.rates / np.maximum(planes.bound, _NOTHING)[..., None]  # 0 for an infinite bound
    scale = np.maximum(np.abs(normed).max(axis=1, keepdims=True), _NOTHING)
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _SIDES)
    ray = np.stack((np.sin(angle), np.cos(angle)), axis=1)
    first = np.argmax(np.einsum("krc,sc->krs", normed / scale, ray), axis=1)
    kept = np.zeros(planes.bound.shape, dtype=np.bool_)
    np.put_along_axis(kept, first, True, axis=1)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : kept.sum(axis=1).max()]
    rates = np.take_along_axis(planes.rates, order[..., None], axis=1)
    bound = np.take_along_axis(planes.bound, order, axis=1)
    said = np.isfinite(bound)
    return HalfPlanes(np.where(said[..., None], rates, 0.0), np.where(said, bound, 1.0))
