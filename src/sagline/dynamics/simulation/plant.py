"""State and data of the simulated robot, as arrays for the kernels."""

from __future__ import annotations

from typing import Any, ClassVar, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.dynamics.simulation.initial_conditions import TimeTable
from sagline.kernels import tables
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.cable.geometry import LENGTH as LENGTH_ROW
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics import motion
from sagline.kernels.dynamics import progress as k
from sagline.kernels.dynamics import rigid_body as body
from sagline.kernels.dynamics.drives import BIN
from sagline.robot.batch import has_routing, on_platform
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import cable_table

MARGIN: Final = 5.0  # additional length of cable for which a drum stores strains [m], beyond the required length
BROKEN: Final = 1e-12  # factor of stiffness and weight of a broken cable
NOTES: Final = 1000  # number of recorded unscheduled events after which a run pauses to store them


class Records:
    """Records of N steps, which the kernel fills."""

    def __init__(self, count: int, cables: int, points: tuple[int, int] = (0, 0)) -> None:
        """Allocate records for `count` steps; `points`: number of cables with mass, and of points per cable."""
        self.states = np.empty((count, body.STATE_COLUMNS))  # center of mass, principal axes, velocities: `rigid_body`
        self.tensions = np.empty((count, cables))  # tensions at the frame ends [N]
        self.lengths = np.empty((count, cables))  # unstrained lengths [m]
        self.energies = np.empty((count, k.ENERGY_COLUMNS))  # kinetic, potential, supplied and lost energy [J]
        # events, see `sagline.kernels.dynamics.progress`; after NOTES events, a run pauses to store them
        self.notes = np.zeros((NOTES + 2 * cables, k.NOTE_COLUMNS))
        # points of cables with mass [m]; None without cable mass
        self.points = np.full((count, *points, 3), np.nan) if points[1] else None

    @property
    def arrays(self) -> tuple[Array, ...]:
        """Return the arrays for the kernel."""
        given = self.states, self.tensions, self.lengths, self.energies, self.notes
        return given if self.points is None else (*given, self.points)


