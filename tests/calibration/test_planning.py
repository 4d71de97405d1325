"""Measurement poses: compared with random ones, whole forward solutions and slopes by differences; and refusals."""

import re
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

import sagline as sl
from sagline.calibration import planning
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.calibration.parameters import KINDS, parameters_of
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.machines import robots
from tests.calibration.reference import counts_of, pose_rows
from tests.calibration.synthetic import Truth, log_of, true_robot, usual_sensors, with_drums
from tests.refusal import refused
from tests.tiers import extended, wide

ANCHORS = ("frame_anchors", "platform_anchors", "length_zero")
MATERIAL = ("linear_density", "axial_stiffness", "mass", "center_of_mass")
ALL = (*ANCHORS, "drum_radius", *MATERIAL)  # 63 numbers
MACHINES = robots()
OFF = {"frame_anchors": 0.05, "platform_anchors": 0.02, "length_zero": 0.05, "drum_radius": 0.01}
OFF |= {"linear_density": 0.05, "axial_stiffness": 0.1, "mass": 0.05, "center_of_mass": 0.03}
PLANE = sl.PoseBox([-1.0, -0.5, -1.0], [1.0, 0.5, 1.0], 0.2)
ROOM = sl.PoseBox([-2.0, -1.0, 0.5], [2.0, 1.0, 2.5])


@cache
def chosen(name: str, count: int = 40, unknowns: tuple[str, ...] = ALL, seed: int = 0) -> sl.CalibrationPoses:
    return sl.calibration_poses(with_drums(name), count, unknowns, usual_sensors(), seed=seed)


def information_of(plan: sl.CalibrationPoses, pose: sl.Pose, lengths: Array) -> Array:
    """Information of poses on the parameters of a plan, in units of the priors, (P, P)."""
    numbers = plan.parameters
    unit = numbers.prior_deviation / np.where(numbers.logarithmic, numbers.prior, 1.0)
    matrix = predicted_rows(
        MachineTerms(plan.robot, sl.Catenary(), numbers, plan.sensors), pose_rows(pose), lengths
    ).matrix
    flat = (matrix * unit).reshape(-1, len(unit))
    found: Array = flat.T @ flat
    return found


@cache
def of_random_poses(name: str, count: int) -> list[Array]:
    """Information of random poses of the box with their own tensions, (P, P); several draws."""
    truth, found = Truth(with_drums(name), np.zeros(8), usual_sensors()), []
    for seed in range(5):
        log = log_of(truth, 4 * count, seed, sets=4)
        rows = 4 * np.arange(count) + np.arange(count) % 4
        found.append(information_of(chosen(name), log.pose[rows], log.length[rows]))
    return found


@pytest.mark.parametrize("name", wide(["cogiro", "article-suspended"]))
def test_poses_are_as_good_as_twice_the_number_of_random_ones(name: str) -> None:
    plan = chosen(name)
    prior = np.eye(63)
    own = prior + information_of(plan, plan.poses, plan.unstrained_length)
    double = [float(np.linalg.slogdet(prior + each)[1]) for each in of_random_poses(name, 80)]
    assert plan.gain[-1] == pytest.approx(np.linalg.slogdet(own)[1], rel=1e-9)
    assert plan.gain[-1] > max(double)
    # error by error, in directions that the same number of random poses determines
    single = of_random_poses(name, 40)
    size, vectors = np.linalg.eigh(np.mean(single, axis=0))
    known = vectors[:, size > 3.0]
    assert known.shape[1] >= 45
    usual = np.median([np.diag(known.T @ np.linalg.solve(prior + each, known)) for each in single], axis=0)
    shares = np.sqrt(np.diag(known.T @ np.linalg.solve(own, known)) / usual)
    assert np.exp(np.log(shares).mean()) <= 0.7
    assert np.median(shares) <= 0.7
    assert plan.share_of_random == pytest.approx(np.exp(np.log(shares).mean()), rel=0.15)


