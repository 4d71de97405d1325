"""Comparison with measurements of real robots that others have published: `python -m benchmarks.measured FOLDER`.

FOLDER contains clones of the authors' repositories; see `public_logs.REPOSITORIES`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Final

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks.measure import Compared, show
from benchmarks.public_logs import REPOSITORIES, Swing, Tracked, read_session, read_swings, read_tracked
from sagline.core.arrays import Array
from sagline.core.numbers import n

IDENTIFIED: Final = 0.2  # largest relative deviation of a measured frequency from one of the two models
ROWS: Final = 62  # rows of a motion for the calibration
TESTED: Final = 350  # other rows of the motion, for the test
LENGTH_DEVIATION: Final = 2.3e-3  # of the drives of cable-robot [m]
POSITION_DEVIATION: Final = 1e-3  # of motion capture [m]
CELL_DEVIATION: Final = 5.0  # [N]


def swings(folder: Path) -> Iterator[Compared]:
    """Natural frequencies of free swings, and poses at rest."""
    found = [predict_swing(each) for each in read_swings(folder)]
    deviations, moved, tilted = (np.concatenate(parts) for parts in zip(*found, strict=True))
    middle = np.median(100.0 * deviations, axis=0)
    size = np.quantile(100.0 * np.abs(deviations), 0.9, axis=0)
    what = f"{len(deviations)} modes of {len(found)} swings: frequency"
    yield Compared(f"{what}, median deviation of the model", *(n(value, "+.1f", "%") for value in middle))
    yield Compared(f"{what}, 90 % of the deviations are below", *(n(value, ".1f", "%") for value in size))
    yield Compared(
        "pose at rest from lengths, difference between the models", "", f"{np.median(moved):.1f} mm (median)"
    )
    yield Compared("tilt at rest, difference between the models", "", f"{np.median(tilted):.2f}° (median)")


def predict_swing(swing: Swing) -> tuple[Array, Array, Array]:
    """Deviations of the frequencies (K, 2), of authors and sagline; differences of positions [mm] and tilts [deg]."""
    found = sl.forward(swing.robot, swing.lengths, swing.pose)
    own = np.sort(np.ravel(sl.modes(found.state).frequency))[: swing.predicted.size]
    modes = swing.measured.size
    both = np.stack((swing.predicted[:modes], own[:modes]), axis=1) / swing.measured[:, None] - 1.0
    identified = np.abs(both).min(axis=1, initial=np.inf) < IDENTIFIED
    away = 1e3 * float(np.linalg.norm(found.pose.position - swing.pose.position))
    turn = np.degrees(np.arccos(np.clip(found.pose.matrix[2] @ swing.pose.matrix[2], -1.0, 1.0)))
    return both[identified], np.array([away]), np.array([turn])


def session(folder: Path) -> Iterator[Compared]:
    """Tilt, tensions and position from lengths, and a self-calibration."""
    given = read_session(folder)
    found = sl.forward(given.robot, given.lengths, given.first)
    tilt = found.pose.rotation.as_euler("XYZ")[:, :2] - given.tilt
    # 1 mm of length can change the tension level by more than the tensions, so that the balance predicts them
    balance = sl.inverse(given.robot, found.pose.position)
    cells = (balance.state.cables.frame_end_tension - given.load_cells)[balance.solved]
    poses = f"{len(given.lengths)} poses"
    yield Compared(f"tilt from lengths, {poses}", "", f"{np.degrees(_rms(tilt)):.2f}° (rms)")
    yield Compared(
        f"tensions from the balance at these positions, {len(cells)} poses", "", f"{_rms(cells):.1f} N (rms)"
    )
    away = np.linalg.norm(found.pose.position[0] - given.first.position)
    yield Compared("first position from lengths, distance from the authors' estimate", "", f"{1e3 * away:.1f} mm")
    log = sl.WinchLog(
        unstrained_length=given.lengths,
        load_cells=given.load_cells,
        commanded=found.pose,
        sensors=sl.Sensors(length_deviation=LENGTH_DEVIATION, tension_deviation=CELL_DEVIATION),
    )
    start = perf_counter()
    fit = sl.calibrate(given.robot, log, ["length_zero", "load_cell_gain", "load_cell_bias"], folds=0)
    duration = perf_counter() - start
    first = fit.poses.position[int(np.argmin(fit.rows))]
    yield Compared(
        f"self-calibration of {poses}: first position, distance from the authors' estimate; time",
        f"{1e3 * given.error:.1f} mm; {given.duration:.0f} s",
        f"{1e3 * np.linalg.norm(first - given.first.position):.1f} mm; {duration:.1f} s, {fit.status.name}",
    )


def tracked(folder: Path) -> Iterator[Compared]:
    """Positions of a planar robot from the lengths of its drives, after a calibration with measured positions."""
    given = read_tracked(folder)
    rows = np.linspace(0, len(given.lengths) - 1, ROWS + TESTED, dtype=int)
    used = rows[np.linspace(0, rows.size - 1, ROWS, dtype=int)]
    tested = np.setdiff1d(rows, used)
    fit, duration = calibrate_tracked(given, used)
    found = fit.forward(given.lengths[tested], sl.Pose(given.position[tested], np.eye(3)))
    error = 1e3 * np.linalg.norm(found.pose.position - given.position[tested], axis=1)
    away = given.estimated - given.position[:, [0, 2]]
    stated = 1e3 * np.linalg.norm((away - away[used].mean(axis=0))[tested], axis=1)
    yield Compared(
        f"position from lengths, {tested.size} rows that the calibration did not use",
        f"{stated.mean():.1f} mm (mean; estimate of the controller, constant offset removed)",
        f"{error.mean():.1f} mm (mean)",
    )
    yield Compared(f"calibration of {ROWS} rows", "", f"{fit.status.name}, {duration:.1f} s")


def calibrate_tracked(given: Tracked, used: Array) -> tuple[sl.Calibration, float]:
    """Calibration with some rows of a motion, and its duration [s]."""
    log = sl.WinchLog(
        unstrained_length=given.lengths[used],
        position=given.position[used],
        sensors=sl.Sensors(length_deviation=LENGTH_DEVIATION, position_deviation=POSITION_DEVIATION),
    )
    start = perf_counter()
    return sl.calibrate(given.robot, log, folds=0), perf_counter() - start


def _rms(values: Array) -> float:
    return float(np.sqrt(np.square(values).mean()))


PARTS: Final[dict[str, Callable[[Path], Iterator[Compared]]]] = {
    "cdpr_matlab": swings,
    "UACDPR_SelfCalibration": session,
    "cable-robot": tracked,
}


def main(arguments: list[str]) -> int:
    """Print one table for the clones in the folder that `arguments` names. Exit code 1 if a clone is missing."""
    if len(arguments) != 1:
        print("Usage: python -m benchmarks.measured FOLDER", file=sys.stderr)
        return 2
    folder, missing = Path(arguments[0]), False
    rows: list[Compared] = []
    for name, part in PARTS.items():
        if not (folder / name).is_dir():
            step = f"git clone {REPOSITORIES[name]} {folder / name}"
            print(f"{folder / name} is missing. Download it: {step}", file=sys.stderr)
            missing = True
            continue
        try:
            rows.extend(part(folder / name))
        except sl.SaglineError as error:
            print(f"{name}: {error}", file=sys.stderr)
            missing = True
    if rows:
        show("Published measurements of real robots", rows, Console())
    return int(missing)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
