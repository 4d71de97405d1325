"""Time step of a simulation, from the highest frequency of winches and robot. All cables count as taut."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.massless import RUNGE_KUTTA, SPLITTING
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

LIMIT: Final = {SPLITTING: 2.0, RUNGE_KUTTA: 2.0 * math.sqrt(2.0)}  # largest stable step times highest frequency
SHARE: Final = 0.2  # default product of step and highest angular frequency [rad]
# default step divided by the limit 0.4 l sqrt(rho/EA) of chains; small, because a break excites the shortest waves
WAVE_SHARE: Final = 0.465
LONGEST: Final = 1e-3  # s


def platform_frequency(robot: Robot, poses: Pose, lengths: Array) -> float:
    """Highest angular frequency of the platform with all cables taut [rad/s]. Sag reduces this frequency."""
    # shapes: lengths (K, m) [m]
    rotation, freedom = poses.matrix, robot.freedom
    levers = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(rotation, 1, 2)
    ends = (poses.position + rotation @ robot.center_of_mass)[:, None] + levers
    chords = ends - robot.frame_anchors
    distance = np.linalg.norm(chords, axis=-1, keepdims=True)
    along = chords / np.maximum(distance, 1e-300)
    rows = np.concatenate((along, np.cross(levers, along)), axis=-1) @ freedom.T
    taut = np.maximum(distance[..., 0], 1e-300)
    with np.errstate(over="ignore", invalid="ignore"):  # lengths that are too short are refused below
        springs = robot.cables.axial_stiffness / (np.minimum(lengths.min(axis=0), taut) if len(poses) == 1 else taut)
        stiffness = np.swapaxes(rows, 1, 2) @ (springs[..., None] * rows)
    if not np.isfinite(stiffness).all():
        value = f"down to {lengths.min():g} m"
        raise InvalidValueError("unstrained_length", value, "longer cables", "Correct unstrained_length.")
    mass = np.zeros((len(poses), 6, 6))
    mass[:, :3, :3] = robot.mass * np.eye(3)
    mass[:, 3:, 3:] = rotation @ robot.inertia @ np.swapaxes(rotation, 1, 2)
    squares = np.linalg.eigvals(np.linalg.solve(freedom @ mass @ freedom.T, stiffness)).real
    return float(np.sqrt(max(squares.max(), 0.0)))


def checked_step(
    step: float | None, integrator: int, highest: float, damping: Damping, stride: bool, waves: float = 0.0
) -> float:
    """Check the time step `step` [s] of a run. `highest` and `waves` are angular frequencies [rad/s]."""
    limit = _limit(integrator, max(highest, waves), damping)
    if step is None:
        usual = min(SHARE / LIMIT[integrator] * _limit(integrator, highest, damping), LONGEST)
        usual = min(usual, WAVE_SHARE * limit) if waves > 0.0 else usual
        return LONGEST / math.ceil(LONGEST / usual - 1e-9)
    given = number(step, "step", "s", above=0.0)
    if given > limit:
        what = "cables with mass" if waves > highest else "massless cables taut"
        at = f"{max(highest, waves) / (2.0 * math.pi):.3g} Hz, {what}"
        allowed = f"<= {limit:.3g} s, the limit of stability at {at}"
        raise InvalidValueError("step", f"{given:g} s", allowed, "Omit step, or give a tenth of the limit.")
    parts = LONGEST / given
    if stride and (parts < 0.5 or abs(parts - round(parts)) > 1e-9 * parts):
        step_to = "Give for instance 1e-3 or 5e-4, because drives close their loops every millisecond."
        raise InvalidValueError("step", f"{given:g} s", "0.001 s divided by a whole number", step_to)
    return LONGEST / round(parts) if stride else given


def _limit(integrator: int, highest: float, damping: Damping) -> float:
    """Longest stable step [s] at the angular frequency `highest`."""
    ratio = 0.5 * damping.loss_time * highest  # damping ratio at the highest frequency
    slower = math.sqrt(1.0 + ratio * ratio) - ratio
    return LIMIT[integrator] * slower / highest if highest > 0.0 else math.inf


def frequency_with_winches(platform: float, kind: int, data: Array, lengths: Array, stiffness: Array) -> float:
    """Highest angular frequency of platform and winches as a coupled system [rad/s]."""
    # shapes: platform [rad/s]; data (DATA_ROWS, m); lengths (K, m) [m]; stiffness (m,) [N]
    if kind == d.SECOND_ORDER:
        return max(platform, float(data[d.BANDWIDTH].max() * max(1.0, 2.0 * data[d.RATIO].max())))
    if kind == d.DRUMS:  # the largest eigenvalue is at most the sum of those with one mass only
        drums = stiffness / (lengths.min(axis=0) * data[d.INERTIA])
        return math.hypot(platform, math.sqrt(float(drums.max())))
    return platform
