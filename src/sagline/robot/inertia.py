"""Inertia matrices of simple bodies, and of loaded platforms, about their center of mass [kg m^2]."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.arrays import Array

if TYPE_CHECKING:
    from sagline.robot.robot import Robot


def box_inertia(mass: float, x: float, y: float, z: float) -> Array:
    """A solid box, its edges along the platform's axes.

    mass: [kg]; x: edge along x [m]; y: edge along y [m]; z: edge along z [m]. Returns inertia about the center of mass
    [kg m^2], shape (3, 3).
    """
    return np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * (mass / 12.0)


def cylinder_inertia(mass: float, radius: float, height: float) -> Array:
    """A solid cylinder, its axis along the platform's z.

    mass: [kg]; radius: [m]; height: [m]. Returns inertia about the center of mass [kg m^2], shape (3, 3).
    """
    across = (3.0 * radius * radius + height * height) / 12.0
    return np.diag([across, across, 0.5 * radius * radius]) * mass


def with_mass(robot: Robot, mass: float) -> Robot:
    """A robot with another mass, spread as its own is: the inertia grows in proportion.

    mass: of the platform with its load [kg], > 0.
    """
    return robot.replace(mass=mass, inertia=robot.inertia * (mass / robot.mass))
