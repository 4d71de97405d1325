"""A platform on four cables with two free motions, and its log: a twin whose code shares no part with the fit.

The cables are Irvine's elastic catenaries in closed form. Newton's method with differences finds pose and cable forces
together.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array

FRAME: Final = np.array([[-1.4, -1.1, 2.6], [1.4, -1.1, 2.6], [1.4, 1.1, 2.6], [-1.4, 1.1, 2.6]])  # m
PLATFORM: Final = np.array([[-0.2, -0.15, 0.12], [0.2, -0.15, 0.12], [0.2, 0.15, 0.12], [-0.2, 0.15, 0.12]])  # m
MASS: Final = 12.992  # kg
CENTER: Final = np.array([0.0, 0.0, 0.02])  # m
STIFFNESS: Final = 6e4  # N
DENSITY: Final = 0.006  # kg/m
GRAVITY: Final = 9.81  # m/s^2
AXES: Final = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])  # toward the platform
POSES: Final = 27
LENGTH_NOISE: Final = 2e-3  # m
CELL_NOISE: Final = 2.0  # N
TOLERANCES: Final = {"frame_anchors": 0.01, "length_zero": 0.02, "axial_stiffness": 0.2, "center_of_mass": 0.01}
MASS_OFF: Final = 0.05  # relative error of the mass in the robot file
LEAST: Final = 10.0  # N
DEFECTS: Final = ("gains of the same sign", "gains of any sign", "one gain", "biases", "gains and biases")


class Twin(NamedTuple):
    """True machine: anchors [m], mass [kg], center of mass [m], stiffness [N], length zeros [m], cells."""

    frame: Array
    mass: float
    center: Array
    stiffness: float
    zeros: Array
    gain: Array
    bias: Array
    radius: float = 0.0  # of the pulleys [m], with the swivel axes `AXES`; 0 for eyelets


def drawn_robot(**changes: Any) -> sl.Robot:
    """Robot of the robot file, without a tolerance of the mass."""
    return sl.Robot(
        "four cables",
        frame_anchors=FRAME,
        platform_anchors=PLATFORM,
        cables=sl.Cable(linear_density=DENSITY, axial_stiffness=STIFFNESS),
        mass=MASS,
        inertia=np.diag([0.2, 0.3, 0.4]),
        center_of_mass=CENTER,
        gravity=GRAVITY,
        tolerances={"axial_stiffness": 0.2 * STIFFNESS, **{k: v for k, v in TOLERANCES.items() if "stiff" not in k}},
        **changes,
    )


def twin_of(seed: int, defect: str | None = None) -> Twin:
    """A machine with errors of its drawing and a defect of its load cells."""
    rng = np.random.default_rng(seed)
    normal = rng.normal
    gain, bias = np.ones(4), np.zeros(4)
    off, sign = rng.uniform(0.05, 0.10, 4), rng.choice([-1.0, 1.0], 4)
    if defect in ("gains of the same sign", "gains and biases"):
        gain += sign[0] * off
    elif defect == "gains of any sign":
        gain += sign * off
    elif defect == "one gain":
        gain[seed % 4] += 2.0 * sign[0] * off[0]
    if defect in ("biases", "gains and biases"):
        bias += rng.uniform(-20.0, 20.0, 4)
    return Twin(
        FRAME + TOLERANCES["frame_anchors"] * normal(size=(4, 3)),
        MASS * np.exp(MASS_OFF * normal()),
        CENTER + TOLERANCES["center_of_mass"] * normal(size=3),
        STIFFNESS * np.exp(TOLERANCES["axial_stiffness"] * normal()),
        TOLERANCES["length_zero"] * normal(size=4),
        gain,
        bias,
    )


def cable_vectors(force: Array, length: Array, stiffness: float) -> tuple[Array, Array]:
    """Vectors from the platform end to the frame end [m] (4, 3) and tensions there [N] for forces on the platform."""
    weight = DENSITY * GRAVITY
    flat = np.hypot(force[:, 0], force[:, 1])
    below, above = force[:, 2], force[:, 2] + weight * length
    along = (np.arcsinh(above / flat) - np.arcsinh(below / flat)) / weight + length / stiffness
    tension = np.hypot(flat, above)
    rise = (tension - np.hypot(flat, below)) / weight + length * (below + above) / (2.0 * stiffness)
    return np.column_stack((force[:, :2] * along[:, None], rise)), tension


def pulleys_at(twin: Twin, force: Array, length: Array) -> tuple[Array, Array, Array]:
    """Exit points [m] (4, 3), unstrained lengths on the pulleys [m], and unit vectors from the axes to their centers.

    A pulley is in the plane of its axis and of the cable, whose force on the pulley has a moment about no other axis.
    """
    pull = -force - np.outer(DENSITY * GRAVITY * length, [0.0, 0.0, 1.0])
    tension, along = np.linalg.norm(pull, axis=1), np.sum(pull * AXES, axis=1)
    outward = pull - along[:, None] * AXES
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    wrap = np.arccos(along / tension)
    points = twin.radius * ((1.0 - np.cos(wrap))[:, None] * outward + np.sin(wrap)[:, None] * AXES)
    return twin.frame + points, twin.radius * wrap / (1.0 + tension / twin.stiffness), outward


def residuals(unknown: Array, twin: Twin, place: Array) -> Array:
    """Gaps of the cables [m], and force and moment about the center of mass divided by the weight, (18,).

    unknown: roll, pitch [rad], lengths of the free spans [m], forces [N]; place: x, y, z [m] and yaw [rad].
    """
    turn = turn_of(unknown, place)
    force = unknown[6:].reshape(4, 3)
    ends = place[:3] + PLATFORM @ turn.T
    exits = pulleys_at(twin, force, unknown[2:6])[0] if twin.radius else twin.frame
    gaps = ends + cable_vectors(force, unknown[2:6], twin.stiffness)[0] - exits
    arms = ends - place[:3] - turn @ twin.center
    weight = twin.mass * GRAVITY
    balance = np.concatenate((force.sum(axis=0) - [0.0, 0.0, weight], np.cross(arms, force).sum(axis=0)))
    return np.concatenate((gaps.ravel(), balance / weight))


def turn_of(unknown: Array, place: Array) -> Array:
    """Rotation matrix of yaw, pitch and roll."""
    (a, b, c), (p, q, r) = np.cos([place[3], *unknown[1::-1]]), np.sin([place[3], *unknown[1::-1]])
    return np.array(
        [
            [a * b, a * q * r - p * c, a * q * c + p * r],
            [p * b, p * q * r + a * c, p * q * c - a * r],
            [-q, b * r, b * c],
        ]
    )


def at_rest(twin: Twin, place: Array) -> Array | None:
    """Roll, pitch, lengths and forces at x, y, z and yaw; None if a tension is below `LEAST`."""
    ends = place[:3] + PLATFORM @ turn_of(np.zeros(2), place).T
    reach = twin.frame - ends
    length = np.linalg.norm(reach, axis=1)
    lines = np.vstack((reach.T, np.cross(ends - place[:3], reach)[:, 2])) / length
    pull = np.linalg.solve(lines, [0.0, 0.0, twin.mass * GRAVITY, 0.0])
    if pull.min() < LEAST:
        return None
    found = np.concatenate((np.zeros(2), length, (reach * (pull / length)[:, None]).ravel()))
    for _ in range(20):
        miss = residuals(found, twin, place)
        steps = 1e-6 * np.maximum(1.0, np.abs(found))
        slopes = [(residuals(found + way, twin, place) - miss) / way.sum() for way in np.diag(steps)]
        change = np.linalg.solve(np.transpose(slopes), miss)
        found = found - change * min(1.0, 0.2 / np.abs(change[:6]).max())
        if np.abs(change[:6]).max() < 1e-9:
            return np.asarray(found)
    return None


def log_of_twin(twin: Twin, seed: int, poses: int = POSES) -> sl.WinchLog:
    """Readings of lengths and load cells at places of the workspace with noise, and the commanded poses."""
    return log_with_inclinations(twin, seed, poses)[0]


def log_with_inclinations(twin: Twin, seed: int, poses: int = POSES) -> tuple[sl.WinchLog, Array]:
    """The log of `log_of_twin`, and yaw, pitch and roll of the twin (N, 3) [rad]."""
    log, angles, _ = log_with_poses(twin, seed, poses)
    return log, angles


def log_with_poses(twin: Twin, seed: int, poses: int = POSES, noise: float = 1.0) -> tuple[sl.WinchLog, Array, Array]:
    """The log of `log_of_twin`, yaw, pitch and roll of the twin (N, 3) [rad], and its position (N, 3) [m].

    noise: factor of the usual noise.
    """
    rng = np.random.default_rng((seed, 1))
    lengths: list[Array] = []
    cells: list[Array] = []
    stood: list[Array] = []
    turned: list[Array] = []
    placed_at: list[Array] = []
    while len(stood) < poses:
        place = rng.uniform([-0.7, -0.5, 0.4, -0.04], [0.7, 0.5, 1.7, 0.04])
        found = at_rest(twin, place)
        if found is None or np.abs(found[:2]).max() > 0.5:
            continue
        tension = cable_vectors(found[6:].reshape(4, 3), found[2:6], twin.stiffness)[1]
        if tension.min() < LEAST:
            continue
        on_pulley = pulleys_at(twin, found[6:].reshape(4, 3), found[2:6])[1] if twin.radius else 0.0
        lengths.append(found[2:6] + on_pulley - twin.zeros + noise * LENGTH_NOISE * rng.normal(size=4))
        cells.append(twin.gain * tension + twin.bias + noise * CELL_NOISE * rng.normal(size=4))
        angles = np.array([place[3], found[1], found[0]])
        turned.append(angles)
        placed_at.append(place[:3])
        stood.append(np.concatenate((place[:3] + 0.02 * rng.normal(size=3), angles + 0.01 * rng.normal(size=3))))
    placed = np.array(stood)
    log = sl.WinchLog(
        unstrained_length=np.array(lengths),
        load_cells=np.array(cells),
        commanded=sl.Pose(placed[:, :3], Rotation.from_euler("ZYX", placed[:, 3:])),
        sensors=sl.Sensors(noise * LENGTH_NOISE, noise * CELL_NOISE),
    )
    return log, np.array(turned), np.array(placed_at)