def test_errors_agree_with_slopes_by_differences() -> None:
    robot = MACHINES["drums"]
    unknowns = ("frame_anchors", "drum_radius", "load_cell_gain", "mass")
    sensors = sl.Sensors(5e-4, 4.0, 2e-3, 1e-3, target=(0.1, 0.2, -0.1))
    plan = sl.calibration_poses(robot, 3, unknowns, sensors, candidates=30)
    machine = reference.Machine(robot, sensors, np.zeros(8))
    model, m = sl.Catenary(), 8
    columns = []
    for name in unknowns:
        kind = KINDS[name]
        for cable in range(m if kind.each else 1):
            for axis in range(len(kind.axes)):
                columns.append(reference.slopes(machine, plan.poses, plan.unstrained_length, kind.first + axis, cable))
    slopes = np.stack(columns, axis=-1)
    slopes[..., 24] = slopes[..., 24:32].sum(axis=-1)  # one radius of all drums
    slopes = np.delete(slopes, range(25, 32), axis=-1)
    lengths = reference.by_lengths(machine, plan.poses, plan.unstrained_length, model)
    deviations = np.repeat([4.0, 2e-3, 1e-3], [8, 3, 3])
    scatter = np.diag(deviations**2) + 5e-4**2 * lengths @ np.swapaxes(lengths, -1, -2)
    prior = np.diag(np.repeat([0.05, 0.02, 0.07, 0.05], [24, 1, 8, 1]) ** 2)
    prior[25:33, 25:33] += 0.5 * 0.07**2 * (1.0 - np.eye(8))  # half of the variance is common to all load cells
    known = np.linalg.inv(prior) + (np.swapaxes(slopes, -1, -2) @ np.linalg.solve(scatter, slopes)).sum(axis=0)
    errors = np.sqrt(np.diag(np.linalg.inv(known)))
    assert robot.winches is not None
    assert robot.winches.drum_radius is not None
    errors[24] *= np.mean(robot.winches.drum_radius)
    errors[-1] *= robot.mass
    np.testing.assert_allclose(plan.expected_error, errors, rtol=1e-5)


def read_at(truth: Truth, plan: sl.CalibrationPoses, seed: int) -> sl.WinchLog:
    """Readings of a robot at the poses of a plan, with tensions as close to the plan as possible."""
    rng, robot = np.random.default_rng(seed), truth.robot
    wide = robot.replace(tension_min=1.0)
    methods = [sl.QuadraticProgram(target=tension) for tension in plan.frame_end_tension]
    stood = [sl.inverse(wide, pose, tension=method) for pose, method in zip(plan.poses, methods, strict=True)]
    noise = truth.sensors
    lengths = np.array([one.unstrained_length for one in stood])
    cells = np.array([one.state.cables.frame_end_tension for one in stood])
    believed = lengths + noise.length_deviation * rng.normal(size=lengths.shape)
    assert noise.tension_deviation is not None
    return sl.WinchLog(
        counts=counts_of(robot, believed),
        load_cells=cells + noise.tension_deviation * rng.normal(size=cells.shape),
        commanded=plan.poses,
        sensors=noise,
    )


def found_at(plan: sl.CalibrationPoses, unknowns: list[sl.Unknown], trials: int) -> tuple[Array, Array]:
    """Errors of calibrations of robots with errors drawn from the priors, (trials, P), and which converged."""
    off = {unknown.name: unknown.deviation or 0.0 for unknown in unknowns}
    errors, converged = [], []
    for seed in range(trials):
        truth = true_robot(plan.robot, off, seed)
        found = sl.calibrate(plan.robot, read_at(truth, plan, seed), unknowns, folds=0)
        errors.append(found.values - parameters_of(truth.robot, unknowns, truth.sensors, counted=True).prior)
        converged.append(found.status is not sl.CalibrationStatus.NOT_CONVERGED)
    return np.array(errors), np.array(converged)


