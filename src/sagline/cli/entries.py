"""Table of the kernels that Python calls: description for the user, size, and a call that compiles each."""

from __future__ import annotations

import gc
from collections.abc import Callable
from importlib import import_module
from math import nan
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from sagline.cables.model import CableModel
    from sagline.robot.equilibrium import Equilibrium
    from sagline.tension.method import TensionMethod

KERNELS = "sagline.kernels."
ROBOT, OVER_PULLEYS = "article-suspended", "ipanema-2-pulleys"
PLACE = (0.0, 0.0, 2.0)
LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class _Entry(NamedTuple):
    """An entry of the kernels.

    Attributes:
        words: Purpose in words for the user; the key of the table.
        path: Module in `sagline.kernels`, and function.
        kernels: Number of kernels that are compiled for it with an empty cache.
        seconds: Time to compile it on one core of an ordinary machine [s]; only the proportions matter.
        solve: Calls the public function that needs it, with `sagline`, on the smallest problem.
        version: 1 or 2: versions for different argument types; the second is compiled after the first.
        after: Words of the entry that is compiled before it, if any; its time is not in `seconds`.
    """

    words: str
    path: str
    kernels: int
    seconds: float
    solve: Callable[[Any], object]
    version: int = 1
    after: str | None = None

    @property
    def function(self) -> Callable[..., object]:
        """The compiled function."""
        module, _, name = (KERNELS + self.path).rpartition(".")
        found: Callable[..., object] = getattr(import_module(module), name)
        return found

    def compile(self) -> None:
        """Compile it, after its first version; without the garbage collector, which takes a seventh of the time."""
        import sagline

        collects = gc.isenabled()
        gc.disable()
        try:
            if self.version > 1 and self.after is not None:
                ENTRIES[self.after].solve(sagline)
            self.solve(sagline)
        finally:
            if collects:
                gc.enable()

    @property
    def is_compiled(self) -> bool:
        """True if its machine code is on disk."""
        from sagline.kernels.jit import is_compiled

        return is_compiled(self.function, self.version)


def _inverse(sl: Any, **options: Any) -> None:
    sl.inverse(sl.load_robot(ROBOT), sl.Pose(PLACE, LEVEL), **options)


def _forward(sl: Any, model: CableModel, name: str = ROBOT) -> None:
    robot = sl.load_robot(name)
    sl.forward(robot, [nan] * robot.cable_count, sl.Pose(PLACE, LEVEL), model)


def _verdicts(sl: Any) -> None:
    import numpy as np

    from sagline.core.arrays import locked
    from sagline.kernels.codes import POSE_INFEASIBLE
    from sagline.kinematics.inverse_rows import InverseRows, decide_rows
    from sagline.statics.tables import pose_rows
    from sagline.tension.method import kernel_options

    robot = sl.load_robot(ROBOT)
    found = InverseRows.empty(1, robot.cable_count, robot.degrees_of_freedom, behind=False)
    found = found._replace(pose_status=np.full(1, POSE_INFEASIBLE, dtype=np.int8))
    options = kernel_options(robot, sl.Catenary(), sl.MinimumNorm())
    decide_rows(robot, options, pose_rows(sl.Pose(PLACE, LEVEL)), locked(np.zeros((1, 6))), found)


def _polygon(sl: Any) -> None:
    from sagline.kinematics.polygon import polygon_at
    from sagline.tension.method import kernel_options

    robot, state = sl.load_robot(ROBOT), _unknown_state(sl)
    options = kernel_options(robot, sl.Catenary(), sl.MinimumNorm())
    unknown = state.cables.chord_tension
    polygon_at(robot, state.pose, options, state.wrench, unknown, unknown, feasible=False)


def _period(sl: Any) -> None:
    state = _hanging_state(sl)
    sl.Simulator(state.one_robot, state, winches="ideal").step(state.unstrained_length, 0.01)


def _readings(sl: Any, name: str = ROBOT) -> None:
    import numpy as np

    from sagline.calibration.observations import predicted_rows
    from sagline.calibration.parameters import parameters_of
    from sagline.core.arrays import locked
    from sagline.statics.tables import pose_rows

    state, sensors = _hanging_state(sl, name), sl.Sensors()
    parameters = parameters_of(state.one_robot, ["mass"], sensors, counted=False)
    lengths = locked(np.atleast_2d(state.unstrained_length))
    predicted_rows(state.one_robot, sl.Catenary(), parameters, sensors, pose_rows(state.pose), lengths)


