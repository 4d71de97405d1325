"""Inputs for the comparison of all back ends: calls of public functions that reach every entry."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.kernels.cable import geometry as g
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.motion import cable_loads
from sagline.kernels.dynamics.rigid_body import STATE_COLUMNS
from sagline.kinematics.differentiable import InverseKinematics, pull_batch, solve_batch
from sagline.robot.batch import has_routing
from sagline.share.machine import courses_at
from sagline.statics.stiffness import compliance_of, least_stiffness
from sagline.statics.tables import body_table, cable_table, pose_rows
from tests.kinematics.test_underconstrained import places, suspended
from tests.record.poses import METHODS, MODELS

POSES: Final = 4  # of a robot
WINCH: Final = sl.Winch(
    drum_radius=0.06,
    groove_pitch=0.006,
    gear=10.0,
    counts_per_turn=4096,
    length_zero=8.0,
    winding_tension=200.0,
    load_cell_deviation=2.0,
    load_cell_range=1e4,
)


def poses_of(robot: sl.Robot, count: int, seed: int) -> sl.Pose:
    """Random poses in the box of a robot, level and tilted, feasible and infeasible, with its corners at the end."""
    random = np.random.default_rng(seed)
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    if robot.test_box is not None:
        low, high = np.asarray(robot.test_box.low), np.asarray(robot.test_box.high)
    places = low + random.uniform(size=(count, 3)) * (high - low)
    places[-2], places[-1] = low, high
    turns = random.choice([0.0, 0.01, 0.3], size=(count, 1)) * random.uniform(-1.0, 1.0, size=(count, 3))
    return sl.Pose(places, Rotation.from_rotvec(turns).as_matrix())


def state_of(robot: sl.Robot) -> sl.Equilibrium:
    """A feasible state near the middle of a robot's box."""
    plan = sl.inverse(robot, poses_of(robot, 40, 2))
    return plan.state[int(np.flatnonzero(plan.feasible)[0])]


def random_robot(seed: int) -> sl.Robot:
    """Six to nine cables from the upper part of a room to a box, from points or over pulleys."""
    random = np.random.default_rng(seed)
    m = int(random.integers(6, 10))
    frame = random.uniform([-5.0, -4.0, 2.0], [5.0, 4.0, 6.0], size=(m, 3))
    platform = random.uniform(-0.4, 0.4, size=(m, 3))
    cables = sl.Cable(random.uniform(0.01, 0.3, size=m), random.uniform(2e4, 1e6, size=m))
    winches = sl.Winch(pulley_radius=random.uniform(0.02, 0.1, size=m)) if seed % 2 else None
    return sl.Robot(
        f"random-{seed}",
        frame,
        platform,
        cables,
        mass=random.uniform(5.0, 200.0),
        inertia=np.diag([2.0, 3.0, 4.0]),
        winches=winches,
        tension_min=random.uniform(1.0, 50.0),
        tension_max=random.uniform(500.0, 5000.0),
    )


def there_and_back(robot: sl.Robot, count: int, seed: int) -> sl.Plan:
    """Lengths of poses, and the poses of these lengths without a start."""
    plan = sl.inverse(robot, poses_of(robot, count, seed))
    sl.forward(robot, plan.unstrained_length)
    return plan


def preset(name: str) -> None:
    """Poses with a wrench for each cable model and tension method of a robot, and the forward solutions."""
    robot = sl.load_robot(name)
    poses = poses_of(robot, POSES, 1)
    wrench = np.random.default_rng(3).uniform(-0.1, 0.1, size=(POSES, 6)) * robot.mass * robot.gravity
    for model in MODELS:
        for method in METHODS:
            try:
                plan = sl.inverse(robot, poses, model, method, wrench)
            except sl.InvalidValueError:
                assert robot.cable_count - robot.degrees_of_freedom != 2  # such a robot accepts all methods
        sl.forward(robot, plan.unstrained_length, poses, model, wrench)
    there_and_back(robot, POSES, 2)


