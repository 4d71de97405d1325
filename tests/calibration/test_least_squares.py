"""The least squares compared with a plain fit that has all lengths as unknowns and slopes by differences."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import sagline as sl
from sagline.calibration.calibrate import _active_sensors
from sagline.calibration.least_squares import _predict_state, evaluate_step, solve
from sagline.calibration.log import load_cells_of
from sagline.calibration.observations import Readings
from sagline.calibration.parameters import parameters_of, with_values
from sagline.calibration.problem import Fit, FitProblem, SearchState, start_of
from sagline.core.arrays import Array
from tests.calibration import reference
from tests.calibration.machines import robots, standing
from tests.calibration.synthetic import Synthetic, log_of, true_robot, usual_sensors, with_drums
from tests.tiers import extended, wide

NOMINAL = {"drums": with_drums(), "drums behind pulleys": with_drums(pulley_radius=0.04, dead_cable=2.0)}
ERRORS = {"frame_anchors": 0.02, "axial_stiffness": 0.05, "mass": 0.02}
UNKNOWNS = [sl.Unknown(name, deviation=error) for name, error in ERRORS.items()]


def problem_of(made: Synthetic, unknowns: list[sl.Unknown], nominal: sl.Robot) -> FitProblem:
    sensors = _active_sensors(made.log)
    parameters = parameters_of(nominal, unknowns, sensors, counted=made.log.counts is not None)
    return FitProblem(nominal, sl.Catenary(), sensors, parameters, Readings.of(made.log))


def fitted(problem: FitProblem, made: Synthetic, *, robust: bool = False) -> Fit:
    kept = np.ones(len(made.log), dtype=np.bool_)
    begun = evaluate_step(problem, start_of(problem, made.log.commanded), None, kept)
    return solve(problem, begun, kept, robust=robust)


def errors_of(problem: FitProblem, fit: Fit) -> Array:
    """Standard errors of the internal parameters, (P,)."""
    information = fit.normal.matrix + np.diag(problem.parameters.internal_deviation**-2.0)
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(information))))


def plain_fit(problem: FitProblem, made: Synthetic, fit: Fit) -> Array:
    """Parameters and lengths by a least squares library for the same sum of squares, by public functions."""
    log, sensors, poses = made.log, problem.sensors, made.pose
    assert log.counts is not None
    assert log.load_cells is not None
    assert sensors.tension_deviation is not None
    counts, cells, tension = log.counts, log.load_cells, sensors.tension_deviation
    width = len(problem.prior)

    def misses(x: Array) -> Array:
        numbers, lengths = x[:width], x[width:].reshape(cells.shape)
        robot = with_values(problem.robot, problem.parameters, problem.parameters.external(numbers))
        said = sl.lengths_from_counts(robot, counts)
        found = sl.forward(robot, lengths, poses)
        assert found.solved.all()
        return np.concatenate(
            (
                ((cells - found.state.cables.frame_end_tension) / tension).ravel(),
                ((lengths - said) / sensors.length_deviation).ravel(),
                (numbers - problem.prior) / problem.parameters.internal_deviation,
            )
        )

    scale = np.concatenate((problem.parameters.internal_deviation, np.full(cells.size, 1e-3)))
    begin = np.concatenate((fit.state.numbers + 1e-4 * scale[:width], fit.state.lengths.ravel()))
    answer = least_squares(misses, begin, jac="3-point", x_scale=scale, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    found: Array = answer.x
    return found


@pytest.mark.parametrize("name", wide(NOMINAL))
def test_the_minimum_is_that_of_a_plain_fit_with_all_lengths(name: str) -> None:
    made = log_of(true_robot(NOMINAL[name], ERRORS, 3), 4, 3, sets=4)
    problem = problem_of(made, UNKNOWNS, NOMINAL[name])
    fit = fitted(problem, made)
    assert fit.converged
    width = len(problem.prior)
    plain = plain_fit(problem, made, fit)
    error = errors_of(problem, fit)
    assert (np.abs(plain[:width] - fit.state.numbers) / error).max() < 1e-3
    assert np.abs(plain[width:] - fit.state.lengths.ravel()).max() < 1e-6  # of 0.5 mm standard deviation of a length


@extended
def test_parameters_respect_lower_bounds_and_the_others_are_optimal() -> None:
    """No pulleys, and lengths that favor negative radii: the conditions of Karush, Kuhn and Tucker."""
    small = with_drums(pulley_radius=0.001)
    made = log_of(true_robot(with_drums(pulley_radius=0.0), {}, 1), 12, 1)
    shifted = made._replace(log=made.log.replace(counts=made.log.readings - 200.0))
    problem = problem_of(shifted, [sl.Unknown("pulley_radius", deviation=0.02, shared=False)], small)
    kept = np.ones(12, dtype=np.bool_)
    begun = evaluate_step(problem, start_of(problem, made.log.commanded), None, kept)
    fit = solve(problem, begun, kept, robust=False)
    assert fit.converged
    numbers = fit.state.numbers
    at_least = numbers == 0.0
    assert 0 < at_least.sum() < len(numbers)
    assert numbers.min() == 0.0
    downhill = fit.normal.gradient - (numbers - problem.prior) / problem.parameters.internal_deviation**2
    assert (downhill[at_least] < 0.0).all()
    assert np.abs(downhill[~at_least] * errors_of(problem, fit)[~at_least]).max() < 0.01


@pytest.mark.parametrize("name", wide(NOMINAL))
@pytest.mark.parametrize("seed", range(3))
def test_an_outlying_pose_has_less_weight_and_little_influence(seed: int, name: str) -> None:
    nominal = NOMINAL[name]
    true = true_robot(nominal, ERRORS, seed)
    honest = log_of(true, 40, seed)
    slipped = log_of(true, 40, seed, slips={(7, 2): 0.02})
    fits = [fitted(problem_of(made, UNKNOWNS, nominal), made, robust=True) for made in (honest, slipped)]
    assert fits[1].normal.weights[7] < 0.3
    assert np.delete(fits[1].normal.weights, 7).min() > 0.6
    error = errors_of(problem_of(honest, UNKNOWNS, nominal), fits[0])
    assert (np.abs(fits[1].state.numbers - fits[0].state.numbers) / error).max() < 1.5


@pytest.mark.parametrize("name", wide(NOMINAL))
def test_lengths_follow_their_readings_by_their_precision(name: str) -> None:
    true = true_robot(NOMINAL[name], {}, 0, usual_sensors(length_deviation=1e-6))
    made = log_of(true, 8, 2)
    fit = fitted(problem_of(made, UNKNOWNS, NOMINAL[name]), made)
    assert np.abs(fit.state.lengths - made.length).max() < 1e-4
    assert fit.normal.squares.sum() < 3.0 * made.log.readings.size


ALL = (
    "frame_anchors",
    "platform_anchors",
    "length_zero",
    "linear_density",
    "axial_stiffness",
    "mass",
    "center_of_mass",
)


def missed_after(name: str, share: float) -> tuple[float, float]:
    """Motion of the platforms for a partial step of all parameters, and distance to the predicted positions [m]."""
    machine, pose, lengths = standing(robots()[name])
    robot, model = machine.robot, sl.Catenary()
    given = sl.Sensors(length_deviation=5e-4, tension_deviation=5.0)
    gain, bias = load_cells_of(robot)
    cells = (
        gain * sl.forward(robot, lengths, pose).state.cables.frame_end_tension + bias
    )  # correct values stay unchanged
    silent = np.full((len(lengths), 3), np.nan), np.full((len(lengths), 4), np.nan)
    problem = FitProblem(
        robot,
        model,
        given,
        parameters_of(robot, ALL, given, counted=False),
        Readings(lengths, cells, *silent),
    )
    before = SearchState(problem.prior, problem.machine_at(problem.prior), lengths, reference.pose_rows(pose))
    step = share * 0.02 * problem.scale * np.cos(np.arange(len(problem.prior)))
    after, part = problem.machine_at(problem.prior + step), slice(0, len(lengths))
    found, starts = _predict_state(problem, before, None, step, after, problem.reported_lengths(after, part), part)
    rest = sl.forward(after.robot, found, sl.Pose.from_quaternion(starts[:, :3], starts[:, 3:]), model)
    assert rest.stable.all()
    ended = reference.pose_rows(rest.pose)
    far, left = ended - before.poses, ended - starts
    return float(np.abs(far).max()), float(np.abs(left).max())


@pytest.mark.parametrize("name", wide(["cogiro", "article-suspended", "planar", "point", "pulleys"], first=4))
def test_a_step_starts_at_the_poses_predicted_by_slopes(name: str) -> None:
    moves, misses = zip(*(missed_after(name, share) for share in (1.0, 0.5)), strict=True)
    assert misses[0] < 0.15 * moves[0]
    assert 3.5 < misses[0] / misses[1] < 4.5  # the remainder is of second order
