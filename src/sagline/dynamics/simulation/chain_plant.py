"""Simulated robot with lumped-mass cables, and its equilibrium with an error of the order nodes^-2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.initial_conditions import InitialConditions, TimeTable
from sagline.dynamics.simulation.plant import Plant
from sagline.dynamics.simulation.results import displaced_pose
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import chain as c
from sagline.kernels.dynamics import chains as run
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import rigid_body as body
from sagline.kernels.dynamics.progress import COUNTERS, FAILED
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.statics.slopes import platform_end_forces


@dataclass(frozen=True, slots=True, eq=False)
class LoadedPlatform:
    """Platform together with point masses at its cable ends ("whole body"), in the principal axes of the whole body."""

    inertia: Array  # mass and principal moments of the whole body, (4,); infinite for a blocked rotation
    center: Array  # center of the whole body relative to the platform's center of mass, platform axes [m], (3,)
    axes: Array  # principal axes of the whole body in the principal axes of the platform, one per column, (3, 3)

    @classmethod
    def of(cls, inertia: Array, masses: Array, ends: Array) -> LoadedPlatform:
        """Body of a platform with point masses at its cable ends; inertia (4,); masses (m,) [kg]; ends (m, 3) [m]."""
        mass = inertia[0] + masses.sum()
        center = (masses @ ends) / mass
        turns = np.isfinite(inertia[1:])
        own = np.diag(np.where(turns, inertia[1:], 0.0))
        whole = own + _about(inertia[:1], -center[None]) + _about(masses, ends - center)
        if turns.all():
            moments, axes = np.linalg.eigh(whole)
            axes[:, 0] *= np.sign(np.linalg.det(axes))
        else:  # a planar motion, about the last axis, or no rotation
            moments, axes = np.where(turns, np.diag(whole), np.inf), np.eye(3)
        return cls(np.array([mass, *moments]), center, axes)

    def levers(self, ends: Array) -> Array:
        """Positions on the platform (m, 3) relative to the center of the whole body, in the axes of the whole body."""
        levers: Array = (ends - self.center) @ self.axes
        return levers

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
        spin: Array = axes @ ((axes.T @ state[body.MOMENTUM :]) / self.inertia[1:])
        return spin


def _about(masses: Array, places: Array) -> Array:
    """Inertia about the origin of the point masses `masses` (m,) at `places` (m, 3)."""
    squares = (places * places).sum(axis=1)
    inertia: Array = (masses * squares).sum() * np.eye(3) - (masses[:, None] * places).T @ places
    return inertia


FEWEST, MOST = 4, 500  # elements per cable
# largest stable step divided by l sqrt(rho/EA), for an element of length 0.4 l at the frame
SHORTEST: Final = 0.86
SPARE: Final = 8  # spare nodes per cable
TRAVELS: Final = 20.0  # time without tension after which a cable is slack, in travel times of a stretch wave
STRETCH: Final = 1.1  # memory for nodes, relative to the longest required length; winches may overshoot


class ChainPlant(Plant):
    """State of a robot with lumped-mass cables during a simulation.

    The kernel moves the whole body: the platform with half an element of each cable. The records are converted to the
    motion of the platform.

    Attributes:
        nodes: Elements per cable at the start.
    """

    kernel: ClassVar[Any] = staticmethod(run.run_chains)
    cable_mass: ClassVar[str] = "lumped"

    def __init__(self, given: InitialConditions, data: Array, nodes: int, losses: Damping) -> None:
        """Create the chains of a robot at rest, or in motion at the speed of its path; `data` (DATA_ROWS, m)."""
        state, robot = given.state, given.robot
        pose, at_rest, _ = chains_at_rest(state, nodes)
        super().__init__(robot, given.model, pose, given.twist, state.unstrained_length, data)
        m, self.nodes, self.points = robot.cable_count, nodes, nodes + 1
        self.rows[g.CHORD] = np.linalg.norm(at_rest[:, :, 0] - at_rest[:, :, -1], axis=1)
        self.counters = np.zeros(COUNTERS + 1, dtype=np.int64)
        table = _chain_table(given, at_rest, nodes, losses, data)
        longest = STRETCH * given.lengths.value.max(axis=0)[:m] / table[:, c.ELEMENT]
        capacity = int(np.ceil(np.maximum(longest, nodes)).max()) + SPARE
        place = np.zeros((m, 3, capacity))
        place[:, :, : nodes + 1] = at_rest
        self._chains = [
            table,
            place,
            np.zeros_like(place),
            np.zeros((m, 3 * capacity)),
            np.full(m, nodes - 1, dtype=np.int64),
        ]
        self._stock = np.full(2, np.nan)
        self._travel = nodes * table[:, c.ELEMENT] * np.sqrt(table[:, c.DENSITY] / table[:, c.STIFFNESS])
        self._ends = (robot.platform_anchors - robot.center_of_mass) @ self.axes
        self._carried = 0.5 * table[:, c.DENSITY] * table[:, c.ELEMENT]
        self._carrier = LoadedPlatform.of(self.inertia, self._carried, self._ends)
        turning = Rotation.from_quat(self.state[body.TURN : body.VELOCITY]).as_matrix()
        velocity, spin = self.state[body.VELOCITY : body.MOMENTUM], given.twist[3:]
        self.state = self._carrier.state(self.state[: body.TURN], turning, velocity, spin)
        self._set_node_speeds(velocity + np.cross(spin, self._ends @ turning.T), given.rate)

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

    def remove_cable(self, cable: int) -> None:
        """Remove a cable; half of its last element remains on the platform."""
        place = int(np.flatnonzero(self.cables == cable)[0])
        super().remove_cable(cable)
        self._chains = [np.delete(array, place, axis=0) for array in self._chains]

    def with_mass(self, mass: float, *, at_rest: bool) -> None:
        """Set the platform's mass to `mass` [kg], its inertia in proportion. Cable masses at its ends are unchanged."""
        before, state = self._carrier, self.state
        spin = before.spin(state)
        moving = np.concatenate((state[: body.MOMENTUM], spin))
        own = before.platform_states(moving[None])[0]
        self.inertia = self.inertia * (mass / self.inertia[0])
        self._carrier = after = LoadedPlatform.of(self.inertia, self._carried, self._ends)
        turning = Rotation.from_quat(own[body.TURN : body.VELOCITY]).as_matrix()
        self.state = after.state(own[: body.TURN], turning, own[body.VELOCITY : body.MOMENTUM], spin)
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
    return table