def _starting_lengths(sl: Any) -> None:
    import numpy as np

    from sagline.core.arrays import locked
    from sagline.kernels.calibration.starting_lengths import starting_lengths
    from sagline.kernels.memory import memory_for
    from sagline.statics.tables import body_table, cable_table, pose_rows

    robot = sl.load_robot(ROBOT)
    m = robot.cable_count
    held = locked(np.full((1, m), 100.0)), memory_for(m), np.empty((1, m))
    tables = robot.freedom, cable_table(robot)[0], body_table(robot)[0], pose_rows(sl.Pose(PLACE, LEVEL))
    starting_lengths(sl.Catenary().terms(robot.gravity), *tables, *held)


def _other_methods(sl: Any) -> None:
    _inverse(sl, tension=sl.Centroid())


def _forward_over_pulleys(sl: Any) -> None:
    _forward(sl, sl.Catenary(), OVER_PULLEYS)


def _signed_margins(sl: Any) -> None:
    sl.margin(sl.load_robot(ROBOT), sl.Pose(PLACE, LEVEL))


def _proofs(sl: Any) -> None:
    sl.prove(sl.load_robot(ROBOT), sl.PoseBox(PLACE, PLACE))


def _vibration_over_pulleys(sl: Any) -> None:
    sl.modes(_unknown_state(sl, OVER_PULLEYS))


def _clearances(sl: Any) -> None:
    sl.clearance(_unknown_state(sl))


def _readings_over_pulleys(sl: Any) -> None:
    _readings(sl, OVER_PULLEYS)


def _modes(sl: Any) -> None:
    sl.vibration(_hanging_state(sl), up_to=3.0)


def _losses(sl: Any) -> None:
    sl.vibration(_hanging_state(sl), up_to=3.0, damping=sl.Damping(loss_time=1e-3))


def _stiffness_with_losses(sl: Any) -> None:
    sl.dynamic_stiffness(_hanging_state(sl), 1.0, sl.Damping(modal_damping=0.01))


def _simulation_over_pulleys(sl: Any) -> None:
    sl.simulate(_hanging_state(sl, OVER_PULLEYS), duration=0.01)


def _chains(sl: Any) -> None:
    sl.simulate(_hanging_state(sl), duration=1e-4, cable_mass="lumped", nodes=4)


def _hanging_state(sl: Any, name: str = ROBOT) -> Equilibrium:
    """State of catenaries with equal tensions, nearly in equilibrium; needs no kernel that solves for equilibrium."""
    import numpy as np

    from sagline.core.arrays import locked
    from sagline.robot.equilibrium import Contact

    robot, pose = sl.load_robot(name), sl.Pose(PLACE, LEVEL)
    run = pose.transform(robot.platform_anchors) - robot.frame_anchors
    cables = sl.Catenary().from_tension(robot.cables, np.hypot(*run[:, :2].T), run[:, 2], 150.0, robot.gravity)
    none = locked(np.zeros(robot.cable_count))
    contact = None
    if robot.winches is not None:
        contact = Contact(none, none, none, cables.chord_tension, locked(cables.rise / cables.chord))
    made: Equilibrium = sl.Equilibrium(robot, pose, locked(np.zeros(6)), cables, contact)
    return made


def _unknown_state(sl: Any, name: str = ROBOT) -> Equilibrium:
    """State of cables with NaN everywhere, for which all results are computed immediately."""
    import numpy as np

    from sagline.core.arrays import locked

    robot = sl.load_robot(name)
    unknown: Any = locked(np.full(robot.cable_count, np.nan))
    status = locked(np.zeros(robot.cable_count, dtype=np.int8))
    geometry, forces = (unknown, unknown, unknown), (unknown, unknown, unknown)
    cables = sl.CableState(sl.Catenary(), robot.cables, robot.gravity, *geometry, *forces, status)
    made: Equilibrium = sl.Equilibrium(robot, sl.Pose(PLACE, LEVEL), locked(np.zeros(6)), cables)
    return made


