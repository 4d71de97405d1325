"""A motion of the robot in time, as it was integrated."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.results import Result, Saved
from sagline.dynamics.damping import Damping
from sagline.dynamics.drives import Winches
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


@dataclass(frozen=True, slots=True, eq=False)
class EnergyBalance(Result):
    """Where the energy of a simulation is [J]; each of shape (N,).

    Attributes:
        kinetic: Of platform, cables and drums.
        potential: Of weight and of strain and height of the cables off the drums, frame ends and the origin at zero.
        supplied: Work done on the robot since the start: by winches, given forces and wind.
        lost: Work done by damping and friction since the start, strain that slipped on drums, and what chains lost
            where nodes were born and merged.
        removed: Energy that left the robot with cables that broke and loads that were dropped since the start, less
            what loads brought that were picked up. Heights count in it as in `potential`, so it has either sign.
        error: kinetic + potential - supplied + lost + removed, less its value at the start: what the integrator
            invents.
    """

    kinetic: Array
    potential: Array
    supplied: Array
    lost: Array
    removed: Array
    error: Array


@dataclass(frozen=True, slots=True, eq=False)
class Occurrence:
    """Something that happened to the robot while it moved.

    Attributes:
        time: When [s].
        kind: "break", "stall", "brake", "drop" or "pick up", as asked for; "saturate" or "slack" by itself.
        cable: Which cable or winch, or None where it is the platform's.
        tension_before: Largest tension of that cable, or of all, before it [N].
        tension_after: Largest tension of any cable after it, to the end or the next [N].
    """

    time: float
    kind: str
    cable: int | None
    tension_before: float
    tension_after: float


@dataclass(frozen=True, slots=True, eq=False)
class Simulation(Result, Saved):
    """Result of `simulate`: N samples of a motion.

    Attributes:
        robot: The robot.
        time: [s], increasing, shape (N,): every so many steps, and the end.
        pose: Poses of the platform, a batch of N.
        twist: Velocity of the platform's origin and angular velocity, world axes [m/s, rad/s], shape (N, 6).
        tensions: At the frame ends [N], shape (N, m).
        length: Unstrained lengths off the drum [m], shape (N, m); NaN of a cable that has broken.
        energy: Where the energy is.
        events: What happened, in order.
        cable_mass: "none", "lumped" or "modal".
        step: Of the integrator [s].
        nodes: Position of every cable at its nodes, world axes [m], shape (N, m, P, 3); None without cable mass, NaN of
            a cable that has broken.
        integrator: "runge-kutta" or "splitting"; "exact" of modes.
        winches: "ideal", "robot" or SecondOrder(...).
        winding: "constant" or "remembered".
        damping: What took energy out of the cables.
        largest_tension: Of each cable at the frame end at any step, also between samples [N], shape (m,); None where it
            is not known.
    """

    robot: Robot
    time: Array
    pose: Pose
    twist: Array
    tensions: Array
    length: Array
    energy: EnergyBalance
    events: tuple[Occurrence, ...]
    cable_mass: str
    step: float
    nodes: Array | None = None
    integrator: str = "runge-kutta"
    winches: Winches = "ideal"
    winding: str = "constant"
    damping: Damping = field(default_factory=Damping)
    largest_tension: Array | None = None


def energy_balance(kinetic: Array, potential: Array, supplied: Array, lost: Array, removed: Array) -> EnergyBalance:
    """The balance of five energies [J], each of shape (N,)."""
    total = kinetic + potential - supplied + lost + removed
    return EnergyBalance(*map(locked, (kinetic, potential, supplied, lost, removed, total - total[0])))


def twist_of_origin(robot: Robot, pose: Pose, velocity: Array, spin: Array) -> Array:
    """Twists of the platform frame's origin, as a path has them, from motions of the center of mass.

    Args:
        robot: The robot.
        pose: Poses, a batch of N.
        velocity: Of the center of mass, world axes [m/s], (N, 3).
        spin: Angular velocity, world axes [rad/s], (N, 3).

    Returns:
        Shape (N, 6), write-locked.
    """
    lever = pose.matrix @ robot.center_of_mass
    return locked(np.concatenate((velocity - np.cross(spin, lever), spin), axis=1))
