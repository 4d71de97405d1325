"""Bounds on the motion along a curve due to tension limits; the fastest motion, without and with bounded jerk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.trajectories.segments import Curve, Jet
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.robot.robot import Robot
from sagline.statics.balance import inertial_wrench, structure_matrix

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_NOTHING: Final = 1e-11  # components below this share of the largest component of a direction count as zero
_BLOCK: Final = 40_000  # matrices per block
_WIDER: Final = (1.0, 0.03)  # [N], trial extensions of the limits for poses on the border of feasibility


@dataclass(frozen=True, slots=True, eq=False)
class HalfPlanes:
    """Half planes at K positions, one per row: rates @ (acceleration, squared speed) <= bound."""

    rates: Array  # shape (K, R, 2)
    bound: Array  # shape (K, R); infinite for a row without effect

    def joined(self, other: HalfPlanes) -> HalfPlanes:
        """These half planes and those of `other` in one set."""
        return HalfPlanes(np.hstack((self.rates, other.rates)), np.hstack((self.bound, other.bound)))


@dataclass(frozen=True, slots=True, eq=False)
class ForceBalance:
    """Force balance of the platform at K positions of a curve, with sag forces at nearby tensions."""

    # J tau = needed - u w_u - x w_x, with u the acceleration and x the squared speed of the curve parameter. The sag
    # forces are exact at the last computed tensions, and nearly constant close to these tensions.

    robot: Robot  # the robot, with the tension limits
    jet: Jet  # the positions
    wrenches: Array  # w_u and w_x: inertial wrenches for u = 1 and for x = 1, shape (2, K, 6)
    normals: Array  # normals of wrench bounds, shape (K, R, n)
    gains: Array  # components of unit tensions along the normals, shape (K, R, m), at most 1
    standing: Array  # needed wrench at u = x = 0, in free motions, shape (K, n)
    low: Array  # lower limits of the chord tensions [N], shape (K, m)
    high: Array  # upper limits [N], shape (K, m)

    @classmethod
    def at(cls, robot: Robot, jet: Jet, plan: Plan) -> ForceBalance:
        """Force balance at the positions of `jet`. The plan is at rest at these positions."""
        nothing = np.zeros(plan.chord_tension.shape)
        standing = nothing[:, : robot.degrees_of_freedom]
        new = cls(robot, jet, *_wrenches_and_normals(robot, jet), standing, nothing, nothing)
        return new.with_sag_of(plan, np.zeros((len(jet.pose), 2)))

    def at_poses(self, jet: Jet) -> ForceBalance:
        """Force balance at the poses of `jet`, which are close to the present poses. The sag forces are unchanged."""
        wrenches, normals, gains = _wrenches_and_normals(self.robot, jet)
        return replace(self, jet=jet, wrenches=wrenches, normals=normals, gains=gains)

    def wrench(self, motion: Array) -> Array:
        """Inertial wrench (K, 6) of `motion` (K, 2): accelerations and squared speeds."""
        return np.asarray(np.einsum("ck,cki->ki", motion.T, self.wrenches))

    def with_sag_of(self, plan: Plan, motion: Array) -> ForceBalance:
        """Update the sag forces with a plan for the motions (K, 2). Sag forces of infeasible poses are unchanged."""
        assert plan.needed is not None
        found, freedom = plan.feasible[:, None], self.robot.freedom.T
        # a frame-end limit becomes a chord limit with the present difference of the two tensions
        chords = self.robot.tension_limits_of == "chord"
        below = 0.0 if chords else plan.state.cables.frame_end_tension - plan.chord_tension
        return replace(
            self,
            standing=np.where(found, (plan.needed + self.wrench(motion)) @ freedom, self.standing),
            low=np.where(found, self.robot.tension_min - below, self.low),
            high=np.where(found, self.robot.tension_max - below, self.high),
        )

    def near_motion(self, motion: Array) -> ForceBalance:
        """Update the sag forces for motions (K, 2) on the border of the tension limits, or slightly outside."""
        # on the border the tensions are nearly unique, and rounding may make the pose infeasible; the smallest
        # extension of the limits with a solution is therefore used
        found, wrench = self, self.wrench(motion)
        for by in _WIDER:
            low, high = np.maximum(self.robot.tension_min - by, 0.0), self.robot.tension_max + by
            wider = self.robot.replace(tension_min=low, tension_max=high)
            found = found.with_sag_of(inverse(wider, self.jet.pose, wrench=wrench), motion)
        return found

    def half_planes(self) -> HalfPlanes:
        """Half planes of the feasible motions: along every normal, the cables can supply the needed wrench."""
        with np.errstate(invalid="ignore"):  # zero component times an infinite limit
            ends = [np.where(self.gains == 0.0, 0.0, self.gains * limit[:, None]) for limit in (self.low, self.high)]
        most = np.maximum(*ends).sum(axis=-1)
        along = np.einsum("krn,ckn->krc", self.normals, self.wrenches @ self.robot.freedom.T)
        return HalfPlanes(-along, most - np.einsum("krn,kn->kr", self.normals, self.standing))


def _wrenches_and_normals(robot: Robot, jet: Jet) -> tuple[Array, Array, Array]:
    """Inertial wrenches (2, K, 6), normals (K, R, n) of wrench bounds, and gains (K, R, m), as in `ForceBalance`."""
    first, second, _ = jet.rates
    by_rate = inertial_wrench(robot, jet.pose, np.zeros_like(first), first)
    by_speed = inertial_wrench(robot, jet.pose, first, second)
    matrix = structure_matrix(robot, jet.pose)
    normals = np.concatenate(list(_normals(matrix)))
    gains = normals @ matrix
    size = np.maximum(np.abs(gains).max(axis=-1, keepdims=True), _NOTHING)
    gains[np.abs(gains) <= _NOTHING * size] = 0.0  # columns in the plane have no effect
    return np.stack((by_rate, by_speed)), normals / size, gains / size


def _normals(matrix: Array) -> Iterator[Array]:
    """Both normals (K, 2 S, n) of every plane that n - 1 columns of a matrix span; `matrix` (K, n, m)."""
    # these include the normals of all facets of the zonotope; for dependent columns any normal gives a valid bound
    n, m = matrix.shape[1:]
    sets = np.array(list(combinations(range(m), n - 1)), dtype=np.intp).reshape(-1, n - 1)
    step = max(1, _BLOCK // len(sets))
    for first in range(0, len(matrix), step):
        columns = np.swapaxes(matrix[first : first + step], 1, 2)[:, sets]
        normal = np.linalg.svd(columns, full_matrices=True)[2][..., -1, :]
        yield np.concatenate((normal, -normal), axis=1)


_FLAT = 1e-12  # rates below this share of the largest rate count as zero


def fastest_within(place: Array, planes: HalfPlanes) -> PPoly | None:
    """Rest-to-rest motion over the time [s] with the largest feasible speed at each position `place` (K,)."""
    # The acceleration is constant between neighboring positions. The backward pass computes the squared speeds from
    # which the end can be reached. The forward pass uses the largest acceleration within these speeds. A bound that is
    # satisfied at both ends of a step is also satisfied within the step, except for a small error due to the curvature
    # of the bound. Source: Pham & Pham, A new approach to time-optimal path parameterization based on reachability
    # analysis, 2018
    from scipy.interpolate import PPoly  # this import takes longer than the rest of dynamics

    steps, last = np.diff(place), len(place) - 1
    reach = np.zeros((len(place), 2))
    for i in range(last - 1, -1, -1):
        reach[i] = _range(*_rows(planes, i, steps[i], reach[i + 1]))
        if not reach[i, 0] <= reach[i, 1]:
            return None
    if reach[0, 0] > 0.0:
        return None
    square = np.zeros(len(place))
    for i in range(last):
        rates, bound = _rows(planes, i, steps[i], reach[i + 1])
        rising = rates[:, 0] > _FLAT * np.abs(rates[:, 0]).max()
        most = np.min((bound - rates[:, 1] * square[i])[rising] / rates[rising, 0])
        square[i + 1] = np.clip(square[i] + 2.0 * steps[i] * most, *reach[i + 1])
    if not (square[1:-1] > 0.0).all():
        return None
    speed = np.sqrt(square)
    time = np.append(0.0, np.cumsum(2.0 * steps / (speed[1:] + speed[:-1])))
    return PPoly([0.25 * np.diff(square) / steps, speed[:-1], place[:-1]], time)


def _rows(planes: HalfPlanes, i: int, step: float, reach: Array) -> tuple[Array, Array]:
    """Bounds on (acceleration, squared speed) at position i: those of the positions i and i + 1, and reachability."""
    sheared = planes.rates[i + 1].copy()
    sheared[:, 0] += 2.0 * step * sheared[:, 1]  # the squared speed grows by 2 step times the acceleration
    ahead = np.array([[2.0 * step, 1.0], [-2.0 * step, -1.0], [0.0, -1.0]])
    rates = np.concatenate((planes.rates[i], sheared, ahead))
    bound = np.concatenate((planes.bound[i], planes.bound[i + 1], [reach[1], -reach[0], 0.0]))
    said = np.isfinite(bound)
    return rates[said], bound[said]


def _range(rates: Array, bound: Array) -> tuple[float, float]:
    """Smallest and largest value of the second variable for which the first has a feasible value; low > high: none."""
    flat = np.abs(rates[:, 0]) <= _FLAT * np.abs(rates[:, 0]).max()
    up, down = ~flat & (rates[:, 0] > 0.0), ~flat & (rates[:, 0] < 0.0)
    slope, level = rates[:, 1] / np.where(flat, 1.0, rates[:, 0]), bound / np.where(flat, 1.0, rates[:, 0])
    # each upper bound of the first variable must exceed each lower bound
    rate = np.concatenate(((slope[up][:, None] - slope[down]).ravel(), rates[flat, 1]))
    gap = np.concatenate(((level[up][:, None] - level[down]).ravel(), bound[flat]))
    size = np.abs(rate).max(initial=0.0) * _FLAT
    above, below = rate > size, rate < -size
    low = max(0.0, float(np.max(gap[below] / rate[below], initial=0.0)))
    high = float(np.min(gap[above] / rate[above], initial=np.inf))
    return low, high


Bounds: TypeAlias = Callable[[Array], HalfPlanes]  # additional half planes at given parameters

PIECES: Final = 100  # number of pieces of constant jerk
_ITERATIONS: Final = 40
_CONVERGED: Final = 1e-6  # the iterations stop at a smaller relative change of the time
_SLOWER: Final = 1.2  # initial time of the iterations, divided by the time without jerk bound
_TINY: Final = 1e-30
_SIDES: Final = 32  # number of directions in which a polygon's border is sampled


def fastest_with_jerk(
    curve: Curve, robot: Robot, speeds: Bounds, limits: tuple[float, float], least: float
) -> PPoly | None:
    """The fastest rest-to-rest motion over the time [s] that was found within tension limits and jerk bounds."""
    # The problem is linear in the jerk and in the squared time, except for three quantities: the position at each
    # share of the time, the squared speed at this position, and the third power of the time. Each iteration updates
    # these quantities and solves a linear program. Units: limits [m/s^3]; least [s]
    from scipy.interpolate import PPoly
    from scipy.optimize import linprog

    jerk, duration = _first(curve, limits, least)
    state = _integration_matrices(PIECES)
    jet = curve.at(np.clip(state[0] @ jerk, 0.0, 1.0))
    balances = ForceBalance.at(robot, jet, inverse(robot, jet.pose))
    ends = np.hstack((state[:, -1], np.zeros((3, 1))))
    cost = np.append(np.zeros(PIECES), 1.0)
    for _ in range(_ITERATIONS):
        place, speed, rate = state @ jerk
        square = duration**2
        jet = curve.at(np.clip(place, 0.0, 1.0))
        balances = balances.at_poses(jet).near_motion(np.stack((rate, speed**2), axis=1) / square)
        planes = _without_redundant(balances.half_planes().joined(speeds(np.clip(place, 0.0, 1.0))))
        rows, bounds = zip(
            _within(planes, state, speed),
            (np.hstack((-state[1, 1:-1], np.zeros((PIECES - 1, 1)))), np.zeros(PIECES - 1)),  # no backward motion
            *(
                _jerk_rows(jet.rates[..., part], state, jerk, square, limit)
                for part, limit in zip((slice(0, 3), slice(3, 6)), limits, strict=True)
                if np.isfinite(limit)
            ),
            strict=True,
        )
        between = [(None, None)] * PIECES + [(0.5 * square, None)]
        found = linprog(cost, np.vstack(rows), np.concatenate(bounds), ends, [1.0, 0.0, 0.0], between, method="highs")
        if found.x is None:
            return None
        jerk, before, duration = found.x[:-1], duration, float(np.sqrt(found.x[-1]))
        if abs(duration - before) <= _CONVERGED * duration:
            break
    place, speed, rate = (values[:-1] for values in state @ jerk)
    return slower(PPoly([jerk / 6.0, 0.5 * rate, speed, place], np.linspace(0.0, 1.0, PIECES + 1)), duration)


def slower(motion: PPoly, factor: float) -> PPoly:
    """The motion with all times multiplied by `factor`."""
    from scipy.interpolate import PPoly

    orders = np.arange(len(motion.c))[::-1]
    return PPoly(motion.c / factor ** orders[:, None], motion.x * factor)


def _integration_matrices(pieces: int) -> Array:
    """Matrices (3, P + 1, P) from the jerks of P pieces to the parameter and its two derivatives at the knots."""
    h = 1.0 / pieces
    # time since the start of each piece
    since = np.maximum(np.arange(pieces + 1)[:, None] - np.arange(pieces), 0.0) * h
    left = np.maximum(since - h, 0.0)  # time from the knot to the end of each piece
    return np.stack([(since**k - left**k) / f for k, f in ((3, 6.0), (2, 2.0), (1, 1.0))])


def _first(curve: Curve, limits: tuple[float, float], least: float) -> tuple[Array, float]:
    """Initial jerks (P,) of a 5th-degree polynomial, and a time [s] that probably satisfies the limits."""
    middle = (np.arange(PIECES) + 0.5) / PIECES
    jerk = 60.0 - 360.0 * middle + 360.0 * middle**2
    state = _integration_matrices(PIECES)
    jerk -= state[:, -1].T @ np.linalg.solve(state[:, -1] @ state[:, -1].T, state[:, -1] @ jerk - (1.0, 0.0, 0.0))
    rates = curve.at(state[0] @ jerk).rates[0]
    extents = (np.linalg.norm(rates[:, part], axis=1).max() for part in (slice(0, 3), slice(3, 6)))
    times = [np.cbrt(60.0 * extent / limit) for extent, limit in zip(extents, limits, strict=True)]
    return jerk, float(max(_SLOWER * least, *times))


def _within(planes: HalfPlanes, state: Array, speed: Array) -> tuple[Array, Array]:
    """Rows (K r, P + 1) of the linear program for `planes` at each knot. Unknowns: the jerks, the squared time."""
    by_rate, by_square = (planes.rates[..., k, None] for k in range(2))
    left = by_rate * state[2][:, None] + by_square * 2.0 * speed[:, None, None] * state[1][:, None]
    rows = np.concatenate((left, -planes.bound[..., None]), axis=-1).reshape(-1, PIECES + 1)
    right = (planes.rates[..., 1] * speed[:, None] ** 2).ravel()
    size = np.maximum(np.abs(rows).max(axis=1), np.abs(right))
    size[size == 0.0] = 1.0
    return rows / size[:, None], right / size


def _jerk_rows(rates: Array, state: Array, jerk: Array, square: float, limit: float) -> tuple[Array, Array]:
    """Rows of the linear program: limits of the jerk R1 s''' + 3 R2 s' s'' + R3 s'^3 in some directions at knots."""
    # directions along the curve, across the curve and along the present jerk limit the magnitude of the final jerk;
    # shapes: rates (3, P + 1, 3)
    _, speed, rate = (values[:, None] for values in state @ jerk)
    first, second, third = rates
    rest = 3.0 * second * speed * rate + third * speed**3  # present value, which changes little between iterations
    rows, bounds = [], []
    for knots in (slice(None, -1), slice(1, None)):  # both ends of each piece
        whole = first[knots][..., None] * np.eye(PIECES)[:, None]
        now = whole @ jerk + rest[knots]
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
    return np.where(size > _TINY, vectors / np.where(size > _TINY, size, 1.0), 0.0)


def _without_redundant(planes: HalfPlanes) -> HalfPlanes:
    """Select the half planes that bound the polygon in a sampled direction. All half planes contain the origin."""
    normed = planes.rates / np.maximum(planes.bound, _TINY)[..., None]  # 0 for an infinite bound
    scale = np.maximum(np.abs(normed).max(axis=1, keepdims=True), _TINY)
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
