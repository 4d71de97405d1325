"""Sets of velocities and accelerations, compared with linear programs, winch rates, and the inverse kinematics."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.calibration.machines import robots
from tests.refusal import refused
from tests.statics.test_sensitivities import planar, point

WINCH = {"drum_radius": 0.06, "gear": -10.0, "speed_limit": 300.0, "torque_limit": 12.0, "inertia": 4e-4}
PLACE = (1.0, 0.5, 1.5)


def driven(robot: sl.Robot, **more: object) -> sl.Robot:
    return robot.replace(winches=sl.Winch(**{**WINCH, **more}))  # type: ignore[arg-type]


def straight(robot: sl.Robot) -> tuple[sl.Equilibrium, Array]:
    """State with straight cables, and its length rates per motion of the origin (m, 6)."""
    pose = sl.Pose(PLACE, np.eye(3))
    if robot.name == "planar":
        pose = sl.Pose((0.4, 0.0, -0.3), Rotation.from_rotvec((0.0, 0.1, 0.0)))
    plan = sl.inverse(robot, pose, model=sl.Straight(), tension=sl.QuadraticProgram(target=400.0))
    assert plan.feasible
    levers = robot.platform_anchors @ pose.matrix.T
    along = pose.position + levers - robot.frame_anchors
    along /= np.linalg.norm(along, axis=1)[:, None]
    return plan.state, np.hstack((along, np.cross(levers, along)))


def directions(robot: sl.Robot, count: int = 12) -> Array:
    free = robot.freedom
    return np.random.default_rng(4).normal(size=(count, len(free))) @ free


def best(
    direction: Array, normals: Array, offsets: Array, equal: Array | None = None, to: Array | None = None
) -> float:
    found = linprog(-direction, normals, offsets, equal, to, bounds=[(None, None)] * len(direction), method="highs")
    assert found.status == 0
    return -float(found.fun)


@pytest.mark.parametrize("made", [lambda: sl.load_robot("cogiro"), planar, point], ids=["cogiro", "planar", "point"])
def test_speeds_are_those_of_a_linear_program(made) -> None:  # type: ignore[no-untyped-def]
    robot = driven(made())
    state, rates = straight(robot)
    found, free = sl.speed_set(state), robot.freedom
    slopes, limit = rates @ free.T, np.full(robot.cable_count, 300.0 / 10.0 * 0.06)
    normals, offsets = np.vstack((slopes, -slopes)), np.tile(limit, 2)
    for direction in directions(robot):
        unit = direction / np.linalg.norm(direction)
        expected = best(free @ unit, normals, offsets)
        assert float(found.extent(direction)) == pytest.approx(expected, rel=1e-6)
        fastest = (limit / np.abs(rates @ unit)).min()
        assert float(found.pure(direction)) == pytest.approx(fastest, rel=1e-6)
    inside = np.abs(found.corners @ rates.T) <= limit * (1.0 + 1e-6)
    assert inside.all()
    step = found.pure(directions(robot, 4000) @ np.diag([1, 1, 1, 0, 0, 0])).min()
    assert found.translation <= step <= 1.2 * found.translation


def test_the_volume_of_as_many_cables_as_motions() -> None:
    robot = driven(sl.without_cables(point(), 3))
    state = sl.inverse(robot, (-1.2, 0.8, 1.0), model=sl.Straight()).state
    ends = np.array([-1.2, 0.8, 1.0]) - robot.frame_anchors
    slopes = ends / np.linalg.norm(ends, axis=1)[:, None]
    expected = 8.0 * (30.0 * 0.06) ** 3 / abs(np.linalg.det(slopes))
    assert sl.speed_set(state).volume == pytest.approx(expected, rel=1e-6)


# a cable of the robot with pulleys is at its lower limit, where rates to both sides differ
@pytest.mark.parametrize(("name", "rtol"), [("cogiro", 1e-5), ("pulleys", 1e-3)])
def test_a_winch_reaches_its_limit_at_the_largest_speed(name: str, rtol: float) -> None:
    own = robots()[name]
    more = {} if own.winches is None else {"pulley_radius": own.winches.pulley_radius, "dead_cable": 3.0}
    robot = driven(own, **more)
    pose = sl.Pose([PLACE], np.eye(3))
    rest = sl.inverse(robot, sl.Path([0.0], pose, *np.zeros((2, 1, 6))))
    found = sl.speed_set(rest.state[0])
    for direction in np.eye(6)[:3]:
        twist = direction * found.pure(direction)
        moving = sl.inverse(robot, sl.Path([0.0], pose, twist[None], np.zeros((1, 6))))
        speed = np.abs(sl.winch_rates(moving).motor_speed)
        assert float(speed.max()) == pytest.approx(300.0, rel=rtol)


@pytest.mark.parametrize("limited", [False, True])
def test_accelerations_are_those_of_a_linear_program(limited: bool) -> None:
    robot = driven(sl.load_robot("cogiro"), **({} if limited else {"torque_limit": None}))
    state, rates = straight(robot)
    found, m, ratio = sl.acceleration_set(state), 8, -0.06 / 10.0
    center = robot.center_of_mass
    force = -rates[:, :3]
    cables = np.vstack((force.T, np.cross(robot.platform_anchors - center, force).T))  # wrench about the center of mass
    # a of the center of mass = a of the origin + alpha x c
    across = np.array([[0.0, center[2], -center[1]], [-center[2], 0.0, center[0]], [center[1], -center[0], 0.0]])
    mass = np.block([[robot.mass * np.eye(3), robot.mass * across], [np.zeros((3, 3)), robot.inertia]])
    equal = np.hstack((cables, -mass))  # unknowns: tensions, then acceleration of the origin
    weight = np.array([0.0, 0.0, robot.mass * robot.gravity, 0.0, 0.0, 0.0])
    normals = [np.hstack((sign * np.eye(m), np.zeros((m, 6)))) for sign in (1.0, -1.0)]
    offsets = [robot.tension_max, -robot.tension_min]
    if limited:
        torque = np.hstack((-ratio * np.eye(m), WINCH["inertia"] / ratio * rates))
        normals += [torque, -torque]
        offsets += [np.full(m, 12.0)] * 2
    for direction in directions(robot, 8):
        unit = direction / np.linalg.norm(direction)
        wanted = np.concatenate((np.zeros(m), unit))
        expected = best(wanted, np.vstack(normals), np.concatenate(offsets), equal, weight)
        assert float(found.extent(direction)) == pytest.approx(expected, rel=1e-6)


def test_the_largest_acceleration_of_sagging_cables_is_the_border_of_feasibility() -> None:
    robot = sl.load_robot("cogiro")
    state = sl.inverse(robot, PLACE).state
    found = sl.acceleration_set(state)
    for direction in ([0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]):
        load = np.zeros(6)
        load[:3] = -robot.mass * found.pure(direction) * np.array(direction)
        below, above = (sl.inverse(robot, PLACE, wrench=share * load) for share in (0.97, 1.03))
        assert below.feasible
        assert not above.feasible


def test_states_without_a_set() -> None:
    robot = driven(sl.load_robot("cogiro"))
    with refused("winches: speed_limit", "not given"):
        sl.speed_set(sl.load_robot("cogiro"), PLACE)
    with refused("winches: inertia", "not given"):
        sl.acceleration_set(driven(robot, inertia=None), PLACE)
    with refused("state", "2 poses", "a single pose"):
        sl.speed_set(sl.inverse(robot, [PLACE, PLACE]))
    with refused("state", "without a solution"):
        sl.speed_set(sl.inverse(robot, (0, 0, 40)))
    with refused("set of motions", "unbounded"):
        sl.acceleration_set(sl.load_robot("cogiro").replace(tension_max=np.inf), PLACE)
    # the programs of scipy accept this set, but Qhull finds no point that is clearly inside
    thin = [10.0, 2.5e-3, 100.0, 2e-10, 2e-7, 6.0, 160.0, 4e-9]
    with refused("set of motions", "without volume", "a bounded set with a volume"):
        sl.speed_set(driven(robot, speed_limit=thin), PLACE)
    found = sl.speed_set(planar_state())
    with refused("direction", "a forbidden motion"):
        found.pure((0, 1, 0))
    with refused("direction", "zero"):
        found.extent((0, 0, 0))


def planar_state() -> sl.Equilibrium:
    return straight(driven(planar()))[0]
