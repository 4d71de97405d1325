"""A slice as a picture: colors and lines of the margins."""

import numpy as np
import pytest

from sagline.viewer.slices import APART, FINER, INSIDE_OPACITY, OUTSIDE_OPACITY, MarginScale
from sagline.viewer.tension_scale import ForceUnit
from sagline.workspaces.levels import Plane, slice_of
from tests.viewer.analytic import PER_METER, RADIUS, WALL, ball

LOW, HIGH = np.array([-2.0, -1.8, -1.9]), np.array([0.9, 2.0, 2.0])
SCALE, UNIT = MarginScale(25.0), ForceUnit("N", 1.0, ".1f")


@pytest.mark.parametrize("normal", [0, 1, 2])
def test_lines_are_at_round_margins(normal: int) -> None:
    cut = slice_of(ball, Plane(normal, 0.3), LOW, HIGH, (40, 40))
    _, boundary, lines, _ = SCALE.picture(cut, UNIT)
    assert np.all(boundary[..., normal] == 0.3)
    np.testing.assert_allclose(np.linalg.norm(boundary, axis=-1), RADIUS, atol=5e-3)
    steps = PER_METER * (RADIUS - np.linalg.norm(lines, axis=-1)) / SCALE.step
    np.testing.assert_allclose(steps, np.rint(steps), atol=0.05)
    assert set(np.rint(steps).astype(int).ravel()) == {-1, 1, 2, 3}
    lengths = np.linalg.norm(boundary[:, 1] - boundary[:, 0], axis=1)
    assert lengths.max() < 0.2  # nothing joins the end of a line to the begin of the next


def test_lines_have_their_margins_without_overlap() -> None:
    cut = slice_of(ball, Plane(2, 0.0), LOW, HIGH, (60, 60))
    marks = SCALE.picture(cut, UNIT)[3]
    assert [text for text, _ in marks] == ["0 N", "−25 N", "25 N", "50 N", "75 N"]
    places = np.array([place for _, place in marks])
    margins = ball(places).margin
    np.testing.assert_allclose(margins, [float(text[:-2].replace("−", "-")) for text, _ in marks], atol=1.0)
    away = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(places), 1)]
    assert away.min() >= APART * 3.8


def test_each_pixel_has_the_color_of_its_margin() -> None:
    cut = slice_of(ball, Plane(2, 0.0), LOW, HIGH, (30, 30))
    image = SCALE.picture(cut, UNIT)[0]
    count = FINER * 29
    assert image.shape == (count, count, 4)
    x = LOW[0] + (np.arange(count) + 0.5) / count * (HIGH[0] - LOW[0])
    y = LOW[1] + (np.arange(count) + 0.5) / count * (HIGH[1] - LOW[1])
    places = np.stack([*np.meshgrid(x, y), np.zeros((count, count))], axis=-1).reshape(-1, 3)
    margin = ball(places).margin.reshape(count, count)
    sure = np.abs(margin / SCALE.step - np.rint(margin / SCALE.step)) > 0.2  # not beside a line
    np.testing.assert_array_equal(image[..., :3][sure], SCALE.colors(margin)[sure])
    np.testing.assert_array_equal(image[..., 3][sure], np.where(margin >= 0.0, INSIDE_OPACITY, OUTSIDE_OPACITY)[sure])


def test_singular_poses_are_outside() -> None:
    cut = slice_of(ball, Plane(2, 0.0), LOW, np.array([1.9, 2.0, 2.0]), (60, 60))
    assert np.isinf(cut.margin).any()
    boundary = SCALE.picture(cut, UNIT)[1]
    assert np.isfinite(boundary).all()
    assert boundary[..., 0].max() == pytest.approx(WALL, abs=0.07)  # within a cell


def test_a_slice_outside_has_no_boundary() -> None:
    image, boundary, *_ = SCALE.picture(slice_of(ball, Plane(2, 1.8), LOW, HIGH, (10, 10)), UNIT)
    assert boundary.shape == (0, 2, 3)
    assert np.all(image[..., 3] == OUTSIDE_OPACITY)


def test_bands_are_round_and_named() -> None:
    assert [MarginScale.up_to(largest).step for largest in (90.0, 810.0, 0.0, np.inf, 3.9e4)] == [20, 200, 1, 1, 5000]
    scale = MarginScale.up_to(810.0)
    assert scale.bands(np.array([-np.inf, -201.0, -1.0, -1e-5, 0.0, 199.0, 200.0, 599.0, 601.0, np.inf])).tolist() == [
        0, 0, 1, 2, 2, 2, 3, 4, 5, 5,
    ]  # fmt: skip
    key = scale.key(ForceUnit("N", 1.0, ".1f"))
    names = ("below −200", "−200 to 0", "0 to 200", "200 to 400", "400 to 600", "above 600")
    assert all(f"</span> {name}</span>" in key for name in names)