def checked_nodes(nodes: Any) -> int:
    """The checked number `nodes` of elements per cable."""
    return whole_number(nodes, "nodes", FEWEST, MOST)


def check_lumped(given: InitialConditions) -> None:
    """Reject initial conditions `given` with cables for which the lumped model is not valid."""
    if given.model.code != codes.CATENARY:
        name, step = f"{type(given.model).__name__}()", 'Plan with Catenary(), or give cable_mass="none".'
        raise InvalidValueError("start: model", name, 'Catenary() where cable_mass="lumped"', step)
    light = np.flatnonzero(~(given.robot.cables.linear_density > 0.0))
    if light.size:
        step = 'Give a density, or cable_mass="none".'
        raise InvalidValueError(f"cable {light[0]}: linear_density", "0 kg/m", "> 0 kg/m for a cable with mass", step)


def wave_frequency(given: InitialConditions, nodes: int) -> float:
    """Highest angular frequency of chains [rad/s], computed for the shortest element that can occur."""
    material = given.robot.cables
    element = given.state.free_length / nodes
    return float((2.0 / SHORTEST / element * np.sqrt(material.axial_stiffness / material.linear_density)).max())


STEPS = 60
NEAR = 1e-8  # relative error of a length or force; from this error, one more Newton step reaches rounding error
NEUTRAL = 1e-12  # a stiffness below this share of the largest stiffness counts as zero
# largest step, as a share of the force; after a longer step, a chain far from its solution could fold
LONGEST_STEP = 0.2


class _LumpedCables(NamedTuple):
    """Cables divided into elements."""

    element: Array  # unstrained length of the elements [m], shape (m,)
    weight: Array  # weight per length [N/m], shape (m,)
    stiffness: Array  # EA [N], shape (m,)
    nodes: int  # elements per cable

    def elements(self, force: Array) -> tuple[Array, Array]:
        """Forces at the centers of the elements, platform end first, and their magnitudes."""
        # shapes: force (m, 3) [N]; returns (m, nodes, 3) [N]
        below = (np.arange(self.nodes) + 0.5) * (self.weight * self.element)[:, None]
        forces = np.repeat(force[:, None, :], self.nodes, axis=1)
        forces[..., 2] -= below
        return forces, np.linalg.norm(forces, axis=-1)

    def steps(self, force: Array) -> Array:
        """Vectors along the elements toward the platform [m], shape (m, nodes, 3), for end forces (m, 3) [N]."""
        forces, size = self.elements(force)
        return (self.element[:, None] * (1.0 / self.stiffness[:, None] + 1.0 / size))[..., None] * forces

    def compliance(self, force: Array) -> Array:
        """Derivative of the platform ends of chains with respect to their forces (m, 3) [N], shape (m, 3, 3) [m/N]."""
        forces, size = self.elements(force)
        unit = forces / size[..., None]
        across = np.eye(3) - unit[..., :, None] * unit[..., None, :]
        along = self.nodes / self.stiffness[:, None, None] * np.eye(3)
        compliance: Array = self.element[:, None, None] * (along + (across / size[..., None, None]).sum(axis=1))
        return compliance


