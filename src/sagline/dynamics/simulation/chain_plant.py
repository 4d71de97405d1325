"""Simulated robot with lumped-mass cables."""

from __future__ import annotations

from typing import Any, ClassVar, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.chain_equilibrium import chains_at_rest
from sagline.dynamics.simulation.initial_conditions import InitialConditions, TimeTable
from sagline.dynamics.simulation.plant import Plant
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import chains as run
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import rigid_body as body
from sagline.kernels.dynamics.progress import COUNTERS, FAILED
from sagline.robot.batch import refuse_slanted


class _LoadedPlatform:
    """Platform together with point masses at its cable ends ("whole body"), in the principal axes of the whole body."""

    def __init__(self, inertia: Array, masses: Array, ends: Array) -> None:
        """Body of a platform with point masses at its cable ends; inertia (4,); masses (m,) [kg]; ends (m, 3) [m]."""
        mass = inertia[0] + masses.sum()
        # center of the whole body relative to the platform's center of mass, platform axes [m], (3,)
        self.center = center = (masses @ ends) / mass
        turns = np.isfinite(inertia[1:])
        own = np.diag(np.where(turns, inertia[1:], 0.0))
        whole = own + _about(inertia[:1], -center[None]) + _about(masses, ends - center)
        if turns.all():
            moments, axes = np.linalg.eigh(whole)
            axes[:, 0] *= np.sign(np.linalg.det(axes))
        else:  # a planar motion, about the last axis, or no rotation
            moments, axes = np.where(turns, np.diag(whole), np.inf), np.eye(3)
        # inertia: mass and principal moments of the whole body, (4,); infinite for a blocked rotation
        # axes: principal axes of the whole body in the principal axes of the platform, one per column, (3, 3)
        self.inertia, self.axes = np.array([mass, *moments]), axes

    def levers(self, ends: Array) -> Array:
        """Positions on the platform (m, 3) relative to the center of the whole body, in the axes of the whole body."""
        return np.asarray((ends - self.center) @ self.axes)

    def state(self, place: Array, turning: Array, velocity: Array, spin: Array) -> Array:
        """State row of the whole body, computed from pose and velocity of the platform."""
        # shapes: place (3,) [m]; turning (3, 3); velocity (3,) [m/s]; spin (3,) [rad/s]
        lever, axes = turning @ self.center, turning @ self.axes
        moments = np.where(np.isinf(self.inertia[1:]), 0.0, self.inertia[1:])
        quaternion = Rotation.from_matrix(axes).as_quat()
        momentum = axes @ (moments * (axes.T @ spin))
        return np.concatenate((place + lever, quaternion, velocity + np.cross(spin, lever), momentum))

    def platform_states(self, states: Array) -> Array:
        """Convert states of the whole body (N, 13) to states of the platform, both with angular velocities."""
        turning = Rotation.from_quat(states[:, body.TURN : body.VELOCITY]).as_matrix() @ self.axes.T
        lever, spin = turning @ self.center, states[:, body.MOMENTUM :]
        place = states[:, : body.TURN] - lever
        velocity = states[:, body.VELOCITY : body.MOMENTUM] - np.cross(spin, lever)
        return np.concatenate((place, Rotation.from_matrix(turning).as_quat(), velocity, spin), axis=1)

    def spin(self, state: Array) -> Array:
        """Angular velocity in a state of the whole body, world axes [rad/s], (3,)."""
        axes = Rotation.from_quat(state[body.TURN : body.VELOCITY]).as_matrix()
        return np.asarray(axes @ ((axes.T @ state[body.MOMENTUM :]) / self.inertia[1:]))


def _about(masses: Array, places: Array) -> Array:
    """Inertia about the origin of the point masses `masses` (m,) at `places` (m, 3)."""
    squares = (places * places).sum(axis=1)
    return np.asarray((masses * squares).sum() * np.eye(3) - (masses[:, None] * places).T @ places)


FEWEST, MOST = 4, 500  # elements per cable
# largest stable step divided by l sqrt(rho/EA), for an element of length 0.4 l at the frame
SHORTEST: Final = 0.86
SPARE: Final = 8  # spare nodes per cable
TRAVELS: Final = 20.0  # time without tension after which a cable is slack, in travel times of a stretch wave
STRETCH: Final = 1.1  # memory for nodes, relative to the longest required length; winches may overshoot


