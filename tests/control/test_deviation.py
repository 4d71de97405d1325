"""Deviations of an execution from its plan compared with numbers by hand."""

import numpy as np

import sagline as sl
from sagline.control import null_space, null_space_error, planned_position, position_error
from tests.files.executions import execution, plan_of


def test_the_planned_position_is_that_of_the_path_at_the_clock() -> None:
    done, plan = execution(), plan_of()
    assert plan.path is not None
    assert np.allclose(planned_position(done), plan.path.pose.position, rtol=0.0, atol=1e-15)
    between = np.interp(0.505, plan.path.time, plan.path.pose.position[:, 1])
    moved = {name: getattr(done, name) for name in done.__slots__} | {"clock": np.full(201, 0.505)}
    assert np.allclose(planned_position(sl.control.Execution(**moved))[:, 1], between, rtol=0.0, atol=1e-15)


def test_errors_are_measured_minus_planned_and_nan_without_a_plan() -> None:
    done, plan = execution(), plan_of()
    away = position_error(done)
    assert np.array_equal(np.isnan(away).any(axis=1), ~done.answered)
    assert np.nanmax(np.abs(away - (done.position - plan.state.pose.position))) < 1e-15
    beside = {name: getattr(done, name) for name in done.__slots__} | {"clock": np.full(201, np.nan)}
    assert np.isnan(position_error(sl.control.Execution(**beside))).all()
    assert np.isnan(null_space_error(sl.control.Execution(**beside))).all()


def test_constant_errors_of_lengths_are_visible_and_wrench_errors_are_not() -> None:
    """With a filter time of zero the error is not filtered; six of the eight directions are a wrench."""
    done, plan = execution(), plan_of()
    row = null_space(plan.state[0])
    mendable = 10.0 * np.linalg.svd(row.visible)[0][:, 0]  # the largest direction that lengths change
    wrench = np.linalg.svd(row.visible)[2][-1]  # in the null space of the matrix
    for error, wanted in ((mendable, row.visible @ mendable), (wrench, np.zeros(8))):
        held = {name: getattr(done, name) for name in done.__slots__}
        read = {name: getattr(done.samples, name) for name in done.samples.__slots__}
        held["samples"] = sl.control.Samples(**read | {"tension": done.planned_tension + error})
        held["clock"] = np.zeros(201)
        seen = null_space_error(sl.control.Execution(**held), filter_time=1e-12)
        assert np.allclose(seen, wanted, rtol=0.0, atol=1e-9)
        slow = null_space_error(sl.control.Execution(**held), filter_time=0.5)
        share = 1.0 - (0.5 / 0.51) ** np.arange(1, 202)  # first order, step by step
        assert np.allclose(slow, share[:, None] * wanted, rtol=0.0, atol=1e-9)
