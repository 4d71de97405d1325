"""Uncertainty of a plan by first order, from the derivatives of readings that calibrations use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.log import Sensors
from sagline.calibration.observations import MachineTerms, unwhitened_slopes
from sagline.calibration.parameters import KINDS, OF_CELLS, Parameters, Unknown, parameters_of
from sagline.core.arrays import Array, blocks, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kinematics.plan import Plan
from sagline.kinematics.uncertainty import Uncertainty
from sagline.robot.drum import has_drum_data
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot, standard_errors
from sagline.robot.routing import kernel_length
from sagline.robot.winch import Winch
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import compliance_of
from sagline.statics.tables import pose_rows

BLOCK: Final = 1 << 9  # number of poses whose derivatives are in memory at the same time


def uncertainty_of(plan: Plan) -> Uncertainty:
    """Errors of poses and tensions of a plan due to the tolerances of its robot; see `Plan.uncertainty`."""
    state = plan.state
    robot, m = state.one_robot, state.one_robot.cable_count
    _check_model(robot, state.cables.model)
    errors = _known_errors(robot)
    robot = robot.replace(tolerances=errors, winches=(robot.winches or Winch()).replace(load_cell_gain=1.0))
    parameters = _parameters(robot, errors)
    machine = MachineTerms(robot, state.cables.model, parameters, Sensors())
    names = np.array(parameters.names)
    part_of = np.stack([names == name for name in errors], axis=-1).astype(np.float64)  # (P, K)
    solved, shape = np.atleast_1d(plan.solved), plan.status.shape
    covariance = np.full((len(solved), 6, 6), np.nan)
    variance = np.full((len(solved), m + 6, len(errors)), np.nan)
    poses, lengths = pose_rows(state.pose), np.atleast_2d(kernel_length(state))
    kept = np.flatnonzero(solved)
    for part in blocks(len(kept), BLOCK):
        rows = kept[part]
        slopes, _ = unwhitened_slopes(machine, poses[rows], lengths[rows])
        _add_moments(state[rows] if shape else state, slopes)
        slopes *= parameters.prior_deviation
        covariance[rows] = slopes[:, m:] @ np.swapaxes(slopes[:, m:], 1, 2)
        variance[rows] = slopes**2 @ part_of
    return Uncertainty(
        state=state,
        path=plan.path,
        names=tuple(errors),
        covariance=locked(covariance.reshape(*shape, 6, 6)),
        pose_variance=locked(variance[:, m:].reshape(*shape, 6, -1)),
        tension_variance=locked(variance[:, :m].reshape(*shape, m, -1)),
    )


def _check_model(robot: Robot, model: CableModel) -> None:
    if model.code not in (codes.CATENARY, codes.ELASTIC):
        step = "Plan with Catenary(); the true cables are exact."
        raise InvalidValueError("model", type(model).__name__, "Catenary() or Elastic() for an uncertainty", step)


def _known_errors(robot: Robot) -> Mapping[str, Array]:
    """Standard deviations of the quantities that have an effect on poses and tensions."""
    errors = {name: error for name, error in standard_errors(robot).items() if name not in OF_CELLS}
    if not errors:
        step = "Give them in the robot file, or with robot.replace(tolerances={'frame_anchors': 0.002})."
        raise InvalidValueError("robot: tolerances", "not given", "standard deviations of its quantities", step)
    for name, error in errors.items():
        if not np.isfinite(error).all():
            step = "Give the standard deviation, or remove the quantity from the tolerances."
            raise InvalidValueError(f"tolerances: {name}", "inf", "finite for an uncertainty", step)
    return errors


def _parameters(robot: Robot, errors: Mapping[str, Array]) -> Parameters:
    """Parameters with the tolerances as prior deviations, with one value per cable."""
    counted = has_drum_data(robot) or "drum_radius" in errors
    unknowns = [Unknown(name, shared=False if KINDS[name].each else None) for name in errors]
    return parameters_of(robot, unknowns, Sensors(), counted=counted)


def _add_moments(state: Equilibrium, slopes: Array) -> None:
    """Add the effect of external moments, which make the stiffness K unsymmetric, to the derivatives (N, m + 6, P)."""
    # With the symmetric part S of K, S x' = K x gives x = x' - K^-1 (K - S) x'. The skew part acts on rotations only.
    if not state.wrench[..., 3:].any():
        return
    robot, m = state.one_robot, state.one_robot.cable_count
    cables = cable_slopes(state)
    matrix = cables.matrix.reshape(-1, 6, 6)
    skew = 0.5 * (matrix - np.swapaxes(matrix, 1, 2))
    change = -compliance_of(robot.freedom, matrix) @ skew @ slopes[:, m:]  # motion of the center of mass
    slopes[:, :m] += cables.tension_by_motion.reshape(-1, m, 6) @ change
    reach = (state.pose.matrix @ robot.center_of_mass).reshape(-1, 3)
    slopes[:, m : m + 3] += change[:, :3] - np.cross(change[:, 3:], reach[:, :, None], axis=1)
    slopes[:, m + 3 :] += change[:, 3:]