def random_robots() -> None:
    """Poses, lengths and margins of random robots."""
    for seed in range(20):
        robot = random_robot(seed)
        there_and_back(robot, POSES, seed)
        sl.margin(robot, poses_of(robot, POSES, seed))


def lengths(*factors: float, start: bool = False) -> None:
    """Forward solutions of the lengths of a level pose times factors, with unknown lengths and NaN."""
    plan = sl.inverse(COGIRO, LEVEL)
    rows = plan.unstrained_length * np.array([*factors, np.nan])[:, None]
    sl.forward(COGIRO, rows, LEVEL if start else None)


def touching_ends() -> None:
    """Both ends of cable 1 at one point."""
    with suppress(sl.CableGeometryError):
        sl.inverse(COGIRO, sl.Pose(COGIRO.frame_anchors[0] - COGIRO.platform_anchors[0], np.eye(3)))


def vertical_cable() -> None:
    """The platform end of cable 1 below its frame end."""
    below = COGIRO.frame_anchors[0] - COGIRO.platform_anchors[0] - [0.0, 0.0, 3.0]
    there = sl.inverse(COGIRO, sl.Pose(below, np.eye(3)), tension=sl.MinimumNorm())
    sl.forward(COGIRO, np.nan_to_num(there.unstrained_length, nan=3.0), sl.Pose(below, np.eye(3)))


def lost_rank() -> None:
    """All cables are vertical and resist only three of six motions."""
    robot = COGIRO.replace(platform_anchors=COGIRO.frame_anchors - [0.0, 0.0, 4.0])
    sl.inverse(robot, sl.Pose(np.zeros(3), np.eye(3)))
    sl.margin(robot, sl.Pose(np.zeros(3), np.eye(3)))


COGIRO = sl.load_robot("cogiro")
LEVEL = sl.Pose(np.array([0.0, 0.0, 2.0]), np.eye(3))
CORNERS: Final[dict[str, Callable[[], object]]] = {
    "taut cables": partial(lengths, 0.97, 0.999, start=True),
    "slack cables": partial(lengths, 1.02, 1.2, start=True),
    "unknown start": partial(lengths, 1.0),
    "out of reach": lambda: sl.inverse(COGIRO, sl.Pose(np.array([[40.0, 0.0, 2.0], [0.0, 0.0, -90.0]]), np.eye(3))),
    "too heavy": lambda: sl.inverse(COGIRO.replace(mass=1e5), LEVEL),
    "almost without weight": lambda: sl.inverse(COGIRO.replace(mass=1e-3), LEVEL),
    "touching ends": touching_ends,
    "vertical cable": vertical_cable,
    "lost rank": lost_rank,
}


def corner_cases() -> None:
    """All corner cases."""
    for corner in CORNERS.values():
        corner()


def gradients(state: sl.Equilibrium) -> None:
    """Gradients of the inverse kinematics at one pose."""
    kinematics = InverseKinematics(state.one_robot, state.cables.model, "inverse")
    m = state.cables.shape[-1]
    inputs = pose_rows(state.pose), np.zeros((1, 6)), *(each[None] for each in kinematics.anchors), np.zeros((1, m))
    lengths, _, results = solve_batch(kinematics, inputs)
    pull_batch(kinematics, (np.ones((1, m)), np.ones((1, m))), (*inputs, lengths, results))


def statics(robot: sl.Robot, count: int) -> None:
    """Margins, confirmation, equilibria, modes, polygon, distances."""
    poses = poses_of(robot, count, 2)
    plan = sl.inverse(robot, poses)
    state = state_of(robot)
    sl.margin(robot, poses)
    sl.capacity_margin(state)
    sl.confirm(plan)
    if robot.cable_count - robot.degrees_of_freedom == 2:
        sl.tension_polygon(robot, state.pose)
    sl.modes(state)
    matrix = sl.stiffness(state).matrix[None]
    compliance_of(robot.freedom, matrix)
    least_stiffness(robot.freedom, matrix)
    gradients(state)
    sl.clearance(state)
    sl.equilibria(robot, state.unstrained_length, starts=10)
    if robot.winches is None:
        sl.prove(robot, sl.PoseBox(state.pose.position - 0.01, state.pose.position + 0.01))