INVERSE, SHARING, VERDICTS = (
    "inverse kinematics",
    "other tension distribution methods",
    "infeasibility proofs",
)
FORWARD, FIT = "forward kinematics", "fit of straight cables"
MARGINS, POLYGON, VIBRATION = "margins", "tension polygon", "stiffness and vibration"
SIGNED_MARGINS, PROOFS = "signed margins", "proofs for boxes of poses"
MODES, SIMULATION, CHAINS = "modes with cable mass", "simulation", "simulation with cable mass"
LOSSES, ANSWERS = "losses in the cables' stretch", "frequency response with losses"
PERIODS = "simulation by control periods"
FORWARD_OVER_PULLEYS, VIBRATION_OVER_PULLEYS = f"{FORWARD} over pulleys", f"{VIBRATION} over pulleys"
SIMULATION_OVER_PULLEYS = f"{SIMULATION} over pulleys"
CLEARANCES = "least distances"
READINGS, STARTING_LENGTHS = "readings at equilibria", "lengths from measured tensions"
READINGS_OVER_PULLEYS = f"{READINGS} over pulleys"
DESCRIBE = "forward.sensitivity.describe_states"

ENTRIES = {
    entry.words: entry
    for entry in (
        _Entry(INVERSE, "inverse.poses.inverse_poses", 39, 18.0, _inverse),
        _Entry(SHARING, "inverse.poses.inverse_poses", 39, 49.0, _other_methods, 2, INVERSE),
        _Entry(VERDICTS, "inverse.feasibility.decide_poses", 56, 40.0, _verdicts),
        _Entry(FORWARD, "forward.forward.forward_poses", 82, 14.0, lambda sl: _forward(sl, sl.Catenary())),
        _Entry(FORWARD_OVER_PULLEYS, "forward.forward.forward_poses", 41, 14.0, _forward_over_pulleys, 2, FORWARD),
        _Entry(FIT, "forward.fit.fit_poses", 30, 5.0, lambda sl: _forward(sl, sl.Straight())),
        _Entry(
            MARGINS, "inverse.feasibility.margins_of_poses", 33, 9.0, lambda sl: sl.capacity_margin(_unknown_state(sl))
        ),
        _Entry(SIGNED_MARGINS, "workspaces.signed_margin.signed_margins", 48, 16.0, _signed_margins),
        _Entry(PROOFS, "workspaces.pose_box_proof.prove_boxes", 66, 17.0, _proofs),
        _Entry(POLYGON, "inverse.feasibility.polygon_of_pose", 38, 5.0, _polygon),
        _Entry(VIBRATION, DESCRIBE, 57, 6.0, lambda sl: sl.modes(_unknown_state(sl))),
        _Entry(VIBRATION_OVER_PULLEYS, DESCRIBE, 39, 4.0, _vibration_over_pulleys, 2, VIBRATION),
        _Entry(CLEARANCES, "interference.catenary_distance.least_distances", 33, 5.0, _clearances),
        _Entry(READINGS, "calibration.observe.observe", 70, 9.0, _readings),
        _Entry(READINGS_OVER_PULLEYS, "calibration.observe.observe", 45, 8.0, _readings_over_pulleys, 2, READINGS),
        _Entry(STARTING_LENGTHS, "calibration.starting_lengths.starting_lengths", 30, 4.0, _starting_lengths),
        _Entry(MODES, "dynamics.spectral.interpolate", 2, 9.0, _modes, after=VIBRATION),
        _Entry(LOSSES, "dynamics.spectral.stretch_matrices", 2, 1.0, _losses, after=MODES),
        _Entry(ANSWERS, "dynamics.collocation.dynamic_stiffnesses", 3, 6.0, _stiffness_with_losses, 2, MODES),
        _Entry(
            SIMULATION,
            "dynamics.motion.run_massless",
            65,
            16.0,
            lambda sl: sl.simulate(_hanging_state(sl), duration=0.01),
        ),
        _Entry(
            SIMULATION_OVER_PULLEYS, "dynamics.motion.run_massless", 33, 14.0, _simulation_over_pulleys, 2, SIMULATION
        ),
        _Entry(PERIODS, "dynamics.period.begin_period", 1, 1.0, _period, after=SIMULATION),
        _Entry(CHAINS, "dynamics.chains.run_chains", 44, 17.0, _chains),
    )
}


def needed_for(tension: TensionMethod) -> tuple[str, ...]:
    """Entries of the inverse kinematics with a tension distribution method."""
    from sagline.tension.method import takes_default_kernel

    return (INVERSE,) if takes_default_kernel(tension) else (INVERSE, SHARING)
