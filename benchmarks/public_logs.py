"""Readers of measurements of real robots that their authors have published.

The data have no license that allows copies, so that they are not part of sagline. The readers follow the formats of the
files in clones of the authors' repositories. World axes of the results: z up, opposite to gravity.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.io import loadmat
from scipy.optimize import minimize_scalar
from scipy.signal import decimate
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array

REPOSITORIES: Final = {
    "cdpr_matlab": "https://github.com/IRMA-LAB/cdpr_matlab",
    "UACDPR_SelfCalibration": "https://github.com/fzoffoli/UACDPR_SelfCalibration",
    "cable-robot": "https://github.com/gchenfc/cable-robot",
}
ROPE: Final = sl.Cable(1e-3, 1e5)  # the authors neglect weight and stretch of these ropes
SWINGS: Final = Path("apps/experiments_on_natural_frequencies/EE_pose_vicon")
RATE: Final = 100.0  # samples per second of markers and of the log of cable-robot [1/s]
DECIMATION: Final = 5
SPARE: Final = 2  # number of oscillations that are fitted in addition to the modes
DIAMONDS: Final = Path("analysis/gerry00_estimation/13_concentric_diamonds_1mps_cal")
MOTION_END: Final = 24.5  # time from the start of the motion to the end of the evaluation [s]
MOVED: Final = 0.02  # displacement along x that counts as the start of the motion [m]
BRACKET: Final = 0.026  # distance from a marker to the cable anchor beside it, along x [m]
PLANAR_ROPE: Final = sl.Cable(0.007, 1.4e4)


class Swing(NamedTuple):
    """A free swing of a suspended platform, with n modes."""

    robot: sl.Robot
    lengths: Array  # lengths of the cables, pulleys included [m], (m,)
    pose: sl.Pose  # pose at rest, from the authors' model
    predicted: Array  # natural frequencies from the authors' model [Hz], ascending, (n,)
    measured: Array  # frequencies of the markers' motion [Hz], ascending, at most n


class Session(NamedTuple):
    """Readings of a suspended platform at N poses at rest, and the authors' self-calibration."""

    robot: sl.Robot
    lengths: Array  # [m], (N, m)
    load_cells: Array  # [N], (N, m)
    tilt: Array  # roll and pitch [rad], (N, 2)
    first: sl.Pose  # first pose, from the authors' pose estimation
    error: float  # distance between the authors' self-calibration and this pose [m]
    duration: float  # time of the authors' self-calibration [s]


class Tracked(NamedTuple):
    """Motion of a planar robot: lengths of its drives, the controller's estimate, and motion capture."""

    robot: sl.Robot
    lengths: Array  # [m], (N, 4)
    estimated: Array  # position in the plane, from the controller [m], (N, 2)
    position: Array  # measured position [m], (N, 3)


def suspended_robot(name: str, up: Array, platform: Mapping[str, Any], pulleys: Mapping[str, Array]) -> sl.Robot:
    """Robot with z along `up`, and with pulleys."""
    turned = upright(up)
    winches = sl.Winch(pulleys["radius"], swivel_axis=turned.apply(pulleys["axis"]))
    return sl.Robot(
        name, turned.apply(pulleys["entry"]), pulleys["anchor"], ROPE, gravity=9.80665, winches=winches, **platform
    )


def upright(up: Array) -> Rotation:
    """Shortest rotation that turns the unit vector `up` to the z axis."""
    axis = np.cross(up, (0.0, 0.0, 1.0))
    size = float(np.linalg.norm(axis))
    return Rotation.from_rotvec(axis * (np.arctan2(size, up[2]) / size if size > 0.0 else 0.0))


def read_swings(folder: Path) -> Iterator[Swing]:
    """Free swings in a clone of cdpr_matlab. A swing without a pose or without markers is omitted."""
    robots: dict[int, tuple[sl.Robot, Rotation]] = {}
    files = sorted((folder / SWINGS).glob("vicon_data_f_*.mat"), key=lambda file: int(file.stem.split("_")[-1]))
    for file in files:
        markers = file.with_name(file.name.replace("data_f", "markers"))
        if not markers.exists():
            continue
        res = variable(file, "res")
        lengths = np.atleast_1d(res["l"])
        if lengths.size not in robots:
            robots[lengths.size] = read_prototype(folder / f"config/Grab_prototype_{lengths.size}{lengths.size}.json")
        robot, turned = robots[lengths.size]
        signals = np.concatenate([np.atleast_2d(each["p"]) for each in variable(markers, "m")])
        predicted = np.sort(np.atleast_1d(res["f"]))
        measured = frequencies_of(signals, predicted.size)
        yield Swing(robot, lengths, pose_of(np.asarray(res["pose"]), turned), predicted, measured)