def cables() -> None:
    """Single cables: from tension, from length, shapes, creep, fits."""
    cable = sl.Cable(linear_density=0.067, axial_stiffness=44e3)
    span, rise = np.linspace(0.0, 9.0, 5), np.array([3.0, -4.0, 0.0, 1e-9, 5.0])
    for model in MODELS:
        model.from_tension(cable, span, rise, np.array([1e-3, 10.0, 1e3, 1e5, 50.0]), 9.81)
        state = model.from_length(cable, span, rise, np.hypot(span, rise) * [0.98, 0.999, 1.001, 1.3, 1.0], 9.81)
        assert len(state.points(7)) == len(state.sag) == len(state.closure_residual)
    sl.identify_empirical(cable, [5.0, 10.0], [-4.0, -2.0], [50.0, 100.0])
    sl.Creep([1e6, 4e5], [30.0, 1200.0]).strain([0.0, 1.0, 60.0, 3600.0], [1000.0] * 4)


def dynamics(robot: sl.Robot) -> None:
    """Vibration with the mass of the cables, and simulation."""
    state = state_of(robot)
    sl.vibration(state, up_to=3.0)
    sl.vibration(state, up_to=3.0, damping=sl.Damping(loss_time=1e-3))
    sl.dynamic_stiffness(state, [1.0, 2.0])
    sl.dynamic_stiffness(state, [1.0], sl.Damping(modal_damping=0.01))
    sl.frequency_response(state, [0.5, 1.0])
    gust = ([0.0, 0.01, 0.02], np.outer([0, 1, 0], [0, 0, -500, 0, 0, 0]))
    sl.simulate(state, wrench=gust, duration=0.03)
    machine = sl.Simulator(robot, state, winches="ideal")
    for _ in range(3):
        machine.step(state.unstrained_length - 0.01 * machine.time, 0.002)
    if robot.winches is None:
        sl.simulate(state, wrench=gust, duration=2e-4, cable_mass="lumped", nodes=4)


def winches() -> None:
    """Drums, encoders, load cells, homing, paths."""
    robot = sl.load_robot("cogiro")
    robot = robot.replace(winches=WINCH, cables=robot.cables.replace(diameter=0.004))
    plan = sl.inverse(robot, sl.quintic_path([(0, 0, 2), (0.2, 0.1, 2.5)], durations=0.1))
    creep = sl.Creep([1e6], [30.0])
    for winding in ("constant", "remembered"):
        sl.lengths_from_counts(robot, sl.encoder_counts(plan, winding, creep=creep))
    state = plan.state[0]
    sl.home(robot, state.pose, state.cables.frame_end_tension, counts=1000)
    sl.Simulator(robot, state, winches="ideal").step(state.unstrained_length, 0.002)
    time = np.linspace(0.0, 2.0, 21)
    sl.path_from_samples(time, sl.Pose.from_euler(np.outer(time**2, [1, 0, 2]), 0, 0, 0))
    solver = sl.InverseSolver(robot)
    for height in (2.0, -90.0):
        solver.step((1.0, 1.0, height), (0.0, 0.0, 0.0, 1.0))


def calibration(robot: sl.Robot) -> None:
    """Predictions of measurements, and their fit."""
    true = robot.replace(mass=1.02 * robot.mass)
    places = np.random.default_rng(0).uniform(-0.2, 0.2, (5, 3)) + state_of(robot).pose.position
    plan = sl.inverse(true, sl.Pose(places, np.eye(3)))
    cells, sensors = plan.state.cables.frame_end_tension, sl.Sensors(tension_deviation=5.0)
    log = sl.WinchLog(unstrained_length=plan.unstrained_length, load_cells=cells, sensors=sensors)
    sl.calibrate(robot, log, ["mass"])