def chains_at_rest(state: Equilibrium, nodes: int) -> tuple[Pose, Array, Array]:
    """Compute the platform and chains at rest with the cable lengths of `state`: pose, nodes and forces."""
    # nodes: world axes, from the platform end to the exit [m], shape (m, 3, nodes + 1); forces: on the platform ends of
    # the cables, including half an element's weight [N], shape (m, 3); the force on the platform is the opposite
    #
    # The force in an element is the force of the exact cable at the center of the element. The end of the chain
    # therefore follows from the midpoint rule, and pose and forces have errors of the order nodes^-2. The wrench is
    # balanced to rounding. Source: docs/model.md, section 11
    robot, exits = state.one_robot, state.exit_point
    length, material = state.free_length, state.cables.cable
    chains = _LumpedCables(length / nodes, material.linear_density * robot.gravity, material.axial_stiffness, nodes)
    center, freedom = robot.center_of_mass, robot.freedom
    given = state.wrench - np.array([0.0, 0.0, robot.mass * robot.gravity, 0.0, 0.0, 0.0])
    force = platform_end_forces(state)
    _refuse_slack(force, chains)
    pose, near = state.pose, False
    for _ in range(STEPS):
        levers = (robot.platform_anchors - center) @ pose.matrix.T
        force = _solve_chains(chains, pose.position + robot.platform_anchors @ pose.matrix.T - exits, force)
        unbalance = np.concatenate((force.sum(axis=0), np.cross(levers, force).sum(axis=0))) - given
        blocks = np.asarray(np.linalg.inv(chains.compliance(force)), dtype=np.float64)
        motion = _balancing_motion(unbalance, _platform_stiffness(blocks, levers, force), freedom, _size(levers))
        pose = displaced_pose(pose, robot, motion)
        if near:
            break
        near = bool(np.abs(motion).max() <= NEAR * length.max())
    else:
        raise _no_rest("start", "an equilibrium, near which its chains have none")
    ends = pose.position + robot.platform_anchors @ pose.matrix.T
    force = _solve_chains(chains, ends - exits, force)
    place = np.empty((len(force), nodes + 1, 3))
    place[:, 0] = ends
    place[:, 1:] = ends[:, None] - np.cumsum(chains.steps(force), axis=1)
    place[:, -1] = exits
    return pose, np.ascontiguousarray(np.swapaxes(place, 1, 2)), force


def _refuse_slack(force: Array, chains: _LumpedCables) -> None:
    slack = np.flatnonzero(~(chains.elements(force)[1].min(axis=1) > 0.0))
    if slack.size:
        raise _no_rest(f"cable {slack[0]}", "slack at the start")


def _no_rest(item: str, value: str) -> InvalidValueError:
    step = 'Start at another pose, or with cable_mass="none".'
    return InvalidValueError(item, value, "taut cables that hold the platform", step)


def _solve_chains(chains: _LumpedCables, chord: Array, force: Array) -> Array:
    """Forces on the platform ends of chains with chords (m, 3). The iteration starts from nearby initial forces."""
    near = False
    for _ in range(STEPS):
        missing = chord - chains.steps(force).sum(axis=1)
        step = np.linalg.solve(chains.compliance(force), missing[..., None])[..., 0]
        share = np.linalg.norm(step, axis=1) / np.linalg.norm(force, axis=1)
        force = force + step / np.maximum(share / LONGEST_STEP, 1.0)[:, None]
        if near:
            return force
        near = bool(share.max() <= NEAR)
    raise _no_rest("start", "an equilibrium with a very slack cable, whose chain folds")


def _size(levers: Array) -> float:
    """Reference length [m] for rotations: the longest lever, or 1 if all cables meet in the center of mass."""
    longest = float(np.linalg.norm(levers, axis=1).max())
    return longest if longest > 0.0 else 1.0


def _balancing_motion(unbalance: Array, stiffness: Array, freedom: Array, size: float) -> Array:
    """Motion of the platform that removes `unbalance`. It is zero in directions without stiffness."""
    # example: for the rotation of a pendulum about its cable, stiffness and unbalance are zero, except for rounding
    units = np.array([1.0, 1.0, 1.0, size, size, size])
    slope = freedom @ (stiffness / np.outer(units, units)) @ freedom.T
    found = np.linalg.lstsq(slope, -freedom @ (unbalance / units), rcond=NEUTRAL)[0]
    return np.asarray(freedom.T @ found / units)


def _platform_stiffness(blocks: Array, levers: Array, force: Array) -> Array:
    """Derivative (6, 6) of the unbalance with respect to platform motion, from the forces on the cable ends."""
    turn = -_cross_matrix(levers)  # a rotation about an axis e moves the platform end by e x r
    across = _cross_matrix(levers)
    matrix = np.empty((6, 6))
    matrix[:3, :3] = blocks.sum(axis=0)
    matrix[:3, 3:] = (blocks @ turn).sum(axis=0)
    matrix[3:, :3] = (across @ blocks).sum(axis=0)
    # the force keeps its direction while r rotates: r T^T - (r.T) 1
    kept = levers[:, :, None] * force[:, None, :] - (levers * force).sum(axis=1)[:, None, None] * np.eye(3)
    matrix[3:, 3:] = (across @ blocks @ turn + kept).sum(axis=0)
    return matrix


def _cross_matrix(vectors: Array) -> Array:
    """Matrices (m, 3, 3) that turn a vector v into r x v, for the rows r of `vectors`."""
    matrix = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    matrix[:, 0, 1], matrix[:, 0, 2], matrix[:, 1, 2] = -z, y, -x
    matrix[:, 1, 0], matrix[:, 2, 0], matrix[:, 2, 1] = z, -y, x
    return matrix
