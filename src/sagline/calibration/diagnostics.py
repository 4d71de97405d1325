"""Diagnostics of a log before a calibration: units, columns, signs, times, zeros, and axes of measured positions."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from itertools import combinations
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.calibration.hypotheses import CELL_UNITS, LENGTH_UNITS, TILTS, Hypothesis, Trial
from sagline.calibration.log import WinchLog, load_cells_of, measures_yaw
from sagline.calibration.screening import screen
from sagline.core.arguments import instance
from sagline.core.arrays import Array, Flags, Indices
from sagline.core.numbers import n
from sagline.robot.robot import Robot

_CATENARY = Catenary()
UNIT: Final = 50.0  # a reading that exceeds its expected value by this factor has a wrong unit, such as mm for m
GOOD: Final = 5.0  # largest sum of squares per reading of a good fit; it exceeds 1 because of slips and rope errors
POOR: Final = 50.0  # used as GOOD for a corrected mistake that reduces the sum of squares to at most a hundredth
# A fit is accepted only if the mean square of (value - prior) / prior deviation is smaller. A fit with swapped cables
# may otherwise agree with the readings by chance, with anchors that are wrong by 0.25 m.
NEAR: Final = 0.25
STRANGE: Final = 6.0  # prior deviations: largest departure of a fitted value that does not suggest a mistake in the log
# Lengths or positions are informative only if the robot is larger than this multiple of their standard deviation.
ROUGH: Final = 10.0
FAR: Final = 0.25  # smallest error of a length zero, relative to the length, that is reported as a mistake
SHIFTS: Final = 5  # largest tested time shift between load cells and lengths, in rows
_FULLY: Final = 3  # number of the most promising changes that are fitted until convergence


def diagnose_log(robot: Robot, log: WinchLog, model: CableModel | str = _CATENARY) -> tuple[str, ...]:
    """Likely mistakes in a log, as sentences with the next step; empty for a consistent log."""
    # A comparison of the readings with their expected sizes detects lengths and positions in mm, and load cells in kN.
    # Then a robot similar to the given robot is fitted to about 24 rows. If no similar robot fits, the function tests
    # corrections of single mistakes. These mistakes are exchanged columns of two cables (encoders, load cells or both),
    # an encoder that counts backward, zeros with large errors, load cells or lengths up to five rows early or late,
    # wrong units (kgf, lbf, ft, in), and roll and pitch of an inclinometer with wrong signs or exchanged. The first
    # correction with a good fit is reported as the mistake. Zeros with large errors, lengths with the wrong sign, and
    # lengths that are early or late, are found only with commanded poses.
    instance(robot, Robot, "robot")
    instance(log, WinchLog, "log")
    model = model_of(model)
    if found := tuple(wrong_units(robot, log)):
        return found  # other mistakes can be found only after the units are right
    _, rows, _ = screen(robot, log)
    trial = Trial(robot, model, log, rows)
    if not len(rows) or (log.load_cells is None and log.position is None):
        return tuple(_wrong_tilt(trial)) if len(rows) else ()
    return tuple(_single_mistake(trial))


def wrong_units(robot: Robot, log: WinchLog) -> Iterator[str]:
    """Sentences about readings that seem to have a wrong unit, because their size in all rows is unusual."""
    frame, platform = (float(np.linalg.norm(np.ptp(p, axis=0))) for p in (robot.frame_anchors, robot.platform_anchors))
    size = frame + platform + (0.0 if robot.winches is None else float(robot.winches.dead_cable.max()))
    across, step = f"and the robot is {size:.3g} m across", "divide them by 1000, or write their unit"
    if log.unstrained_length is not None and log.unstrained_length.size:
        typical = float(np.nanmedian(log.unstrained_length)) if not np.isnan(log.unstrained_length).all() else 0.0
        if typical > UNIT * size:
            yield f"lengths seem to be in mm: about {typical:.4g} m, {across}; {step}, length_0 [mm]"
    if log.position is not None and (far := _spread(log.position)) > UNIT * size:
        yield f"positions seem to be in mm: they differ by {far:.4g} m, {across}; {step}, x [mm]"
    if log.commanded is not None and (far := _spread(log.commanded.position)) > UNIT * size:
        yield f"commanded positions seem to be in mm: they differ by {far:.4g} m, {across}; {step}, x_commanded [mm]"
    for name in ("length_deviation", "position_deviation"):
        deviation = getattr(log.sensors, name)
        if deviation is not None and (worst := float(np.max(deviation))) * ROUGH > size:
            yield f"the {name} seems to be in mm: it is {worst:.3g} m, {across}; write its unit, {name}: 0.5 mm"
    if log.load_cells is None or np.isnan(log.load_cells).all():
        return
    gain, bias = load_cells_of(robot)
    typical = float(np.nanmedian(np.nanmax(np.abs((log.load_cells - bias) / gain), axis=1, initial=0.0)))
    share = robot.mass * robot.gravity / robot.cable_count
    if typical * UNIT < share:
        yield (
            f"load cells seem to be in kN: the largest reading of a row is about {typical:.3g} N, and a cable's share "
            f"of the weight is {share:.3g} N; multiply them by 1000, or write their unit, load_cell_0 [kN]"
        )
    elif typical > UNIT * max(share, float(np.median(robot.cables.axial_stiffness)) / UNIT):
        yield (
            f"load cells seem to be in mN: they read about {typical:.3g} N, too much for {robot.name}; divide them "
            "by 1000, or write their unit, load_cell_0 [mN]"
        )


def fits_without_measured_poses(robot: Robot, log: WinchLog, model: CableModel) -> bool:
    """True if a robot similar to `robot` fits the lengths and load cells, when the measured poses are ignored."""
    if log.load_cells is None or (log.position is None and log.rotation is None):
        return False
    own = log.replace(position=None, rotation=None)
    return Trial(robot, model, own, np.arange(len(log))).result(Hypothesis())[0] <= GOOD


def measured_pose_mistakes(
    robot: Robot, log: WinchLog, left_out: Indices, asked: Collection[str], model: CableModel
) -> Iterator[str]:
    """Sentence about measured poses (rows `left_out`) that disagree with the lengths while all other readings fit."""
    if found := list(_wrong_tilt(Trial(robot, model, log, np.arange(len(log))))):
        yield from found
        return
    points = np.zeros((0, 3)), np.zeros((0, 3))
    if log.position is not None:
        placed = np.flatnonzero(~np.isnan(log.position).any(axis=1))
        points = Trial(robot, model, log, placed).measured_points() if placed.size else points
    sentence = _left_handed(*points) or _frame_mismatch(log, left_out, asked, points)
    if sentence is not None:
        yield sentence


def _spread(position: Array) -> float:
    """Largest difference between measured positions along an axis [m]."""
    there = ~np.isnan(position).all(axis=0)
    if not there.any():
        return 0.0
    low, high = np.nanmin(position[:, there], axis=0), np.nanmax(position[:, there], axis=0)
    return float(np.max(high - low))


def _single_mistake(trial: Trial) -> Iterator[str]:
    """Sentence about a single mistake that explains the misfit of the log; no sentence if no mistake explains it."""
    before, departure, zeros = trial.result(Hypothesis())
    far = _far(trial, zeros)
    if before <= GOOD:
        if far.any():
            yield _zero_text(zeros, far)
        elif departure > NEAR:
            yield from _other_unit(trial, departure)
        return
    if found := list(_wrong_tilt(trial)):
        yield from found
        return
    enough = max(GOOD, min(POOR, 0.01 * before))
    for changes, steps in ((_length_changes(trial), 0), (_load_cell_changes(trial), 1)):
        for change in trial.most_promising(changes, steps, _FULLY):
            after, departure, zeros = trial.result(change)
            if after > enough or departure > NEAR:
                continue
            if change.moved:
                yield _zero_text(zeros, _far(trial, zeros))
            else:
                text = _change_text(change, trial.log)
                yield f"{text} (misfit {_misfit_text(before)}, then {_misfit_text(after)})"
            return


def _wrong_tilt(trial: Trial) -> Iterator[str]:
    """Sentence about roll and pitch of an inclinometer, if one correction predicts a clearly smaller misfit."""
    if trial.log.rotation is None or measures_yaw(trial.log.sensors):
        return
    promises = {tilt: trial.promise(Hypothesis(tilt=tilt), 0) for tilt in TILTS}
    best, second = sorted(promises, key=promises.__getitem__)[:2]
    if best and promises[best] < CLEARLY * promises[second]:
        before, after = (_misfit_text(0.5 * promises[tilt]) for tilt in ("", best))
        what = "the measured inclinations disagree with the lengths"
        yield f"{what}: {best} (misfit after one step {before}, then {after})"


def _other_unit(trial: Trial, departure: float) -> Iterator[str]:
    """Sentence about a wrong unit of the load cells, if another unit brings the fitted values nearer to the priors."""
    for unit in CELL_UNITS:
        quality, nearer, _ = trial.result(Hypothesis(cell_unit=unit))
        if unit and quality <= GOOD and nearer < min(NEAR, 0.5 * departure):
            yield _change_text(Hypothesis(cell_unit=unit), trial.log)
            return


def _length_changes(trial: Trial) -> Iterator[Hypothesis]:
    """Possible mistakes in lengths or counts, such as two swapped cables with or without swapped load cells."""
    m = trial.robot.cable_count
    if trial.log.counts is None:
        yield from (Hypothesis(length_unit=unit) for unit in LENGTH_UNITS if unit)
    for two in combinations(range(m), 2):
        yield Hypothesis(lengths=two)
        if trial.log.load_cells is not None:
            yield Hypothesis(lengths=two, cells=two)
    for cable in range(m):
        if trial.log.counts is not None or trial.log.commanded is not None:
            yield Hypothesis(flipped=cable)
    if trial.log.commanded is not None:
        off, scatter = trial.offsets()
        far = (np.abs(off) > FAR * _usual(trial)) & (scatter < 0.5 * np.abs(off))
        if far.any():
            yield Hypothesis(moved=tuple(np.flatnonzero(far).tolist()))


def _load_cell_changes(trial: Trial) -> Iterator[Hypothesis]:
    """Possible mistakes in the load cells, and lengths that are late or early."""
    if trial.log.load_cells is None:
        return
    yield from (Hypothesis(cell_unit=unit) for unit in CELL_UNITS if unit)
    for two in combinations(range(trial.robot.cable_count), 2):
        yield Hypothesis(cells=two)
    for late in range(1, SHIFTS + 1):
        if len(trial.log) > 2 * late:
            yield from (Hypothesis(late=late), Hypothesis(late=-late))
            if trial.log.commanded is not None:
                yield from (Hypothesis(behind=late), Hypothesis(behind=-late))


def _usual(trial: Trial) -> Array:
    """Typical lengths (m,) of the cables [m]: distances of the frame anchors from the center of the poses."""
    commanded = trial.log.commanded
    middle = trial.robot.frame_anchors.mean(axis=0) if commanded is None else np.median(commanded.position, axis=0)
    return np.asarray(np.linalg.norm(trial.robot.frame_anchors - middle, axis=1))


def _far(trial: Trial, zeros: Array) -> Flags:
    return np.asarray(np.abs(zeros) > FAR * _usual(trial))


def _zero_text(zeros: Array, far: Flags) -> str:
    """Text that lists the cables with a large error of the length zero."""
    cables = np.flatnonzero(far).tolist()
    listed = ", ".join(
        f"{abs(zeros[i]):.2f} m too {'short' if zeros[i] > 0.0 else 'long'} on cable {i}" for i in cables
    )
    return f"the zeros of lengths are far off: {listed}; correct length_zero of these winches, or home the robot again"


def _change_text(change: Hypothesis, log: WinchLog) -> str:
    kind = "count" if log.counts is not None else "length"
    for unit, factor, what, column in (
        (change.cell_unit, CELL_UNITS[change.cell_unit], "load cells", "load_cell_0"),
        (change.length_unit, LENGTH_UNITS[change.length_unit], "lengths", "length_0"),
    ):
        if unit:
            text = f"{what} seem to have the unit {unit}: multiply them by {factor:.6g}"
            return f"{text}, or write their unit, {column} [{unit}]"
    if change.lengths is not None:
        i, j = change.lengths
        what, columns = ("encoders of ", f"{kind}_{i} and {kind}_{j}")
        if change.cells is not None:
            what, columns = "", f"{columns}, load_cell_{i} and load_cell_{j}"
        return f"the {what}cables {i} and {j} seem to be swapped: exchange columns {columns}"
    if change.cells is not None:
        i, j = change.cells
        return f"the load cells of cables {i} and {j} seem to be swapped: exchange columns load_cell_{i} and _{j}"
    if change.flipped is not None:
        i = change.flipped
        return f"the encoder of cable {i} seems to count backward: change the sign of gear[{i}], or of {kind}_{i}"
    shift = change.late or change.behind
    rows = f"{abs(shift)} row{'s'[: abs(shift) != 1]}"
    way, where = ("late", "up") if shift > 0 else ("early", "down")
    what, columns = ("load cell readings", "load cells") if change.late else (f"{kind}s", f"{kind}s")
    return f"the {what} seem to be {rows} {way}: move the columns of all {columns} {where} by {rows}"


def _misfit_text(quality: float) -> str:
    """Text of the misfit in standard deviations, which is the square root of `quality`."""
    return f"{np.sqrt(quality):.3g} standard deviations" if np.isfinite(quality) else "without bound"


FEWEST: Final = 4  # smallest number of measured points that can show a reflection
CLEARLY: Final = 0.2  # a motion explains the distances between points if it reduces them to less than this share
FLAT: Final = 0.05  # points are coplanar if their extent along an axis is below this share of the largest extent


def _aligned(there: Array, measured: Array, *, reflected: bool) -> tuple[Array, float]:
    """Rotation (3, 3) that aligns `measured` (N, 3) with `there`, and the root mean square distance [m]."""
    sign = -1.0 if reflected else 1.0  # a reflection is a rotation of the points on the other side of their mean
    rotation, distance = Rotation.align_vectors(there - there.mean(axis=0), sign * (measured - measured.mean(axis=0)))
    return sign * rotation.as_matrix(), float(distance) / len(there) ** 0.5


def _left_handed(there: Array, measured: Array) -> str | None:
    """Sentence about left-handed axes, if only a reflection maps `measured` (N, 3) to the expected points `there`."""
    if len(there) < FEWEST or (extent := _extents(there))[2] < FLAT * extent[0]:
        return None
    (_, plain), (matrix, mirrored) = (_aligned(there, measured, reflected=reflected) for reflected in (False, True))
    if mirrored > CLEARLY * plain:
        return None
    signs = np.diag(matrix)
    axes = [axis for axis, sign in zip("xyz", signs, strict=True) if sign < 0.0]
    which = f"column {axes[0]}" if len(axes) == 1 and np.abs(signs).min() > 0.9 else "one column, or exchange two"
    return (
        f"the axes of the measured positions seem to be left-handed: they agree "
        f"within {n(mirrored, '.2g', 'm')} with a reflection, within {n(plain, '.2g', 'm')} without; change "
        f"the sign of {which}"
    )


def _other_axes(there: Array, measured: Array) -> str | None:
    """Text about a rigid motion that maps `measured` (N, 3) to the expected points `there`; None if none fits."""
    if len(there) < 3 or _extents(there)[1] < FLAT * _extents(there)[0]:
        return None
    before = float(np.sqrt(np.mean(np.sum((there - measured) ** 2, axis=1))))
    matrix, after = _aligned(there, measured, reflected=False)
    if after > CLEARLY * before:
        return None
    turn = n(np.degrees(Rotation.from_matrix(matrix).magnitude()), ".2g", "°")
    return f"by {n(before, '.2g', 'm')}, but only by {n(after, '.2g', 'm')} in axes that are turned by {turn}"


def _extents(points: Array) -> Array:
    """Extents of points (N, 3) along their principal axes [m], decreasing."""
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), compute_uv=False))


def _frame_mismatch(
    log: WinchLog, left_out: Indices, asked: Collection[str], points: tuple[Array, Array]
) -> str | None:
    """Sentence about measured poses (rows `left_out`) that disagree with the lengths while all other readings fit."""
    # points: expected and measured positions, each (N, 3) [m].
    measured = np.zeros(len(log), dtype=np.bool_)
    for read in (log.position, log.rotation):
        if read is not None:
            measured |= ~np.isnan(read).all(axis=1)
    lost, count = int(np.count_nonzero(measured[left_out])), int(np.count_nonzero(measured))
    if 2 * lost <= count:
        return None
    if log.position is None and not measures_yaw(log.sensors):
        what = f"{lost} of {count} measured inclinations disagree with the lengths"
        return f"{what}; check the signs and the order of beta (pitch) and gamma (roll), or leave them out"
    what = f"{lost} of {count} measured poses disagree with the lengths"
    unknowns = [name for name in ("measuring_frame", "target") if name not in asked and (log.position is not None)]
    more = " and ".join(unknowns or ["measuring_frame"] * ("measuring_frame" not in asked))
    step = f"{f'add the unknowns {more}' if more else 'correct them'}, or write '# frame: ...' above the columns"
    evidence = _other_axes(*points)
    if evidence is not None:
        return f"{what} {evidence}; {step}"
    return f"{what}, the cause is not known; {step}, or leave the measured poses out"
