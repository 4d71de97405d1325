"""How squares of angular frequencies follow what a robot is made of, from the motions of its modes.

A mode of unit modal mass changes its square by its form of the change of D: d(omega^2) = phi^T dD phi. A cable's part
of that is minus the integral of f^T dC f + d(mu) u^2 along it, f and u the force and displacement in the mode, because
they make the integral of f^T C f + mu u^2 stationary; docs/model.md, section 11.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import CableSlopes, cable_slopes
from sagline.statics.stiffness import mass_matrix, stiffness


class Rest(NamedTuple):
    """A state, and how it settles.

    Attributes:
        state: The state, a single one.
        slopes: Of its cables.
        by_datum: Force on the platform ends by length, linear density and axial stiffness, shape (3, m, 3).
        settling: Motion by each of the same, shape (3, 6, m).
        compliance: Shape (6, 6).
        mass: Of the platform, shape (6, 6).
    """

    state: Equilibrium
    slopes: CableSlopes
    by_datum: Array
    settling: Array
    compliance: Array
    mass: Array


class Swings(NamedTuple):
    """Some modes of one frequency, g of them: the forms of what cables change by, for each two of them.

    Attributes:
        motion: Of the platform, unit modal mass, shape (6, g).
        square: Of the angular frequency [1/s^2].
        end_force: Of the cables on their platform ends, shape (m, g, 3).
        by_force: Integral of f^T dC f by the force at rest on the platform end, shape (m, g, g, 3).
        by_datum: The same by length, linear density (with that of mu u^2) and axial stiffness, shape (3, m, g, g).
    """

    motion: Array
    square: float
    end_force: Array
    by_force: Array
    by_datum: Array


class Slopes(NamedTuple):
    """Forms whose eigenvalues are derivatives of the square of the frequency, each (..., g, g).

    Attributes:
        datum: By length, linear density and axial stiffness of each cable, shape (3, m, g, g).
        pose: By motions at fixed lengths, shape (6, g, g).
        wrench: Shape (6, g, g).
        mass: Shape (g, g).
        inertia: Shape (3, 3, g, g).
    """

    datum: Array
    pose: Array
    wrench: Array
    mass: Array
    inertia: Array


def rest_of(state: Equilibrium) -> Rest:
    """What is needed of a state.

    Args:
        state: A single one, of exact or weightless cables.

    Returns:
        Rest.
    """
    slopes, known = cable_slopes(state), stiffness(state)
    return Rest(
        state,
        slopes,
        np.stack((slopes.by_length, slopes.by_density, slopes.by_stiffness)),
        np.stack((known.length_sensitivity, known.density_sensitivity, known.stiffness_sensitivity)),
        known.compliance,
        mass_matrix(state),
    )


def slopes_of(rest: Rest, swings: Swings) -> Slopes:
    """How the square of a frequency follows everything, the platform settling in its new equilibrium.

    Args:
        rest: The state.
        swings: The modes that have the frequency.

    Returns:
        Slopes.
    """
    robot, pose = rest.state.one_robot, _by_pose(rest, swings)
    turns = rest.state.pose.matrix.T @ swings.motion[3:]
    spins = np.einsum("ia,jb->ijab", turns, turns)
    moved = swings.motion[:3]
    own = -np.einsum("mabc,pmc->pmab", swings.by_force, rest.by_datum) - swings.by_datum
    own = own + lever_form(swings.motion[3:], rest.slopes.levers, rest.by_datum)
    sink = -robot.gravity * rest.compliance[:, 2]
    return Slopes(
        datum=own + np.einsum("kab,pkm->pmab", pose, rest.settling),
        pose=pose,
        wrench=np.einsum("kab,kj->jab", pose, rest.compliance),
        mass=np.einsum("kab,k->ab", pose, sink) - swings.square * moved.T @ moved,
        inertia=-0.5 * swings.square * (spins + np.swapaxes(spins, -1, -2)),
    )


def _by_pose(rest: Rest, swings: Swings) -> Array:
    """By motions of the platform in its pattern at fixed lengths, (6, g, g)."""
    slopes, turns = rest.slopes, swings.motion[3:]
    unit = np.eye(6)
    moved = np.cross(unit[:, None, 3:], slopes.levers)  # levers turn
    forces = np.einsum("mij,kmj->kmi", slopes.blocks, unit[:, None, :3] + moved)
    form = -np.einsum("mabc,kmc->kab", swings.by_force, forces)
    onto = np.cross(turns.T[:, None, None], moved)  # of mode b, by motion k, of cable m
    pulled = np.einsum("mai,bkmi->kab", swings.end_force, onto)
    form += pulled + np.swapaxes(pulled, -1, -2)
    form += (
        lever_form(swings.motion[3:], moved, slopes.force) + lever_form(swings.motion[3:], slopes.levers, forces)
    ).sum(axis=1)
    inertia = rest.mass[3:, 3:]
    for k, cross in enumerate(_cross_matrices()):
        form[3 + k] -= swings.square * turns.T @ (cross @ inertia - inertia @ cross) @ turns
    freedom = rest.state.one_robot.freedom
    kept: Array = np.einsum("kj,jab->kab", freedom.T @ freedom, form)
    return kept


def lever_form(turns: Array, levers: Array, force: Array) -> Array:
    """What forces on levers resist to rotations: r T^T - r.T, in its symmetric part.

    Args:
        turns: Rotation vectors, one a column, shape (3, g).
        levers: To the points of the forces, shape (..., 3).
        force: On the cables there, shape (..., 3).

    Returns:
        For each two rotations, shape (..., g, g).
    """
    along, pulled = levers @ turns, force @ turns
    mixed = along[..., :, None] * pulled[..., None, :]
    pressed = np.sum(levers * force, axis=-1)[..., None, None] * (turns.T @ turns)
    form: Array = 0.5 * (mixed + np.swapaxes(mixed, -1, -2)) - pressed
    return form


def _cross_matrices() -> Array:
    """Matrices that take a vector to the cross product of each axis with it, (3, 3, 3)."""
    return np.swapaxes(np.cross(np.eye(3)[:, None], np.eye(3)), -1, -2)
