"""A platform that carries what lies on it of lumped cables: one rigid body, its motion told as the platform's own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.kernels.dynamics import rigid_body as body


@dataclass(frozen=True, slots=True, eq=False)
class Carrier:
    """The rigid body of a platform with masses at its cables' ends; both have principal axes of their own.

    Attributes:
        inertia: Mass and principal moments of the whole, infinite where it does not turn, (4,).
        center: Of its mass, from that of the platform's, the platform's principal axes [m], (3,).
        axes: Its principal axes in those of the platform, one a column, (3, 3).
    """

    inertia: Array
    center: Array
    axes: Array

    @classmethod
    def of(cls, inertia: Array, masses: Array, ends: Array) -> Carrier:
        """A platform and masses at places on it.

        Args:
            inertia: Mass and principal moments of the platform, (4,).
            masses: [kg], (m,).
            ends: From its center of mass, its principal axes [m], (m, 3).
        """
        mass = inertia[0] + masses.sum()
        center = (masses @ ends) / mass
        turns = np.isfinite(inertia[1:])
        own = np.diag(np.where(turns, inertia[1:], 0.0))
        whole = own + _about(inertia[:1], -center[None]) + _about(masses, ends - center)
        if turns.all():
            moments, axes = np.linalg.eigh(whole)
            axes[:, 0] *= np.sign(np.linalg.det(axes))
        else:  # a planar motion, about the last axis, or none
            moments, axes = np.where(turns, np.diag(whole), np.inf), np.eye(3)
        return cls(np.array([mass, *moments]), center, axes)

    def levers(self, ends: Array) -> Array:
        """Places on the platform (m, 3) as the whole sees them, from its center along its axes."""
        levers: Array = (ends - self.center) @ self.axes
        return levers

    def state(self, place: Array, turning: Array, velocity: Array, spin: Array) -> Array:
        """The row of the whole's state, where the platform is and moves.

        Args:
            place: Of the platform's center of mass [m], (3,).
            turning: From its principal axes to the world, (3, 3).
            velocity: Of its center of mass [m/s], (3,).
            spin: Its angular velocity, world axes [rad/s], (3,).
        """
        lever, axes = turning @ self.center, turning @ self.axes
        moments = np.where(np.isinf(self.inertia[1:]), 0.0, self.inertia[1:])
        quaternion = Rotation.from_matrix(axes).as_quat()
        momentum = axes @ (moments * (axes.T @ spin))
        return np.concatenate((place + lever, quaternion, velocity + np.cross(spin, lever), momentum))

    def seen(self, states: Array) -> Array:
        """States of the whole (N, 13) as those of the platform; both with the angular velocity in momentum's place."""
        turning = Rotation.from_quat(states[:, body.TURN : body.VELOCITY]).as_matrix() @ self.axes.T
        lever, spin = turning @ self.center, states[:, body.MOMENTUM :]
        place = states[:, : body.TURN] - lever
        velocity = states[:, body.VELOCITY : body.MOMENTUM] - np.cross(spin, lever)
        return np.concatenate((place, Rotation.from_matrix(turning).as_quat(), velocity, spin), axis=1)

    def spin(self, state: Array) -> Array:
        """Angular velocity of a state of the whole, world axes [rad/s], (3,)."""
        axes = Rotation.from_quat(state[body.TURN : body.VELOCITY]).as_matrix()
        spin: Array = axes @ ((axes.T @ state[body.MOMENTUM :]) / self.inertia[1:])
        return spin


def _about(masses: Array, places: Array) -> Array:
    """Inertia of point masses (m,) at places (m, 3) about the origin."""
    squares = (places * places).sum(axis=1)
    inertia: Array = (masses * squares).sum() * np.eye(3) - (masses[:, None] * places).T @ places
    return inertia
