"""Calibration of a robot from its own readings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.calibration import diagnostics
from sagline.calibration.evaluation import calibration_of
from sagline.calibration.findings import Omission
from sagline.calibration.least_squares import misfit
from sagline.calibration.log import Sensors, WinchLog
from sagline.calibration.parameters import (
    OF_CELLS,
    Parameters,
    Unknown,
    checked_unknowns,
    default_unknowns,
    parameters_of,
)
from sagline.calibration.problem import FitProblem, readings_table
from sagline.calibration.result import Calibration
from sagline.calibration.screening import reading_count, screen
from sagline.calibration.search import cross_validate, search_from_priors
from sagline.core.arguments import callback, flag, instance, whole_number
from sagline.core.arrays import Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted
from sagline.core.progress import Progress
from sagline.kernels import codes
from sagline.robot.robot import Robot

_CATENARY = Catenary()
MOST_FOLDS: Final = 1000  # parts of the cross-validation; each part takes the time of one calibration


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

    The estimate is a nonlinear least-squares problem with exact cables. Its variables are the parameters and the true
    lengths at every pose. Reported lengths are weighted by the deviation in `log.sensors`. Parameters that the readings
    do not observe keep the values of the robot, and are listed.

    Args:
        robot: The robot before the calibration. Its values are the initial values and the priors. The standard
            deviation of a prior is the first available value of these: `Unknown(name, deviation=...)`, the robot's
            tolerance, a typical value of the kind.
        log: Readings at poses at rest.
        unknowns: Parameters to estimate: names of `KINDS` in `sagline.calibration.parameters`, or `Unknown`s. None for
            frame anchors, length zeros, axial stiffness, mass and center of mass; and, if load cells are read, their
            gains and biases.
        model: Cable model, exact or without weight.
        robust: True to reduce the weight of poses that do not fit the other poses.
        folds: Number of parts of the poses for the cross-validation, at most one per pose; each part takes the time of
            one calibration. 0 for no cross-validation.
        progress: Called with the number of finished poses of a pass and the number of all poses.

    Returns:
        Calibration; its `robot` is the calibrated robot.

    Raises:
        InvalidValueError: If an unknown has another name, or neither readings nor a prior; if the log does not fit this
            robot, has swapped cables or wrong units, or has fewer readings than unknowns. The message names the reason.

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
    _check_model(robot, model)
    callback(progress, "progress")
    robust = flag(robust, "robust")
    if (folds := whole_number(folds, "folds", 0, MOST_FOLDS)) == 1:
        raise InvalidValueError("folds", "1", "0 for none, or >= 2", "Give 5, say.")
    checked = None if unknowns is None else checked_unknowns(unknowns)  # before any other work
    _refuse(diagnostics.wrong_units(robot, log))
    fit_log, rows, left_out = screen(robot, log)
    sensors = active_sensors(fit_log)
    asked = checked_unknowns(default_unknowns(sensors)) if checked is None else checked
    parameters = parameters_of(robot, asked, sensors, counted=log.counts is not None)
    _check_count(fit_log, parameters, left_out, freely=checked is not None)
    problem = FitProblem(robot, model, sensors, parameters, readings_table(fit_log))
    try:
        fit, kept, lost = search_from_priors(problem, fit_log.commanded, robust=robust, progress=progress)
    except InvalidValueError:
        _refuse_mistakes(robot, log, fit_log, parameters, model)
        raise
    departure = float(np.abs(problem.missed(fit.state.numbers)).max())
    if not fit.converged or misfit(fit.normal) > diagnostics.GOOD or departure > diagnostics.STRANGE:
        _refuse_mistakes(robot, log, fit_log, parameters, model)
    elif Omission.OTHER_EQUILIBRIUM in lost:
        elsewhere = lost[Omission.OTHER_EQUILIBRIUM]
        _refuse(diagnostics.measured_pose_mistakes(robot, fit_log, elsewhere, parameters.names, model))
    validation = cross_validate(problem, fit, kept, folds, robust=robust, progress=progress) if folds else None
    omitted = {**left_out, **{reason: locked(rows[which]) for reason, which in lost.items()}}
    return calibration_of(problem, asked, fit, kept, rows, omitted, log.source, validation)


def active_sensors(log: WinchLog) -> Sensors:
    """Sensors with at least one reading in a log."""
    silent = {
        name: None
        for name, read in (
            ("tension_deviation", log.load_cells),
            ("position_deviation", log.position),
            ("rotation_deviation", log.rotation),
        )
        if read is None or np.isnan(read).all()
    }
    return log.sensors.replace(**silent)


def _check_model(robot: Robot, model: CableModel) -> None:
    if model.code not in (codes.CATENARY, codes.ELASTIC):
        step = "Use Catenary()."
        raise InvalidValueError("model", type(model).__name__, "Catenary() or Elastic(), which are exact", step)
    if robot.winches is not None and robot.winches.guides is not None:
        step = "Give dead_cable, the whole guided length, instead of guides."
        raise InvalidValueError("winches: guides", "given", "None for calibrate", step)


def _refuse_mistakes(robot: Robot, log: WinchLog, fit_log: WinchLog, parameters: Parameters, model: CableModel) -> None:
    """Reject a log with a likely mistake. Reject measured poses that do not fit, if all other readings fit."""
    if not {"measuring_frame", "target"}.isdisjoint(parameters.names):
        log = log.replace(position=None, rotation=None)  # the axes of the measuring system are not known yet
    _refuse(diagnostics.diagnose_log(robot, log, model))
    if diagnostics.fits_without_measured_poses(robot, fit_log, model):
        _refuse(diagnostics.measured_pose_mistakes(robot, fit_log, np.arange(len(fit_log)), parameters.names, model))


def _refuse(sentences: Iterable[str]) -> None:
    """Reject a log if there is a sentence about a mistake; the message is the first sentence."""
    for sentence in sentences:
        what, _, step = sentence.partition("; " if "; " in sentence else ": ")
        step = f"{step[:1].upper()}{step[1:]}."
        value, allowed = f"inconsistent with this robot: {what}", "readings that fit this robot, or a similar one"
        raise InvalidValueError("log", value, allowed, step)


def _check_count(log: WinchLog, parameters: Parameters, left_out: Mapping[Omission, Indices], *, freely: bool) -> None:
    """Reject a log with fewer readings than unknowns; gains and biases count only if the caller chose them freely."""
    wanted = len([name for name in parameters.names if freely or name not in OF_CELLS])
    readings = reading_count(log)
    if readings >= wanted:
        return
    gone = "".join(f"; {counted(len(rows), 'row')} left out: {reason.text}" for reason, rows in left_out.items())
    shown = f"{counted(readings, 'reading')} in {counted(len(log), 'row')}{gone}"
    allowed = f">= {wanted}, one per unknown"
    step = "Log more poses with load cells or measured positions, or estimate fewer unknowns."
    raise InvalidValueError("log", shown, allowed, step)
