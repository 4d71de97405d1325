"""Calibration of a robot from its own readings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, Straight, model_of
from sagline.calibration import diagnostics
from sagline.calibration.evaluation import calibration_of
from sagline.calibration.findings import Omission
from sagline.calibration.least_squares import misfit
from sagline.calibration.log import READINGS, Sensors, WinchLog
from sagline.calibration.observations import Readings
from sagline.calibration.parameters import (
    DEFAULT,
    OF_CELLS,
    OF_FORCES,
    Parameters,
    Unknown,
    checked_unknowns,
    parameters_of,
)
from sagline.calibration.problem import (
    FitProblem,
    SearchState,
    held_lengths,
    start_of,
    with_swivel_zeros,
)
from sagline.calibration.result import Calibration
from sagline.calibration.screening import SPEED_LIMIT, moving_rows, reading_count, screen
from sagline.calibration.search import cross_validate, search_from_priors
from sagline.calibration.straight import rotation_error
from sagline.core.arguments import callback, flag, instance, whole_number
from sagline.core.arrays import Flags, Indices, Progress, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted, n
from sagline.kernels import codes
from sagline.robot.batch import refuse_slanted
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows

_CATENARY = Catenary()
# [rad] Straight cables: rotations that no reading determines to this accuracy are assumed to be as commanded, or level,
# with this standard deviation. Cables of a suspended or planar platform hold it level to about a degree.
LEVEL: Final = 0.02
FEW_KEPT: Final = 0.5  # if the screening keeps a smaller share of the rows, the cause is searched
MOST_FOLDS: Final = 1000  # largest number of parts in a cross-validation; each part needs one calibration


def calibrate(
    robot: Robot,
    log: WinchLog,
    unknowns: Sequence[str | Unknown] | None = None,
    *,
    model: CableModel | str = _CATENARY,
    robust: bool = True,
    folds: int = 5,
    progress: Progress | None = None,
) -> Calibration:
    """Estimate anchors, length zeros and cable properties of a robot from its own readings, with standard errors.

    The estimate is a nonlinear least-squares problem with exact cables. The variables of the problem are the parameters
    and the true lengths at every pose. Reported lengths are weighted by the deviation in `log.sensors`. A parameter on
    which no reading depends keeps the value of `robot`, and is listed in the result.

    Args:
        robot: The robot before the calibration, whose values are the initial values and the priors. The standard
            deviation of a prior is `Unknown(name, deviation=...)` if given, else the robot's tolerance, else a typical
            value.
        log: Readings at poses at rest.
        unknowns: Parameters to estimate: names of `KINDS` in `sagline.calibration.parameters`, or `Unknown`s. "default"
            means frame anchors, length zeros, axial stiffness, mass and center of mass and, if they are read, gains and
            biases of load cells, zeros of swivel angles, and the inertia for natural frequencies; for straight cables,
            frame anchors and length zeros. In logs with measured positions and lengths, but without counts and load
            cells, it also means one scale of the lengths. Unknowns that are named too replace those of "default". None
            is the same as "default" alone. With "clock_offset", the time by which
            lengths are late, moving rows with a measured pose are also used, without their load cells.
        model: Cable model, exact, without weight, or straight. With straight cables, poses are fitted to the lengths
            and to measured poses without a force balance. Load cells are not used, and rows in motion are used.
        robust: True to reduce the weight of poses that do not fit the other poses.
        folds: Number of parts into which a cross-validation divides the poses, at most the number of poses; one more
            calibration is needed per part. 0 for no cross-validation.
        progress: Called with the number of finished poses of a pass and the number of all poses.

    Returns:
        Calibration; its `robot` is the calibrated robot.

    Raises:
        InvalidValueError: If an unknown does not exist, or has neither readings nor a prior; if `log` does not fit this
            robot, has swapped cables or wrong units, or has fewer readings than unknowns.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> drawn = sl.load_robot("article-suspended")
        >>> true = drawn.replace(mass=1.02 * drawn.mass)
        >>> places = np.random.default_rng(0).uniform(-0.5, 0.5, (5, 3)) + [0, 0, 2]
        >>> plan = sl.inverse(true, sl.Pose(places, np.eye(3)))
        >>> log = sl.WinchLog(
        ...     unstrained_length=plan.unstrained_length,
        ...     load_cells=plan.state.cables.frame_end_tension,
        ...     sensors=sl.Sensors(tension_deviation=5.0),
        ... )
        >>> found = sl.calibrate(drawn, log, ["mass"])
        >>> print(f"{found.robot.mass / drawn.mass:.3f}")
        1.020

    Source:
        docs/model.md, section 14.
    """
    instance(robot, Robot, "robot")
    instance(log, WinchLog, "log")
    model = model_of(model)
    _check_model(robot, log, model)
    _check_frequencies(robot, log)
    callback(progress, "progress")
    robust = flag(robust, "robust")
    if (folds := whole_number(folds, "folds", 0, MOST_FOLDS)) == 1:
        raise InvalidValueError("folds", "1", "0 for none, or >= 2", "Give 5, say.")
    wanted = (DEFAULT,) if unknowns is None else unknowns
    straight = model.code == codes.STRAIGHT
    counted_log = log.counts is not None
    # before any other work
    named = [one.name for one in checked_unknowns(wanted, log.sensors, counted=counted_log, straight=straight)]
    timed = "clock_offset" in named
    _refuse(diagnostics.wrong_units(robot, log))
    usable, motion = moving_rows(robot, log) if timed or straight else (None, None)
    limit, free = (SPEED_LIMIT, usable) if timed or not straight else (np.inf, None)
    fit_log, rows, left_out = screen(robot, log, limit, free)
    if timed and usable is not None:
        fit_log = _without_inertia(fit_log, usable[rows])
    if straight:
        log, fit_log = (one.replace(load_cells=None, swivel=None, frequency=None) for one in (log, fit_log))
    if straight and fit_log.rotation is None:
        log, fit_log = _with_assumed_rotations(robot, model, log, fit_log, wanted)
    sensors = _active_sensors(fit_log)
    asked = _with_relative_lengths(log, checked_unknowns(wanted, sensors, counted=counted_log, straight=straight))
    parameters = parameters_of(robot, asked, sensors, counted=counted_log)
    more = fit_log.readings.size - len(fit_log) * len(robot.freedom) if straight else 0
    _check_count(fit_log, parameters, left_out, more, freely=DEFAULT not in wanted)
    moved = None if motion is None or not motion.any() else motion[:, rows]
    table = Readings.of(fit_log)._replace(motion=moved)
    problem, geometric = FitProblem(robot, model, sensors, parameters, table), None
    if not straight and fit_log.load_cells is None and fit_log.position is not None:
        geometric = _geometric_start(problem, log, rows, asked)
    try:
        fit, kept, lost = search_from_priors(problem, fit_log.commanded, geometric, robust=robust, progress=progress)
    except InvalidValueError:
        _refuse_mistakes(robot, log, fit_log, parameters, model)
        raise
    departure = float(np.abs(problem.parameters.missed(fit.state.numbers)).max())
    few = len(fit_log) < FEW_KEPT * len(log)
    if few or not fit.converged or misfit(fit.normal) > diagnostics.GOOD or departure > diagnostics.STRANGE:
        _refuse_mistakes(robot, log, fit_log, parameters, model)
    elif Omission.OTHER_EQUILIBRIUM in lost:
        elsewhere = lost[Omission.OTHER_EQUILIBRIUM]
        _refuse(diagnostics.measured_pose_mistakes(robot, fit_log, elsewhere, parameters.names, model))
    validation = cross_validate(problem, fit, kept, folds, robust=robust, progress=progress) if folds else None
    omitted = {**left_out, **{reason: locked(rows[which]) for reason, which in lost.items()}}
    return calibration_of(problem, asked, fit, kept, rows, omitted, log.source, validation)


def _without_inertia(log: WinchLog, moving: Flags) -> WinchLog:
    """Log without the load cells of moving rows, which also read inertia forces; rejects a log without such rows."""
    step = "Log the times and the measured positions of slow motions, or leave clock_offset out."
    if log.time is None:
        raise InvalidValueError("log: time", "not given", "times for clock_offset", step)
    if not moving.any():
        value, allowed = "without a moving row that has a measured pose", "at least one for clock_offset"
        raise InvalidValueError("log", value, allowed, step)
    return log if log.load_cells is None else log.replace(load_cells=np.where(moving[:, None], np.nan, log.load_cells))


def _active_sensors(log: WinchLog) -> Sensors:
    """Sensors with at least one reading in a log."""
    readings = ((deviation, getattr(log, name)) for name, deviation in READINGS.items())
    return log.sensors.replace(**{name: None for name, read in readings if read is None or np.isnan(read).all()})


def _check_model(robot: Robot, log: WinchLog, model: CableModel) -> None:
    if log.swivel is not None or model.code == codes.STRAIGHT:
        refuse_slanted(robot, only_platform=True)
    if model.code not in (codes.CATENARY, codes.ELASTIC, codes.STRAIGHT):
        step = "Use Catenary(), or Straight() for a fit of the geometry alone."
        raise InvalidValueError("model", type(model).__name__, "Catenary(), Elastic() or Straight()", step)
    if robot.winches is not None and robot.winches.guides is not None:
        step = "Give dead_cable, the whole guided length, instead of guides."
        raise InvalidValueError("winches: guides", "given", "None for calibrate", step)


def _check_frequencies(robot: Robot, log: WinchLog) -> None:
    """Reject more natural frequencies than degrees of freedom."""
    n_modes = 0 if log.frequency is None else log.frequency.shape[1]
    if n_modes > robot.degrees_of_freedom:
        step = "Leave frequencies of cables out; only those of the platform on massless cables are predicted."
        allowed = f"at most {robot.degrees_of_freedom}, one per degree of freedom"
        raise InvalidValueError("log: frequency", counted(n_modes, "column"), allowed, step)


def _geometric_start(
    problem: FitProblem, log: WinchLog, rows: Indices, unknowns: Sequence[Unknown]
) -> SearchState | None:
    """Initial state from a calibration with straight cables, for a log without load cells; None if it fails."""
    # Without load cells, noise of the lengths makes cables slack at the reported lengths, and the search would end at
    # one of several minima.
    asked = [one for one in unknowns if one.name not in (*OF_FORCES, "swivel_zero", "inertia")]
    try:
        found = calibrate(problem.robot, log, asked, model=Straight(), folds=0)
        at = dict(zip(found.parameters.labels, found.parameters.internal(found.values), strict=True))
        numbers = np.array([at.get(*pair) for pair in zip(problem.parameters.labels, problem.prior, strict=True)])
        machine = problem.machine_at(numbers)
    except InvalidValueError:
        return None
    if not np.isin(rows, found.rows).all():
        return None
    poses = pose_rows(found.poses)[np.searchsorted(found.rows, rows)]
    numbers = with_swivel_zeros(problem, numbers, poses)
    machine = problem.machine_at(numbers)
    reported = problem.reported_lengths(machine)
    return SearchState(numbers, machine, held_lengths(problem, machine, poses, reported, balanced=True), poses.copy())


def _with_assumed_rotations(
    robot: Robot, model: CableModel, log: WinchLog, fit_log: WinchLog, unknowns: Sequence[str | Unknown]
) -> tuple[WinchLog, WinchLog]:
    """The logs, with rotations as commanded, or level, if neither lengths nor positions determine the rotations."""
    counted_log = log.counts is not None
    asked = checked_unknowns(unknowns, log.sensors, counted=counted_log, straight=True)
    parameters = parameters_of(robot, _with_relative_lengths(log, asked), log.sensors, counted=counted_log)
    problem = FitProblem(robot, model, log.sensors, parameters, Readings.of(fit_log))
    state = start_of(problem, fit_log.commanded)
    readings = problem.readings(problem.reported_lengths(state.machine), slice(None))
    if "measuring_frame" in parameters.names or rotation_error(state.machine, readings, state.poses) < LEVEL:
        return log, fit_log
    return _with_rotations(log), _with_rotations(fit_log)


def _with_rotations(log: WinchLog) -> WinchLog:
    """The log with the rotations of the commanded poses, or level ones, in place of measured rotations."""
    turned = log.sensors.frame.rotation.inv()
    if log.commanded is not None:
        turned = turned * log.commanded.rotation
    deviation = LEVEL if log.sensors.rotation_deviation is None else log.sensors.rotation_deviation
    sensors = log.sensors.replace(rotation_deviation=deviation)
    source = f"{log.source} (rotations assumed within {n(LEVEL, '.2g', 'rad')})".strip()
    return log.replace(rotation=np.broadcast_to(turned.as_quat(), (len(log), 4)), sensors=sensors, source=source)


def _with_relative_lengths(log: WinchLog, unknowns: list[Unknown]) -> list[Unknown]:
    """The unknowns; length zeros without a stated prior have no prior if a length of the log is zero or negative."""
    if log.unstrained_length is None or not (log.unstrained_length <= 0.0).any():
        return unknowns
    if "length_zero" not in (one.name for one in unknowns):
        row, cable = (int(k) for k in np.argwhere(log.unstrained_length <= 0.0)[0])
        value = f"{log.unstrained_length[row, cable]:.6g} m, relative to an unknown zero"
        step = "Add length_zero to the unknowns, or give the whole lengths."
        raise InvalidValueError(f"log: length[{row}, {cable}]", value, "> 0 m, or the unknown length_zero", step)
    if log.commanded is None and log.position is None:
        step = "Add commanded poses x_commanded, ..., or measured positions x, y, z."
        raise InvalidValueError("log", "relative lengths alone", "commanded or measured positions beside them", step)
    return [replace(one, deviation=one.deviation or np.inf) if one.name == "length_zero" else one for one in unknowns]


def _refuse_mistakes(robot: Robot, log: WinchLog, fit_log: WinchLog, parameters: Parameters, model: CableModel) -> None:
    """Reject a log with a likely mistake, and measured poses that disagree with all other readings."""
    if not {"measuring_frame", "target"}.isdisjoint(parameters.names):
        log = log.replace(position=None, rotation=None)  # the axes of the measuring system are not known yet
    _refuse(diagnostics.diagnose_log(robot, log, model))
    if diagnostics.fits_without_measured_poses(robot, fit_log, model):
        _refuse(diagnostics.measured_pose_mistakes(robot, fit_log, np.arange(len(fit_log)), parameters.names, model))


def _refuse(sentences: Iterable[str]) -> None:
    """Raise an error about a mistake in a log, with the first of `sentences`; without sentences, do nothing."""
    for sentence in sentences:
        what, _, step = sentence.partition("; " if "; " in sentence else ": ")
        step = f"{step[:1].upper()}{step[1:]}."
        value, allowed = f"inconsistent with this robot: {what}", "readings that fit this robot, or a similar one"
        raise InvalidValueError("log", value, allowed, step)


def _check_count(
    log: WinchLog, parameters: Parameters, left_out: Mapping[Omission, Indices], more: int, *, freely: bool
) -> None:
    """Reject a log with fewer readings than unknowns; gains and biases of load cells count only with `freely`."""
    # more: number of lengths minus number of motions of the poses, for straight cables.
    wanted = len([name for name in parameters.names if freely or name not in OF_CELLS])
    readings = reading_count(log) + more
    if readings >= wanted:
        return
    gone = "".join(f"; {counted(len(rows), 'row')} left out: {reason.text}" for reason, rows in left_out.items())
    shown = f"{counted(readings, 'reading')} in {counted(len(log), 'row')}{gone}"
    allowed = f">= {wanted}, one per unknown"
    step = "Log more poses with load cells or measured positions, or estimate fewer unknowns."
    raise InvalidValueError("log", shown, allowed, step)