def read_prototype(file: Path) -> tuple[sl.Robot, Rotation]:
    """Robot in a configuration file of cdpr_matlab, and the rotation from the axes of the file."""
    given = json.loads(file.read_text())
    body, active = given["platform"], [each for each in given["actuator"] if each["active"]]
    pulleys = {
        "radius": np.array([each["pulley"]["radius"] for each in active]),
        "axis": np.array([np.ravel(each["pulley"]["vers_k"]) for each in active]),
        "entry": np.array([np.ravel(each["pulley"]["pos_OD_glob"]) for each in active]),
        "anchor": np.array([np.ravel(each["winch"]["pos_PA_loc"]) for each in active]),
    }
    platform = {
        "mass": body["mass"],
        "inertia": np.array(body["inertia_mat_G_loc"]),
        "center_of_mass": np.ravel(body["pos_PG_loc"]),
    }
    up = np.ravel(body["gravity_axis"])
    return suspended_robot(file.stem, up, platform, pulleys), upright(up)


def pose_of(coordinates: Array, turned: Rotation) -> sl.Pose:
    """Pose from position [m] and angles about x, the new y and the new z [rad], (6,)."""
    rotation = turned * Rotation.from_euler("XYZ", coordinates[3:6])
    return sl.Pose(turned.apply(np.array(coordinates[:3])), rotation)


def frequencies_of(signals: Array, modes: int) -> Array:
    """Frequencies [Hz] of the strongest damped oscillations that all `signals` (C, N) contain, ascending.

    The shift invariance of the block Hankel matrix gives the poles (Kung 1978; Juang & Pappa 1985).
    """
    short = decimate(signals - signals.mean(axis=1, keepdims=True), DECIMATION, axis=1)
    channels, samples = short.shape
    height = samples // 3
    hankel = np.concatenate([short[:, i : i + samples - height] for i in range(height)])
    order = 2 * (modes + SPARE)
    base = np.linalg.svd(hankel, full_matrices=False)[0][:, :order]
    poles = np.linalg.eigvals(np.linalg.lstsq(base[:-channels], base[channels:], rcond=None)[0])
    series = poles[:, None] ** np.arange(samples)
    amplitudes = np.linalg.lstsq(series.T, short.T.astype(complex), rcond=None)[0]
    energy = (np.abs(series) ** 2).sum(axis=1) * (np.abs(amplitudes) ** 2).sum(axis=1)
    energy[poles.imag <= 0.0] = -1.0  # one of each conjugate pair, and no drift
    strongest = np.argsort(-energy)[:modes]
    return np.sort(np.angle(poles[strongest[energy[strongest] > 0.0]]) * RATE / DECIMATION / (2.0 * np.pi))


def read_session(folder: Path) -> Session:
    """The session of 27 poses in a clone of UACDPR_SelfCalibration."""
    config = variable(folder / "libs/config/IRMA4U_Mar25.mat", "s")
    body, wheels = config["EndEffector"]["Platform"], config["Trasmission"]["Pulley"]
    pulleys = {
        "radius": np.array([each["r"] for each in wheels], dtype=float),
        "axis": np.array([np.ravel(each["FixedFrame"][2]) for each in wheels]),
        "entry": np.array([np.ravel(each["CableEnterPosition"]) for each in wheels]),
        "anchor": np.array([np.ravel(each) for each in body["points"]]),
    }
    platform = {"mass": body["m"], "inertia": body["InertialMatrix"], "center_of_mass": np.ravel(body["PtoG"])}
    up = np.array([0.0, 0.0, 1.0])
    robot = suspended_robot("IRMA-4U", up, platform, pulleys)
    file = folder / "ws_selfcalibration_27_final.mat"
    names = ("cable_length_meas", "loadcell_meas", "epsilon_meas", "zeta_0_real", "InitialPositionErrorNorm")
    lengths, cells, angles, first, error = (np.asarray(variable(file, name), dtype=float) for name in names)
    duration = float(variable(file, "self_calib_comp_time"))
    pose = pose_of(np.ravel(first), Rotation.identity())
    return Session(robot, lengths.T, cells.T, angles[:2].T, pose, float(error), duration)


