"""Robots with errors of their drawings, and the readings of their encoders and load cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.calibration.parameters import KINDS
from sagline.core.arrays import Array
from tests.calibration.reference import counts_of
from tests.kinematics.feasible import box_poses

LENGTH_NOISE: Final = 5e-4  # m
TENSION_NOISE: Final = 5.0  # N
PAUSE: Final = 30.0  # s between rows: too long to see whether the platform moved
COMMANDED_OFF: Final = (0.03, 0.01)  # m and rad: difference between commanded and true poses
USUAL: Final[Mapping[str, float]] = {  # errors of a robot that is set up with a tape measure
    "frame_anchors": 0.05,
    "length_zero": 0.03,
    "axial_stiffness": 0.1,
    "mass": 0.03,
    "center_of_mass": 0.02,
}
DRUMS: Final[Mapping[str, Any]] = {
    "drum_radius": 0.06,
    "groove_pitch": 0.006,
    "gear": 10.0,
    "counts_per_turn": 4096.0,
    "length_zero": 10.0,
    "winding_tension": 200.0,
}
_OF_WINCHES: Final = ("length_zero", "drum_radius", "pulley_radius", "dead_cable", "load_cell_gain", "load_cell_bias")
_OF_CABLES: Final = ("linear_density", "axial_stiffness")


class Truth(NamedTuple):
    """True values of a robot.

    Attributes:
        robot: With its true values, gain and bias of the load cells in its winches.
        length_offset: What is to be added to the lengths that the machine believes [m], (m,); zero with counts.
        sensors: Deviations, and where the measuring system and its target really are.
    """

    robot: sl.Robot
    length_offset: Array
    sensors: sl.Sensors


class Synthetic(NamedTuple):
    """A log and its true values.

    Attributes:
        log: The readings.
        pose: Where the platform stood, N of them.
        length: True lengths off the drums [m], (N, m).
        tension: True tensions at the frame ends [N], (N, m).
    """

    log: sl.WinchLog
    pose: sl.Pose
    length: Array
    tension: Array


def with_drums(name: str = "cogiro", **changes: Any) -> sl.Robot:
    """A robot with 4 mm rope on single-layer drums with encoders."""
    robot = sl.load_robot(name)
    winches = sl.Winch(**{**DRUMS, **changes})
    return robot.replace(cables=robot.cables.replace(diameter=0.004), winches=winches)


def usual_sensors(**changes: Any) -> sl.Sensors:
    """0.5 mm and 5 N."""
    return sl.Sensors(**{"length_deviation": LENGTH_NOISE, "tension_deviation": TENSION_NOISE, **changes})


def true_robot(
    nominal: sl.Robot, errors: Mapping[str, float] = USUAL, seed: int = 0, sensors: sl.Sensors | None = None
) -> Truth:
    """A robot with normally distributed errors.

    Args:
        nominal: As its drawing has it.
        errors: Kind of unknown -> standard deviation, a share of the value where its logarithm is looked for. One
            number for all cables where that is usual of the kind. "measuring_frame": of its position, a tenth of it in
            rad of its rotation.
        seed: Of the errors.
        sensors: As they are believed to be.
    """
    rng = np.random.default_rng(seed)
    m = nominal.cable_count
    fields: dict[str, Any] = {}
    winches: dict[str, Any] = {}
    cables: dict[str, Any] = {}
    sensors = sensors if sensors is not None else usual_sensors()
    offset = np.zeros(m)
    counted = nominal.winches is not None and nominal.winches.counts_per_turn is not None
    for name, deviation in errors.items():
        kind = KINDS[name]
        shape = ((1 if kind.shared else m,) if kind.each else ()) + ((len(kind.axes),) if len(kind.axes) > 1 else ())
        error = deviation * rng.normal(size=shape)
        if name == "measuring_frame":
            moved = Rotation.from_rotvec(0.1 * error[3:]) * sensors.frame.rotation
            sensors = sensors.replace(frame=sl.Pose(sensors.frame.position + error[:3], moved))
        elif name == "target":
            sensors = sensors.replace(target=sensors.target + error)
        elif name == "length_zero" and not counted:
            offset = error
        elif name in _OF_WINCHES:
            before = getattr(nominal.winches or sl.Winch().per_cable(m), name)
            winches[name] = np.abs(before * np.exp(error) if kind.logarithmic else before + error)
            winches[name] = before + error if name == "load_cell_bias" else winches[name]
        elif name in _OF_CABLES:
            cables[name] = getattr(nominal.cables, name) * np.exp(error)
        else:
            before = getattr(nominal, name)
            fields[name] = before * np.exp(error) if kind.logarithmic else before + error
    if cables:
        fields["cables"] = nominal.cables.replace(**cables)
    if winches:
        fields["winches"] = (nominal.winches or sl.Winch()).replace(**winches)
    return Truth(nominal.replace(**fields), offset, sensors)


def log_of(
    truth: Truth,
    count: int = 60,
    seed: int = 0,
    *,
    sets: int = 4,
    positions: int = 0,
    rotations: int = 0,
    noise: float = 1.0,
    slips: Mapping[tuple[int, int], float] | None = None,
) -> Synthetic:
    """Readings of the robot at equilibrium in feasible poses of its box, with several sets of tensions at each pose.

    Args:
        truth: What the robot is.
        count: Number of rows.
        seed: Of poses, tensions and noise.
        sets: Sets of tensions a pose; the rows of a pose follow each other.
        positions: At how many rows, spread over the log, the position is measured.
        rotations: The same of the rotation.
        noise: Times the deviations of the sensors, 0 for exact readings.
        slips: (Row, cable) -> what slipped there beside the noise [m]: more is believed to be out than is.
    """
    rng = np.random.default_rng(seed)
    pose, length, tension = _feasible(truth.robot, count, sets, rng)
    m, sensors = truth.robot.cable_count, truth.sensors
    believed = length - truth.length_offset + noise * sensors.length_deviation * rng.normal(size=(count, m))
    for (row, cable), size in (slips or {}).items():
        believed[row, cable] += size
    winches = truth.robot.winches
    cells = None
    if sensors.tension_deviation is not None:
        gain, bias = (1.0, 0.0) if winches is None else (winches.load_cell_gain, winches.load_cell_bias)
        cells = gain * tension + bias + noise * sensors.tension_deviation * rng.normal(size=(count, m))
    position, rotation = _measured(truth.sensors, pose, positions, rotations, noise, rng)
    counted = winches is not None and winches.counts_per_turn is not None
    if counted:
        believed = counts_of(truth.robot, believed)
    log = sl.WinchLog(
        counts=believed if counted else None,
        unstrained_length=None if counted else believed,
        load_cells=cells,
        position=position,
        rotation=rotation,
        time=PAUSE * np.arange(count),
        commanded=_off(pose, rng),
        sensors=sensors,
    )
    return Synthetic(log, pose, length, tension)


def _feasible(robot: sl.Robot, count: int, sets: int, rng: np.random.Generator) -> tuple[sl.Pose, Array, Array]:
    """Poses, lengths and tensions, (count, ...)."""
    wanted = -(-count // sets)
    methods: list[sl.TensionMethod] = [sl.MinimumNorm()]
    mean = robot.mass * robot.gravity / robot.cable_count
    high = np.minimum(robot.tension_max, robot.tension_min + 20.0 * mean)
    for _ in range(sets - 1):
        methods.append(sl.QuadraticProgram(target=rng.uniform(robot.tension_min, high)))
    pose = box_poses(robot, wanted + wanted // 2 + 5, int(rng.integers(2**31)))
    plans = [sl.inverse(robot, pose, tension=method) for method in methods]
    feasible = np.flatnonzero(np.all([plan.feasible for plan in plans], axis=0))[:wanted]
    if len(feasible) < wanted:
        raise ValueError(f"{len(feasible)} of {wanted} poses of the box are feasible: take another robot")
    lengths = np.stack([plan.unstrained_length[feasible] for plan in plans], axis=1)
    tensions = np.stack([plan.state.cables.frame_end_tension[feasible] for plan in plans], axis=1)
    m = robot.cable_count
    where = np.repeat(feasible, sets)[:count]
    return pose[where], lengths.reshape(-1, m)[:count], tensions.reshape(-1, m)[:count]


def _measured(
    sensors: sl.Sensors, pose: sl.Pose, positions: int, rotations: int, noise: float, rng: np.random.Generator
) -> tuple[Array | None, Array | None]:
    """Readings of the measuring system, NaN in rows without a measurement."""
    count = len(pose)
    position = rotation = None
    out = sensors.frame.matrix
    if positions:
        rows = np.linspace(0, count - 1, positions).round().astype(int)
        target = pose[rows].transform(sensors.target)
        assert sensors.position_deviation is not None
        position = np.full((count, 3), np.nan)
        error = noise * sensors.position_deviation * rng.normal(size=(positions, 3))
        position[rows] = (target - sensors.frame.position) @ out + error
    if rotations:
        rows = np.linspace(0, count - 1, rotations).round().astype(int)
        assert sensors.rotation_deviation is not None
        turned = Rotation.from_rotvec(noise * sensors.rotation_deviation * rng.normal(size=(rotations, 3)))
        rotation = np.full((count, 4), np.nan)
        rotation[rows] = (turned * sensors.frame.rotation.inv() * pose[rows].rotation).as_quat()
    return position, rotation


def _off(pose: sl.Pose, rng: np.random.Generator) -> sl.Pose:
    """Commanded poses: rows of one pose have the same one."""
    step, angle = COMMANDED_OFF
    _, which = np.unique(pose.position, axis=0, return_inverse=True)
    poses = int(which.max()) + 1
    shift, turn = step * rng.normal(size=(poses, 3)), angle * rng.normal(size=(poses, 3))
    turned = Rotation.from_rotvec(turn[which]) * Rotation.from_quat(pose.quaternion.copy())
    return sl.Pose(pose.position + shift[which], turned)
