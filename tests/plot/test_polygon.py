import numpy as np
import pytest
from matplotlib.text import Annotation

import sagline as sl
from sagline import plot

MIXED = sl.load_robot("article-mixed")
POSE = sl.Pose([1.0, -0.5, 2.5], np.eye(3))


def test_polygon_shows_corners_limits_and_methods() -> None:
    shape = sl.tension_polygon(MIXED, POSE, model=sl.Elastic())
    plan = sl.inverse(MIXED, POSE, model=sl.Elastic(), tension=sl.Centroid())
    ax = plot.polygon(shape, {"Centroid": plan.chord_tension, "none": np.full(8, np.nan)})
    sides = [line for line in ax.get_lines() if line.get_marker() == "None"]
    drawn = np.array([np.asarray(line.get_xydata())[0] for line in sides])
    np.testing.assert_array_equal(drawn, shape.vertices)
    ends = np.array([np.asarray(line.get_xydata())[1] for line in sides])
    np.testing.assert_array_equal(ends, np.roll(shape.vertices, -1, axis=0))
    names = [text.get_text() for text in ax.texts if isinstance(text, Annotation)]
    assert names == [f"cable {side.cable} {side.limit}" for side in shape.sides if side is not None]
    (point,) = [line for line in ax.get_lines() if line.get_marker() != "None"]
    place = np.asarray(point.get_xydata())[0]
    np.testing.assert_allclose(shape.origin + place @ shape.basis, plan.chord_tension, atol=1e-8)


def test_nothing_to_draw() -> None:
    with pytest.raises(sl.InvalidValueError, match="0 points with 2 coordinates"):
        plot.polygon(sl.tension_polygon(MIXED, sl.Pose([9.0, 0, 1.5], np.eye(3))))