def variable(file: Path, name: str) -> Any:
    """Variable of a `.mat` file, with structures as dictionaries."""
    if not file.exists():
        raise sl.FileError(file, "does not exist", "Download the repository again.")
    found = loadmat(file, variable_names=[name], simplify_cells=True)
    if name not in found:
        raise sl.FileError(file, f"has no variable {name}", "Download the repository again.")
    return found[name]


def read_tracked(folder: Path) -> Tracked:
    """The motion along 13 concentric diamonds in a clone of cable-robot."""
    file = folder / DIAMONDS
    estimated, lengths = read_controller(file.with_suffix(".txt"))
    time, place, corners, anchors = read_capture(file.with_suffix(".csv"))
    begun = next(k for k in count() if abs(estimated[k, 0] - estimated[0, 0]) > MOVED)
    moving = next(k for k in count() if abs(place[k, 0] - place[0, 0]) > MOVED)
    estimated, lengths = (each[begun : begun + int(MOTION_END * RATE)] for each in (estimated, lengths))
    own = np.arange(len(estimated)) / RATE

    def at(offset: float) -> Array:
        later = own + time[moving] + offset
        return np.stack([np.interp(later, time, column) for column in place.T], axis=1)

    def distance(offset: float) -> float:
        # the estimate of the controller has other scales and axes than the measured positions
        measured = np.column_stack((at(offset), np.ones(len(own))))
        return float(np.linalg.lstsq(measured, estimated)[1].sum())

    found = at(minimize_scalar(distance, bounds=(-0.5, 0.5), method="bounded").x)
    flat = np.insert(found, 1, 0.0, axis=1)
    robot = sl.Robot(
        "GTGraffiti", np.insert(corners, 1, 0.0, axis=1), np.insert(anchors, 1, 0.0, axis=1), PLANAR_ROPE, 1.0,
        0.01 * np.eye(3), motion_pattern="1R2T", plane_normal=(0.0, 1.0, 0.0), tension_min=5.0,
    )  # fmt: skip
    return Tracked(robot, lengths, estimated, flat)


def read_controller(file: Path) -> tuple[Array, Array]:
    """Estimated positions (N, 2) [m] and lengths (N, 4) [m] in the log of the controller."""
    if not file.exists():
        raise sl.FileError(file, "does not exist", "Download the repository again.")
    words = [line.split() for line in file.read_text().splitlines() if line[:1].isdigit()]
    columns = (1, 2, 9, 14, 19, 24)
    rows = np.array([[float(each[k]) for k in columns] for each in words if len(each) > max(columns) + 1])
    return rows[:, :2], -rows[:, 2:]


def read_capture(file: Path) -> tuple[Array, Array, Array, Array]:
    """Times (N,) [s], positions (N, 2), corners of the frame (4, 2) and anchors of the platform (4, 2) [m].

    The axes are horizontal and vertical, with their origin at the lower left corner. The order of the corners is: lower
    right, upper right, upper left, lower left.
    """
    with file.open(newline="") as lines:
        head = [row for _, row in zip(range(7), csv.reader(lines), strict=False)]
    titles, kinds, axes = head[3], head[5], head[6]
    data = np.genfromtxt(file, delimiter=",", skip_header=7)
    body = next(name for name in titles if name.endswith("_1")).removesuffix("_1")

    def seen(name: str) -> Array:
        found = zip(titles, kinds, axes, strict=False)
        where = {axis: k for k, (title, kind, axis) in enumerate(found) if (title, kind) == (name, "Position")}
        return data[:, [where["Z"], where["Y"]]]  # x is normal to the plane, and y is up

    place = seen(body)
    loose = sorted({name for name in titles if name.startswith("Marker_")})
    corners = in_order(np.array([np.nanmean(seen(name), axis=0) for name in loose]))
    markers = in_order(np.array([np.nanmean(seen(f"{body}_{k}") - place, axis=0) for k in (1, 2, 3, 4)]))
    markers[:, 0] += BRACKET * np.sign(markers[:, 0] - markers[:, 0].mean())
    across = (corners[0] - corners[3]) / np.linalg.norm(corners[0] - corners[3])
    axes_of_frame = np.array([across, (-across[1], across[0])])
    known = np.isfinite(place).all(axis=1)
    turned = [each @ axes_of_frame.T for each in (place[known] - corners[3], corners - corners[3], markers)]
    return data[known, 1], turned[0], turned[1], turned[2]


def in_order(points: Array) -> Array:
    """Four points in the order: lower right, upper right, upper left, lower left."""
    right, up = (points > points.mean(axis=0)).T
    return points[np.argsort(np.where(right, np.where(up, 1, 0), np.where(up, 2, 3)))]
