"""Equilibrium of a robot with lumped-mass cables, with an error of the order nodes^-2."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.results import displaced_pose
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.statics.slopes import motions_of_ends, platform_end_forces

STEPS = 60
NEAR = 1e-8  # relative error of a length or force; from this error, one more Newton step reaches rounding error
NEUTRAL = 1e-12  # a stiffness below this share of the largest stiffness counts as zero
# largest step, as a share of the force; after a longer step, a chain far from its solution could fold
LONGEST_STEP = 0.2


class _LumpedCables:
    """Cables divided into elements."""

    def __init__(self, state: Equilibrium, nodes: int) -> None:
        """Divide the cables of a state into `nodes` elements each."""
        material = state.cables.cable
        # element: unstrained length of the elements [m], shape (m,)
        # weight: weight per length [N/m], shape (m,)
        # stiffness: EA [N], shape (m,)
        self.element, self.nodes = state.free_length / nodes, nodes
        self.weight, self.stiffness = material.linear_density * state.one_robot.gravity, material.axial_stiffness

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
        return np.asarray(self.element[:, None, None] * (along + (across / size[..., None, None]).sum(axis=1)))


def chains_at_rest(state: Equilibrium, nodes: int) -> tuple[Pose, Array, Array]:
    """Compute the platform and chains at rest with the cable lengths of `state`: pose, nodes and forces."""
    # nodes: world axes, from the platform end to the exit [m], shape (m, 3, nodes + 1); forces: on the platform ends of
    # the cables, including half an element's weight [N], shape (m, 3); the force on the platform is the opposite
    #
    # The force in an element is the force of the exact cable at the center of the element. The end of the chain
    # therefore follows from the midpoint rule, and pose and forces have errors of the order nodes^-2. The wrench is
    # balanced to rounding. Source: docs/model.md, section 11
    robot, exits = state.one_robot, state.exit_point
    chains = _LumpedCables(state, nodes)
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
        near = bool(np.abs(motion).max() <= NEAR * state.free_length.max())
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
    ends = motions_of_ends(levers)
    matrix = np.asarray((np.swapaxes(ends, -1, -2) @ blocks @ ends).sum(axis=0))
    # the force keeps its direction while r rotates: r T^T - (r.T) 1
    matrix[3:, 3:] += levers.T @ force - (levers * force).sum() * np.eye(3)
    return matrix