class ChainPlant(Plant):
    """State of a robot with lumped-mass cables during a simulation."""

    # The kernel moves the whole body: the platform with half an element of each cable. The records are converted to the
    # motion of the platform. `nodes` is the number of elements per cable at the start.

    kernel: ClassVar[Any] = staticmethod(run.run_chains)
    cable_mass: ClassVar[str] = "lumped"

    @staticmethod
    def check(given: InitialConditions) -> None:
        """Reject initial conditions `given` with cables for which the lumped model is not valid."""
        if given.model.code != codes.CATENARY:
            name, step = f"{type(given.model).__name__}()", 'Plan with Catenary(), or give cable_mass="none".'
            raise InvalidValueError("start: model", name, 'Catenary() where cable_mass="lumped"', step)
        refuse_slanted(given.robot)
        light = np.flatnonzero(~(given.robot.cables.linear_density > 0.0))
        if light.size:
            item, step = f"cable {light[0]}: linear_density", 'Give a density, or cable_mass="none".'
            raise InvalidValueError(item, "0 kg/m", "> 0 kg/m for a cable with mass", step)

    @staticmethod
    def wave_frequency(given: InitialConditions, nodes: int) -> float:
        """Highest angular frequency of chains [rad/s], computed for the shortest element that can occur."""
        material = given.robot.cables
        element = given.state.free_length / nodes
        return float((2.0 / SHORTEST / element * np.sqrt(material.axial_stiffness / material.linear_density)).max())

    def __init__(self, given: InitialConditions, data: Array, nodes: int, losses: Damping) -> None:
        """Create the chains of a robot at rest, or in motion at the speed of its path; `data` (DATA_ROWS, m)."""
        state, robot = given.state, given.robot
        pose, at_rest, _ = chains_at_rest(state, nodes)
        super().__init__(robot, given.model, pose, given.twist, state.unstrained_length, data)
        m, self.nodes, self.points = robot.cable_count, nodes, nodes + 1  # points are recorded per cable
        self.rows[g.CHORD] = np.linalg.norm(at_rest[:, :, 0] - at_rest[:, :, -1], axis=1)
        self.counters = np.zeros(COUNTERS + 1, dtype=np.int64)
        table = _chain_table(given, at_rest, nodes, losses, data)
        longest = STRETCH * given.lengths.value.max(axis=0)[:m] / table[:, c.ELEMENT]
        capacity = int(np.ceil(np.maximum(longest, nodes)).max()) + SPARE
        place = np.zeros((m, 3, capacity))
        place[:, :, : nodes + 1] = at_rest
        work, counts = np.zeros((m, 4 * capacity)), np.full(m, nodes - 1, dtype=np.int64)
        self._chains = [table, place, np.zeros_like(place), work, counts]
        self._stock = np.full(2, np.nan)
        self._travel = nodes * table[:, c.ELEMENT] * np.sqrt(table[:, c.DENSITY] / table[:, c.STIFFNESS])
        self._ends = (robot.platform_anchors - robot.center_of_mass) @ self.axes
        self._carried = 0.5 * table[:, c.DENSITY] * table[:, c.ELEMENT]
        own = np.concatenate((self.state[: body.MOMENTUM], given.twist[3:]))
        self._change_body(own)
        turning = Rotation.from_quat(own[body.TURN : body.VELOCITY]).as_matrix()
        ends = np.cross(given.twist[3:], self._ends @ turning.T)
        self._set_node_speeds(own[body.VELOCITY : body.MOMENTUM] + ends, given.rate)

    def _set_node_speeds(self, at_platform: Array, rate: Array) -> None:
        """Interpolate node speeds between both cable ends. The speed at the frame includes that of paid-out cable."""
        table, place, speed, n = self._chains[0], self._chains[1], self._chains[2], self.nodes
        at_exit = (rate / table[:, c.ELEMENT])[:, None] * (place[:, :, n - 1] - place[:, :, n])
        share = np.linspace(0.0, 1.0, n + 1)
        speed[:, :, : n + 1] = at_platform[..., None] * (1.0 - share) + at_exit[..., None] * share

    def arguments(self, rules: Any, numbers: Any, inputs: Any) -> Any:
        """Arguments of the kernel of chains, in the order of `Plant.arguments`."""
        lengths: TimeTable = inputs[0]
        if self._work.size != run.ROOM + 2 * lengths.value.shape[1]:
            self._work = np.zeros(run.ROOM + 2 * lengths.value.shape[1])
        ends = self._table.copy()
        ends[:, tables.PLATFORM_X : tables.PLATFORM_Z + 1] = self._carrier.levers(self._ends)[self.cables]
        freedom = self.robot.freedom
        handle = self._carrier.levers(np.zeros(3))
        whole = tuple(locked(array) for array in (ends, self._carrier.inertia.copy(), freedom.T @ freedom, handle))
        kept = (self.state, self.rows, self.now, self.layers, self.audit, self.counters, self._work)
        given = tuple(table.arrays for table in inputs)
        _integrator, kind, remembered, _work, stride = rules
        step, _loss_time, _air, filtering = numbers
        self._chains[0][:, c.STEP] = step
        self._chains[0][:, c.SMOOTH] = 1.0 - np.exp(-step / (TRAVELS * self._travel[self.cables]))
        return (
            (kind, remembered, stride),
            (step, self.robot.gravity, filtering),
            whole,
            locked(self.data.view()),
            given,
            kept,
            tuple(self._chains),
            self._stock,
        )

    def platform_states(self, states: Array) -> Array:
        """Convert recorded states of the whole body to states of the platform."""
        return self._carrier.platform_states(states)

    def break_cable(self, cable: int, position: float) -> Indices:
        """Break a cable at the node nearest to `position`, and lock its winch. Each piece becomes a chain."""
        i, node = self._breaking_node(cable, position)
        rows = np.arange(len(self.cables))
        at_platform, at_frame = node == 0, node > self._chains[4][i]
        piece = i  # row of the piece at the platform
        if not at_platform and not at_frame:
            piece = i + 1  # a new row after that of the piece at the frame
            rows = np.insert(rows, piece, i)
        self._chains = [array[rows] for array in self._chains]
        self._select_rows(rows)
        table, place, speed, _, counts = self._chains
        if piece > i:
            used = counts[i] + 2 - node
            for array in (place[i], speed[i]):
                array[:, :used] = array[:, node : node + used].copy()
            counts[[i, piece]] = counts[i] - node, node - 1
            self.rows[g.LENGTH, i] -= node * table[i, c.ELEMENT]
            table[piece, c.REST] = table[i, c.ELEMENT]
        elif at_frame:  # the cable between exit point and drum has the same strain as the element at the frame
            last = float(np.linalg.norm(place[i, :, node] - place[i, :, node - 1]))
            table[i, c.REST] *= (1.0 + table[i, c.BEHIND] / table[i, c.REST]) / (1.0 + table[i, c.RUN] / last)
        else:
            self._release_platform_end(i, cable)
        if not at_platform:
            table[piece, [c.FREE_END, c.BEHIND, c.RUN, c.RATE]] = 1.0, 0.0, 0.0, 0.0
        if not at_frame:
            table[i, c.FREE_START] = 1.0
        pieces = np.flatnonzero(self.cables == cable)
        self.lock_winches(pieces)
        self.rows[g.CHORD, pieces] = -1.0  # a piece is not reported as slack
        self._distribute_points(pieces)
        return rows

    def _breaking_node(self, cable: int, position: float) -> tuple[int, int]:
        """Row of the piece that breaks, and the node of the break: the node nearest to `position`, except free ends."""
        table, counts = self._chains[0], self._chains[4]
        rows, begin, found = np.flatnonzero(self.cables == cable), 0.0, []
        lengths = self._lengths_of(rows)
        for i, length in zip(rows.tolist(), lengths.tolist(), strict=True):
            nodes, n = np.arange(counts[i] + 2), counts[i]
            way = begin + np.where(nodes > n, 0.0, length - nodes * table[i, c.ELEMENT])
            # every piece has at least two points and is separated from the next piece by one point
            whole = (nodes > 1) & (nodes < n) & (3 * len(rows) + 2 <= self.points)
            whole[[0, -1]] = table[i, [c.FREE_START, c.FREE_END]] == 0.0
            found += [(abs(way[j] - position * lengths.sum()), i, j) for j in np.flatnonzero(whole).tolist()]
            begin += length
        if not found:
            value, allowed = f"broken into {len(rows)} pieces", f"pieces of more than three of {self.nodes} elements"
            raise InvalidValueError(f"cable {cable}: break", value, allowed, "Give more nodes, or fewer breaks.")
        return min(found)[1:]

    def _lengths_of(self, rows: Indices) -> Array:
        """Unstrained lengths of chains [m]."""
        table, counts = self._chains[0], self._chains[4]
        return np.asarray(counts[rows] * table[rows, c.ELEMENT] + table[rows, c.REST])

    def _release_platform_end(self, i: int, cable: int) -> None:
        """Give the half element at the platform, which moves with the platform, to the piece in row `i`."""
        own = self._platform_motion()
        arm = Rotation.from_quat(own[body.TURN : body.VELOCITY]).as_matrix() @ self._ends[cable]
        self._chains[2][i, :, 0] = own[body.VELOCITY : body.MOMENTUM] + np.cross(own[body.MOMENTUM :], arm)
        self._carried[cable] = 0.0
        self._change_body(own)

    def _distribute_points(self, pieces: Indices) -> None:
        """Distribute the recorded points of a cable to its pieces, with one unused point between two pieces."""
        spare = self.points - 3 * len(pieces) + 1  # beyond two points per piece
        ends = np.round(spare * np.cumsum(self._lengths_of(pieces)) / self._lengths_of(pieces).sum())
        number = 2 + np.diff(ends, prepend=0.0)
        self._chains[0][pieces, c.POINTS] = number
        self._chains[0][pieces, c.FIRST] = np.cumsum(number + 1.0) - number - 1.0

    def _platform_motion(self) -> Array:
        """State of the platform, with angular velocity, (13,)."""
        moving = np.concatenate((self.state[: body.MOMENTUM], self._carrier.spin(self.state)))
        return np.asarray(self._carrier.platform_states(moving[None])[0])

    def _change_body(self, own: Array) -> None:
        """Set the whole body for the present masses; `own` (13,): state of the platform, with angular velocity."""
        self._carrier = _LoadedPlatform(self.inertia, self._carried, self._ends)
        turning = Rotation.from_quat(own[body.TURN : body.VELOCITY]).as_matrix()
        parts = own[: body.TURN], turning, own[body.VELOCITY : body.MOMENTUM], own[body.MOMENTUM :]
        self.state = self._carrier.state(*parts)

    def with_mass(self, mass: float, *, at_rest: bool) -> None:
        """Set the platform's mass to `mass` [kg], its inertia in proportion; cable masses on it do not change."""
        before, state, own = self._carrier, self.state, self._platform_motion()
        self.inertia = self.inertia * (mass / self.inertia[0])
        self._change_body(own)
        after = self._carrier
        if at_rest:  # momentum and angular momentum about any point are conserved
            momentum = before.inertia[0] * state[body.VELOCITY : body.MOMENTUM]
            arm = state[: body.TURN] - self.state[: body.TURN]
            self.state[body.VELOCITY : body.MOMENTUM] = momentum / after.inertia[0]
            self.state[body.MOMENTUM :] = state[body.MOMENTUM :] + np.cross(arm, momentum)

    def failure(self, time: float, step: float) -> InvalidValueError:
        """Create the error for a kernel that stopped at `time` [s]. It explains the cause."""
        cable, how = int(self.cables[int(self.counters[FAILED]) - 1]), self.counters[run.ENDED]
        if how == run.GROWN:
            return super().failure(time, step)
        value = f"{'too long' if how == run.LONG else 'almost completely wound in'} at {time:.6g} s"
        element = self._chains[0][int(self.counters[FAILED]) - 1, c.ELEMENT]
        low, high = (run.FEWEST + 1) * element, self._chains[1].shape[2] * element
        advice = 'Correct the lengths, give more nodes, or cable_mass="none".'
        return InvalidValueError(f"cable {cable}: length", value, f"{low:.3g} to {high:.3g} m of its chain", advice)