class Plant:
    """Mutable state of a robot during a simulation."""

    # In this class the platform axes are the principal axes of the platform, with the origin at the center of mass.

    # integrator; its arguments are `arguments`, arrays of records, number of steps, and steps per record
    kernel: ClassVar[Any] = staticmethod(motion.run_massless)
    cable_mass: ClassVar[str] = "none"  # option of `simulate`

    def __init__(self, robot: Robot, model: CableModel, pose: Pose, twist: Array, length: Array, data: Array) -> None:
        """Create the state of `robot` at `pose`; `twist` (6,); `length` (m,) [m]; `data` (DATA_ROWS, m)."""
        m = robot.cable_count
        self.robot, self.model, self.data = robot, model, data  # the robot at the start
        moments, self.axes = _principal_axes(robot, pose)  # principal axes in the platform frame, one per column
        self.turn = Rotation.from_matrix(self.axes).as_quat()  # rotation from principal axes to the platform frame
        self.turn_back = locked(self.turn * [-1.0, -1.0, -1.0, 1.0])  # inverse rotation
        self.inertia = np.array([robot.mass, *moments])
        self.cables: Indices = np.arange(m)  # cable of each row: unbroken cables, and pieces of broken cables with mass
        self.broken: list[int] = []  # broken cables
        self._table = cable_table(robot, slanted=True)[0].copy()
        anchors = slice(tables.PLATFORM_X, tables.PLATFORM_Z + 1)
        self._table[:, anchors] = (robot.platform_anchors - robot.center_of_mass) @ self.axes
        aboard = on_platform(robot)
        if aboard.any():
            self._table[aboard, tables.AXIS_X :] = self._table[aboard, tables.AXIS_X :] @ self.axes
        self.points = 0  # recorded points per cable with mass
        self._behind = has_routing(robot) or None
        self.state = self._state_at(pose, twist)  # row as in `sagline.kernels.dynamics.rigid_body`
        self.rows = np.full((CABLE_ROWS, m), np.nan)  # rows of the cables
        self.rows[LENGTH_ROW] = length
        self.now = np.zeros((d.DRIVE_ROWS, m))  # state of the drives
        self.now[d.WOUND] = length * (1.0 + data[d.WINDING_STRAIN])
        self.now[d.STORED] = data[d.WINDING_STRAIN]
        self.layers = np.zeros((m, 1))  # strain of the cable on the drums
        # sums over the run; counters of the kernel, see `sagline.kernels.dynamics.progress`
        self.audit, self.counters = np.zeros(d.AUDIT_SIZE), np.zeros(k.COUNTERS, dtype=np.int64)
        self._work = np.zeros(0)

    def remember_winding(self, longest: float) -> None:
        """Set up drums that store the strain of their cable, for lengths off the drum up to longest + MARGIN [m]."""
        # cable deeper on the drum has the winding tension, also if it is paid out and wound in again
        self.layers = np.tile(self.data[d.WINDING_STRAIN][:, None], (1, int((longest + MARGIN) / BIN) + 1))

    def arguments(
        self, rules: tuple[int, int, int, int, int], numbers: tuple[float, float, float, float], inputs: Any
    ) -> Any:
        """First arguments of the kernel, without records and step counts. A break or a new mass changes them."""
        given: tuple[TimeTable, ...] = inputs
        wide = given[0].value.shape[1]
        needed = 6 * 6 + 3 * body.STATE_COLUMNS + 10 * len(self.cables) + 2 * wide + 9
        if self._work.size != needed:
            self._work = np.zeros(needed)
        platform = locked(np.array([self.inertia[0], self.robot.gravity, 0.0, 0.0, 0.0]))
        robot = (self._table, platform, locked(self.inertia.copy()), self.robot.freedom)
        kept = (self.state, self.rows, self.now, self.layers, self.audit, self.counters, self._work)
        terms = (self.model.code, *self.model.parameters, self.robot.gravity, self._behind)
        return terms, rules, numbers, robot, locked(self.data.view()), tuple(c.arrays for c in given), kept

    def records(self, count: int) -> Records:
        """Allocate records for `count` steps."""
        return Records(count, len(self.cables), (self.robot.cable_count, self.points))

    def platform_states(self, states: Array) -> Array:
        """Convert recorded states of the simulated body to states of the platform, (N, 13)."""
        return states

    def failure(self, time: float, step: float) -> InvalidValueError:
        """Create the error for a kernel that stopped at `time` [s]; `step`: time step [s]."""
        return energy_error(step, time, int(self.cables[int(self.counters[k.FAILED]) - 1]))

    def break_cable(self, cable: int, position: float) -> Indices:
        """Remove a cable without mass, for any `position` of its break. Returns the previous rows of the new rows."""
        return self._select_rows(np.flatnonzero(self.cables != cable))

    def _select_rows(self, rows: Indices) -> Indices:
        """Replace the rows of all cables by the previous rows `rows`."""
        self.cables, self._table, self.layers = self.cables[rows], self._table[rows], self.layers[rows]
        self.rows, self.now, self.data = (np.take(array, rows, axis=1) for array in (self.rows, self.now, self.data))
        return rows

    def cut(self, places: Any) -> None:
        """Break the cables `places` during a run (indices of the present cables). The arrays keep their size."""
        # one factor reduces stiffness and weight, so that the cable keeps its shape at nearly zero force
        for column in (tables.STIFFNESS, tables.DENSITY):
            self._table[places, column] *= BROKEN
        self.counters[k.READY] = 0  # compute all forces and energies again

    def lock_winches(self, places: Any) -> None:
        """Lock the winches `places` (indices of the present cables). Their kinetic energy is lost at once."""
        self.now[d.HELD, places] = 1.0
        self.now[d.RATE, places] = 0.0

    def with_mass(self, mass: float, *, at_rest: bool) -> None:
        """Set the mass to `mass` [kg], the inertia in proportion. With `at_rest` (pick-up), the momentum is kept."""
        factor = mass / self.inertia[0]
        self.inertia = self.inertia * factor
        if at_rest:
            self.state[body.VELOCITY : body.VELOCITY + 3] /= factor
        else:
            self.state[body.MOMENTUM :] *= factor

    def _state_at(self, pose: Pose, twist: Array) -> Array:
        turned = pose.matrix
        lever = turned @ self.robot.center_of_mass
        state = np.empty(body.STATE_COLUMNS)
        state[body.CENTER : body.TURN] = pose.position + lever
        state[body.TURN : body.VELOCITY] = (pose.rotation * Rotation.from_quat(self.turn)).as_quat()
        state[body.VELOCITY : body.MOMENTUM] = twist[:3] + np.cross(twist[3:], lever)
        axes = turned @ self.axes
        moments = np.where(np.isinf(self.inertia[1:]), 0.0, self.inertia[1:])
        state[body.MOMENTUM :] = axes @ (moments * (axes.T @ twist[3:]))
        return state

    def poses(self, states: Array) -> Pose:
        """Compute the poses of the platform frame from recorded states (N, 13)."""
        turned = Rotation.from_quat(states[:, body.TURN : body.VELOCITY]) * Rotation.from_quat(self.turn_back)
        position = states[:, body.CENTER : body.TURN] - turned.as_matrix() @ self.robot.center_of_mass
        return Pose.from_quaternion(position, turned.as_quat())


def _principal_axes(robot: Robot, pose: Pose) -> tuple[Array, Array]:
    """Principal moments of the platform (3,) [kg m^2], infinite for a blocked rotation; principal axes as columns."""
    if robot.motion_pattern == "3R3T":
        moments, axes = np.linalg.eigh(robot.inertia)
        if np.linalg.det(axes) < 0.0:
            axes[:, 0] *= -1.0
        return moments, axes
    if robot.motion_pattern != "1R2T" or robot.plane_normal is None:
        return np.full(3, np.inf), np.eye(3)
    normal = pose.matrix.T @ robot.plane_normal
    axes = np.linalg.svd(normal[None])[2].T[:, [1, 2, 0]]  # normal in the last column
    axes[:, 2] = normal
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    return np.array([np.inf, np.inf, normal @ robot.inertia @ normal]), axes


def energy_error(step: float, time: float, cable: int) -> InvalidValueError:
    """Create the error for a run whose energy drifts; `step` and `time` in s."""
    value = f"{step:g} s, which changes the energy without a cause: at {time:.6g} s, mostly in cable {cable}"
    return InvalidValueError("step", value, "a step that conserves the energy", f"Give step={0.2 * step:.3g}.")