@pytest.mark.parametrize(
    ("count", "kinds_off", "trials", "within"),
    [
        pytest.param(8, ("length_zero", *MATERIAL), 20, 0.09, marks=extended),
        pytest.param(40, ALL, 200, 0.03, marks=pytest.mark.soak),
    ],
)
def test_expected_errors_agree_with_calibrations(
    count: int, kinds_off: tuple[str, ...], trials: int, within: float
) -> None:
    unknowns = [sl.Unknown(name, deviation=OFF[name]) for name in kinds_off]
    plan = sl.calibration_poses(with_drums(), count, unknowns, usual_sensors())
    errors, converged = found_at(plan, unknowns, trials)
    assert converged.mean() >= 0.95
    scatter = errors[converged] / plan.expected_error
    assert np.sqrt((scatter**2).mean()) == pytest.approx(1.0, abs=within)
    assert np.mean(np.abs(scatter) < 1.0) == pytest.approx(0.683, abs=within)


@pytest.mark.parametrize("name", ["cogiro", "article-suspended"])
def test_poses_are_within_the_limits(name: str) -> None:
    plan = chosen(name)
    robot, box = plan.robot, plan.robot.test_box
    assert box is not None
    assert len(plan) == len(plan.poses) == 40
    assert ((plan.poses.position >= box.low - 1e-12) & (plan.poses.position <= box.high + 1e-12)).all()
    assert (plan.poses.rotation.magnitude() <= box.tilt + 1e-12).all()
    found = sl.forward(robot, plan.unstrained_length, start=plan.poses)
    assert found.solved.all()
    np.testing.assert_allclose(found.pose.position, plan.poses.position, atol=1e-7)
    np.testing.assert_allclose(found.state.cables.frame_end_tension, plan.frame_end_tension, rtol=1e-5)
    tension = found.state.chord_tension
    clear = 0.019 * (robot.tension_max - robot.tension_min)  # tensions of an uncalibrated robot are inaccurate
    assert (tension >= robot.tension_min + clear).all()
    assert (tension <= robot.tension_max - clear).all()


def test_sets_of_tensions_at_a_pose_are_in_a_short_order() -> None:
    plan = chosen("cogiro")
    moved = np.linalg.norm(np.diff(plan.poses.position, axis=0), axis=1)
    places = 1 + np.count_nonzero(moved)
    assert places == len(np.unique(plan.poses.position, axis=0)) < len(plan)
    still = np.flatnonzero(moved == 0.0)
    apart = np.abs(np.diff(plan.frame_end_tension, axis=0))[still].max(axis=1)
    assert (apart > 10.0).all()  # other tensions, not the same again
    rng = np.random.default_rng(0)
    order = [np.linalg.norm(np.diff(rng.permutation(plan.poses.position), axis=0), axis=1).sum() for _ in range(100)]
    assert moved.sum() < 0.5 * min(order)


def test_tensions_of_a_pose_differ_as_much_as_possible() -> None:
    plan = chosen("article-suspended")
    by_place: dict[tuple[float, ...], list[Array]] = {}
    for position, tension in zip(plan.poses.position, plan.frame_end_tension, strict=True):
        by_place.setdefault(tuple(position), []).append(tension)
    several = [np.array(tensions) for tensions in by_place.values() if len(tensions) > 1]
    assert len(several) >= 5
    spread = [np.ptp(tensions, axis=0).max() / tensions.max() for tensions in several]
    assert np.median(spread) > 0.3


def test_the_number_of_poses_ends_when_errors_no_longer_fall() -> None:
    plan = sl.calibration_poses(sl.load_robot("cogiro"), 60, ("mass", "center_of_mass"), usual_sensors())
    assert 1 < plan.enough < 60
    more = sl.calibration_poses(sl.load_robot("cogiro"), 30, ("mass", "center_of_mass"), usual_sensors())
    assert more.enough == 30