def swivel_angles(robot: sl.Robot) -> None:
    """Fit of readings of swivel angles about slanted axes, whose zeros are unknown."""
    places = np.random.default_rng(0).uniform(-0.2, 0.2, (5, 3)) + state_of(robot).pose.position
    plan = sl.inverse(robot, sl.Pose(places, np.eye(3)))
    sensors = sl.Sensors(tension_deviation=5.0, swivel_deviation=0.5)
    cells, angles = plan.state.cables.frame_end_tension, np.zeros((5, robot.cable_count))
    log = sl.WinchLog(unstrained_length=plan.unstrained_length, load_cells=cells, swivel=angles, sensors=sensors)
    sl.calibrate(robot, log, ["mass", "swivel_zero"])


def meshes() -> None:
    """Distances of cables from a body with corners."""
    corners = [[2.0, 1.0, 1.0], [3.0, 1.0, 1.0], [2.0, 2.0, 1.0], [2.0, 1.0, 2.0]]
    wedge = sl.Mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], name="wedge")
    sl.clearance(state_of(sl.load_robot("cogiro")), wedge)


def loads(robot: sl.Robot) -> None:
    """Loads of the cables along a motion: taut, slack and moving cables, with and without losses."""
    start, m, random = state_of(robot), robot.cable_count, np.random.default_rng(4)
    state, wrenches = np.zeros(STATE_COLUMNS), np.zeros((2, 6))
    rows, now, data = np.full((g.CABLE_ROWS, m), np.nan), np.zeros((d.DRIVE_ROWS, m)), np.zeros((d.DATA_ROWS, m))
    state[:7] = pose_rows(start.pose)[0]
    terms = (sl.Catenary().code, 0.0, 0.0, robot.gravity, has_routing(robot) or None)
    for factor in (1.0, 1.0001, 1.0002, 1.02, 0.999):
        for losses in ((0.0, 0.0), (1e-3, 0.1)):
            state[7:] = random.normal(size=6)
            now[d.RATE] = random.normal(size=m)
            rows[g.LENGTH] = factor * start.unstrained_length
            given = terms, losses, cable_table(robot)[0], body_table(robot)[0], data
            cable_loads(*given, state, np.empty((3, 3)), rows, now, wrenches)


def entries() -> None:
    """Every entry for every set of argument types."""
    for name in ("cogiro", "ipanema-3-pulleys"):
        robot = sl.load_robot(name)
        there_and_back(robot, 4, 1)
        statics(robot, 4)
        dynamics(robot)
        loads(robot)
        calibration(robot)
    poses = poses_of(robot, 2, 1)
    sl.structure_matrix(robot, poses)
    courses_at(robot, poses[0], np.linspace(1e3, 2e3, robot.cable_count))
    plan = sl.inverse(robot, poses, tension=sl.Centroid())
    sl.forward(robot, plan.unstrained_length, poses, sl.Straight())
    slack = sl.load_robot("ipanema-2-pulleys")
    slack = slack.replace(tension_min=1e-3 * slack.tension_min)
    unstable = sl.Pose(np.array([[-0.99, -1.58, 2.51], [1.44, -1.4, 1.13], [0.54, 0.0, 0.99]]), np.eye(3))
    sl.inverse(slack, unstable, tension=sl.MinimumNorm())
    for radius in (None, 0.03):
        sl.inverse(suspended(4, radius=radius), places(4, 4))
    slanted = sl.Winch(0.05, swivel_axis=[[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]] * 4, dead_cable=3.0)
    turning = sl.load_robot("cogiro").replace(winches=slanted)
    there_and_back(turning, 4, 1)
    swivel_angles(turning)
    sl.inverse(turning.replace(winches=sl.Winch(0.05, dead_cable=0.3, on_platform=True)), poses_of(robot, 2, 1))
    cables()
    winches()
    meshes()


TABLE: Final[dict[str, Callable[[], None]]] = {
    "entries": entries,
    "corner cases": corner_cases,
    "random robots": random_robots,
    **{name: partial(preset, name) for name in sl.robot_names()},
}