def _chain_table(given: InitialConditions, place: Array, nodes: int, losses: Damping, data: Array) -> Array:
    """Table of the data of chains at rest, (m, CHAIN_COLUMNS)."""
    state, material = given.state, given.robot.cables
    table = np.zeros((given.robot.cable_count, c.CHAIN_COLUMNS))
    table[:, c.EXIT_X : c.EXIT_Z + 1] = place[:, :, -1]
    table[:, c.ELEMENT] = state.free_length / nodes
    table[:, c.DENSITY], table[:, c.STIFFNESS] = material.linear_density, material.axial_stiffness
    table[:, c.LOSS_TIME], table[:, c.AIR_RATE] = losses.loss_time, losses.air_damping / material.linear_density
    # the cable between exit point and drum has the strain of the element at the exit point
    table[:, c.BEHIND] = state.unstrained_length - state.free_length
    last = np.linalg.norm(place[:, :, -1] - place[:, :, -2], axis=1)
    table[:, c.RUN] = table[:, c.BEHIND] * last / table[:, c.ELEMENT]
    table[:, c.WIND], table[:, c.GRAVITY] = data[d.DRAG], given.robot.gravity
    table[:, c.CABLE], table[:, c.POINTS] = np.arange(len(table)), nodes + 1
    return table
