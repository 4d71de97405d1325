from pathlib import Path

import numpy as np
import pytest

import sagline as sl
from tests.tiers import wide

METHODS = (
    sl.QuadraticProgram(weights=np.arange(1.0, 9.0), target=50.0),
    sl.PNorm(p=6.0),
    sl.PolygonWalk(optimum="1-norm"),
    sl.Centroid("horizontal"),
)


@pytest.mark.parametrize("method", wide(METHODS), ids=lambda method: type(method).__name__)
def test_a_plan_is_saved_with_its_tension_method(method: sl.TensionMethod, tmp_path: Path) -> None:
    plan = sl.inverse(sl.load_robot("article-mixed"), sl.Pose([1.0, -0.5, 2.5], np.eye(3)), tension=method)
    plan.save(tmp_path / "run.nc")
    loaded = sl.load_plan(tmp_path / "run.nc")
    assert type(loaded.tension) is type(method)
    assert (loaded.tension.variable, loaded.tension.parameter) == (method.variable, method.parameter)
    np.testing.assert_array_equal(loaded.tension.preference(8), method.preference(8))
    again = sl.inverse(plan.state.robot, plan.state.pose, tension=loaded.tension)
    np.testing.assert_array_equal(again.chord_tension, plan.chord_tension)