def test_the_same_seed_gives_the_same_poses() -> None:
    one, again, other = (sl.calibration_poses(sl.load_robot("cogiro"), 5, ("mass",), seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.poses.position, again.poses.position)
    assert np.abs(one.poses.position - other.poses.position).max() > 0.01


def test_progress_is_reported() -> None:
    heard: list[tuple[int, int]] = []
    sl.calibration_poses(sl.load_robot("cogiro"), 5, ("mass",), progress=lambda done, of: heard.append((done, of)))
    assert heard[-1][0] == heard[-1][1] > 0
    assert len(heard) >= 4


@pytest.mark.parametrize(("name", "box"), [("planar", PLANE), ("point", ROOM)], ids=["planar", "point"])
def test_robots_with_fewer_degrees_of_freedom(name: str, box: sl.PoseBox) -> None:
    robot = MACHINES[name]
    plan = sl.calibration_poses(robot, 12, ("frame_anchors", "mass"), box=box)
    assert sl.forward(robot, plan.unstrained_length, start=plan.poses).solved.all()
    assert (plan.expected_error <= plan.random_error * 1.2).all()
    if robot.plane_normal is not None:
        assert np.abs(plan.poses.position @ robot.plane_normal).max() < 1e-12
        axis = plan.poses.rotation.as_rotvec()
        np.testing.assert_allclose(np.cross(axis, robot.plane_normal), 0.0, atol=1e-12)
        assert np.linalg.norm(axis, axis=1).max() > 0.1
        across = [k for k, label in enumerate(plan.parameters.labels) if label.endswith(".y")]
        np.testing.assert_allclose(plan.expected_error[across], plan.parameters.prior_deviation[across], rtol=1e-6)
    else:
        np.testing.assert_allclose(plan.poses.matrix, np.broadcast_to(np.eye(3), (12, 3, 3)), atol=1e-15)


def test_cables_without_an_upper_limit() -> None:
    robot = sl.load_robot("cogiro").replace(tension_max=np.inf)
    plan = sl.calibration_poses(robot, 8, ("mass",), usual_sensors(), candidates=60)
    assert sl.forward(robot, plan.unstrained_length, start=plan.poses).solved.all()
    assert plan.frame_end_tension.max() < 1e5


def test_a_box_that_is_mostly_out_of_reach() -> None:
    robot = sl.load_robot("cogiro")
    box = sl.PoseBox([-9.0, -7.0, 0.5], [9.0, 7.0, 6.5], 0.3)
    plan = sl.calibration_poses(robot, 20, ("mass",), box=box, candidates=200)
    assert sl.forward(robot, plan.unstrained_length, start=plan.poses).solved.all()


def test_winches_with_little_cable_and_small_cells() -> None:
    robot = with_drums("cogiro", cable_length=11.5, load_cell_range=1500.0, load_cell_gain=1.25)
    plan = sl.calibration_poses(robot, 10, ("mass",), candidates=150)
    assert (plan.unstrained_length * (1.0 + 200.0 / 7e5) <= 11.5).all()
    assert (1.25 * plan.frame_end_tension <= 1500.0).all()


def test_default_sensors_are_the_usual_ones() -> None:
    robot = sl.load_robot("cogiro")
    plan = sl.calibration_poses(robot, 5, ("mass",))
    assert plan.sensors.tension_deviation is not None
    assert 1.0 <= float(plan.sensors.tension_deviation) <= 10.0
    information_of = robot.replace(winches=sl.Winch(load_cell_deviation=2.5))
    assert np.all(sl.calibration_poses(information_of, 5, ("mass",)).sensors.tension_deviation == 2.5)


def test_parameters_without_information_stay_undetermined() -> None:
    unknowns = (sl.Unknown("frame_anchors", deviation=np.inf), sl.Unknown("platform_anchors", deviation=np.inf), "mass")
    plan = sl.calibration_poses(sl.load_robot("cogiro"), 20, unknowns, usual_sensors())
    assert np.isinf(plan.expected_error[:48]).all()  # the position of the world is unknown
    assert plan.expected_error[48] < plan.parameters.prior_deviation[48]
    assert "–" in str(plan)
    measured = usual_sensors(position_deviation=1e-3, rotation_deviation=1e-3)
    assert np.isfinite(sl.calibration_poses(sl.load_robot("cogiro"), 20, unknowns, measured).expected_error).all()


@pytest.mark.parametrize("deviation", wide([1e-50, 1e50, 1e-9, 1e3], first=2))
def test_readings_and_priors_of_any_precision(deviation: float) -> None:
    robot = sl.load_robot("cogiro")
    for unknowns, sensors in (
        (("frame_anchors", "mass"), sl.Sensors(deviation, deviation, deviation)),
        ((sl.Unknown("frame_anchors", deviation=deviation), "mass"), usual_sensors()),
    ):
        plan = sl.calibration_poses(robot, 5, unknowns, sensors, candidates=40)
        assert (plan.expected_error > 0.0).all()
        assert (plan.expected_error <= plan.parameters.prior_deviation * (1.0 + 1e-9)).all()
        assert np.isfinite(plan.share_of_random)
        assert "nan" not in str(plan)


def changed(robot: sl.Robot, words: str) -> dict[str, Any]:
    """The unknowns with priors after a recommended measurement."""
    if "caliper on the pulleys" in words:
        return {"pulley_radius": 1e-4}
    if "weighing the platform" in words:
        return {"mass": 1e-3}
    raise AssertionError(words)


@extended
@pytest.mark.parametrize(
    ("unknowns", "position", "word"),
    [
        (("pulley_radius", "length_zero"), 1e-3, "caliper on the pulleys"),
        (("mass", "center_of_mass"), None, "platform"),
    ],
)
def test_the_first_recommended_measurement_reduces_errors_most(
    unknowns: tuple[str, ...], position: float | None, word: str
) -> None:
    robot = MACHINES["pulleys"].replace(winches=sl.Winch(0.1))
    wide = [sl.Unknown(name, deviation=1.0 if name == "mass" else None) for name in unknowns]
    sensors = sl.Sensors(5e-4, 50.0, position)
    plan = sl.calibration_poses(robot, 6, wide, sensors, candidates=60)
    assert word in plan.most_helpful, plan.most_helpful
    known = changed(robot, plan.most_helpful)
    held = [sl.Unknown(name, deviation=known.get(name, 1.0 if name == "mass" else None)) for name in unknowns]
    ratio = np.exp(np.log(_errors_at(plan, held) / plan.expected_error).mean())
    said = float(re.search(r"errors by ([\d.]+)", plan.most_helpful)[1])  # type: ignore[index]
    assert said == pytest.approx(ratio, abs=0.02)


def _errors_at(plan: sl.CalibrationPoses, unknowns: list[sl.Unknown]) -> Array:
    """Errors at the poses of a plan with other priors."""
    numbers = parameters_of(plan.robot, unknowns, plan.sensors, counted=plan.parameters.counted)
    unit = np.where(numbers.logarithmic, numbers.prior, 1.0)
    rows = pose_rows(plan.poses)
    matrix = (
        predicted_rows(
            MachineTerms(plan.robot, sl.Catenary(), numbers, plan.sensors), rows, plan.unstrained_length
        ).matrix
        / unit
    )
    flat = matrix.reshape(-1, len(unit))
    errors: Array = np.sqrt(np.diag(np.linalg.inv(np.diag(numbers.prior_deviation**-2.0) + flat.T @ flat)))
    return errors


def test_the_cheaper_measurement_is_recommended_if_it_is_sufficient() -> None:
    unknowns = [sl.Unknown(name) for name in MATERIAL]
    plan = sl.calibration_poses(with_drums("article-suspended"), 40, unknowns, usual_sensors())
    left = {}
    for name, known in (("mass", 1e-3), ("linear_density", 0.01)):
        held = [sl.Unknown(one, deviation=known if one == name else None) for one in MATERIAL]
        left[name] = float(np.log(_errors_at(plan, held) / plan.expected_error).mean())
    assert 0.9 * left["linear_density"] > left["mass"] > left["linear_density"]  # slightly better, with twice the work
    assert "weighing" in plan.most_helpful
    assert "platform" in plan.most_helpful


def test_load_cells_are_recommended_if_missing() -> None:
    robot = sl.load_robot("cogiro")
    sensors = sl.Sensors(5e-4, None, 1e-2)
    plan = sl.calibration_poses(robot, 10, ("axial_stiffness", "center_of_mass"), sensors)
    assert "load cells" in plan.most_helpful


@pytest.mark.parametrize("name", wide(["cogiro", *(name for name in sl.robot_names() if name != "cogiro")]))
def test_texts_fit_a_terminal(name: str) -> None:
    robot = sl.load_robot(name)
    plan = sl.calibration_poses(robot, 6, candidates=30)
    text, lines = str(plan), plan.table().splitlines()
    assert max(map(len, text.splitlines())) <= 80, text
    assert max(map(len, lines)) <= 80, lines
    narrow = planning.poses_text(plan, 60)
    assert max(map(len, [*narrow.splitlines(), *planning.poses_table(plan, 60).splitlines()])) <= 60, narrow
    assert narrow.split() == text.replace("standard errors", "errors").split()
    assert re.findall(rf"\d+|{name}", text.partition(":")[0]) == ["6", str(len(plan.parameters.names)), name]
    per = 1 if robot.cable_count <= 8 else 2
    assert len(lines) == 1 + 7 * per
    first = [float(cell) for cell in lines[1 + per].split()]
    np.testing.assert_allclose(first[1:4], plan.poses.position[0], atol=0.051)


class Refused(NamedTuple):
    """Arguments, and parts of the error: the item, the beginning of its value, the beginning of the allowed range."""

    given: dict[str, Any]
    item: str
    value: str
    allowed: str = ""


REFUSED = [
    Refused({"count": 0}, "count", "0", "1 to 1000"),
    Refused({"count": 1001}, "count", "1001", "1 to 1000"),
    Refused({"candidates": 4}, "candidates", "4", "5 to 20000"),
    Refused({"robot": MACHINES["point"]}, "box", "missing", "a PoseBox"),
    Refused({"box": sl.PoseBox([50, 50, 50], [60, 60, 60])}, "box", "without a pose .*tensions", "a box with"),
    Refused({"robot": MACHINES["point"], "box": PLANE}, "box: tilt", "0.2 rad", "0 rad, because"),
    Refused({"sensors": sl.Sensors()}, "sensors", "lengths alone", "load cells"),
    Refused(
        {"unknowns": ("load_cell_gain",), "sensors": sl.Sensors(5e-4, None, 1e-3)},
        "unknown: load_cell_gain",
        "observed by no reading",
        "load cells",
    ),
    Refused({"unknowns": ("measuring_frame",)}, "unknown: measuring_frame", "observed by no reading", "positions"),
    Refused(
        {"unknowns": ("target",), "sensors": sl.Sensors(5e-4, 5.0, None, 1e-3)},
        "unknown: target",
        "observed by no reading",
    ),
    Refused({"unknowns": ()}, "unknowns", "none"),
    Refused({"unknowns": ("color",)}, "unknown", "'color'", "frame_anchors"),
    Refused({"unknowns": {"mass": 1.0}}, "unknowns", r"\{'mass': 1.0\}"),
    Refused({"robot": with_drums(cable_length=5.0)}, "box", "without a pose .*not have enough cable"),
]


@pytest.mark.parametrize("case", REFUSED, ids=[f"{k}" for k in range(len(REFUSED))])
def test_refused(case: Refused) -> None:
    arguments: dict[str, Any] = {"robot": sl.load_robot("cogiro"), "count": 5, "unknowns": ("mass",), **case.given}
    with refused(case.item, kind=sl.InvalidValueError) as caught:
        sl.calibration_poses(**arguments)
    assert re.match(case.value, caught.value.value)
    assert caught.value.allowed.startswith(case.allowed)
    assert case.item != "box" or "box=PoseBox" in caught.value.next_step
    assert len(str(caught.value)) < 300


def test_more_poses_than_are_feasible() -> None:
    box = sl.PoseBox([-15.0, -15.0, 0.5], [15.0, 15.0, 4.5])
    with refused("count", kind=sl.InvalidValueError) as caught:
        sl.calibration_poses(sl.load_robot("cogiro"), 200, ("mass",), box=box, candidates=200)
    count, feasible, candidates = re.findall(r"\d+", caught.value.value)
    assert (count, candidates) == ("200", "200")
    assert caught.value.allowed == f"1 to {feasible}"
