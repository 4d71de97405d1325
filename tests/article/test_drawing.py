"""Drawings of the report: legends beside the curves, marked values below the axis, maps of the size of errors."""

import re
from itertools import pairwise

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import sagline as sl
from sagline.article.drawing import axes, draw_errors, legend_above, logarithmic_with_floor, map_axes
from tests.article.conftest import Written
from tests.tiers import extended


def test_legends_are_outside_of_the_axes_and_on_the_sheet(either: Written) -> None:
    seen = 0
    for caption, figure in either.figures:
        figure.draw_without_rendering()
        for ax in figure.axes:
            key = ax.get_legend()
            if key is not None:
                box, sheet = key.get_window_extent(), figure.bbox
                assert box.y0 >= ax.bbox.y1 - 1.0, caption
                assert box.y1 <= sheet.y1, caption
                assert sheet.x0 <= box.x0, caption
                assert box.x1 <= sheet.x1, caption
                seen += 1
    assert seen > (40 if either.is_whole else 2)


def test_all_text_is_on_the_sheet_with_enough_contrast(either: Written) -> None:
    """Contrast of at least 4.5 with the card of the drawing in the dark theme."""
    for caption, figure in either.figures:
        for text in figure.findobj(matplotlib.text.Text):
            if text.get_text() and text.get_visible():
                red, green, blue = matplotlib.colors.to_rgb(text.get_color())
                assert contrast((red, green, blue), (0xF1 / 255, 0xF2 / 255, 0xF4 / 255)) >= 4.5, (caption, text)


def contrast(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    """Contrast ratio of the Web Content Accessibility Guidelines 2.2."""
    light = [
        sum(
            share * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)
            for share, c in zip((0.2126, 0.7152, 0.0722), color, strict=True)
        )
        for color in (one, other)
    ]
    return (max(light) + 0.05) / (min(light) + 0.05)


def test_a_legend_does_not_change_the_size_of_the_axes() -> None:
    figure, ax = axes("x", "y")
    before = ax.get_position().height * figure.get_figheight()
    for k in range(7):
        ax.plot([0.0, 1.0], [0.0, k], label=f"course {k}")
    legend_above(ax, "a title")
    assert ax.get_position().height * figure.get_figheight() == pytest.approx(before, rel=1e-12)


def strips(ax: Axes) -> list[tuple[float, float]]:
    boxes = [patch for patch in ax.patches if isinstance(patch, Rectangle)]
    return [(box.get_y(), box.get_y() + box.get_height()) for box in boxes]


def test_values_below_the_axis_are_shaded_and_stated() -> None:
    courses = np.array([[1e-12, 1e-7, 0.0, 3.0], [2.0, 5.0, 40.0, 1e-3]])
    _, ax = axes("x", "y")
    for course in courses:
        ax.plot(range(4), course)
    logarithmic_with_floor(ax, 1e-6, "below 1 nm")
    np.testing.assert_array_equal([line.get_ydata() for line in ax.get_lines()], courses)
    ((low, high),) = strips(ax)
    assert (low, high) == pytest.approx((ax.get_ylim()[0], 1e-6), rel=1e-9)
    assert ax.get_ylim()[1] > 40.0
    assert [text.get_text() for text in ax.texts] == ["below 1 nm"]
    order = min(patch.get_zorder() for patch in ax.patches)
    assert all(line.get_zorder() < order for line in ax.get_lines())  # curves continue below it


def test_no_strip_is_drawn_without_values_below_the_axis() -> None:
    _, ax = axes("x", "y")
    ax.plot([0, 1, 2], [1e-5, np.nan, 1.0])
    logarithmic_with_floor(ax, 1e-6, "below 1 nm")
    assert strips(ax) == []
    assert len(ax.texts) == 0


def figure_of(written: Written, caption: str) -> Figure:
    (figure,) = [figure for name, figure in written.figures if name == caption]
    return figure


@extended
@pytest.mark.parametrize(
    ("caption", "over"),
    [("Over the chord.", "chord"), ("Over the linear density.", "density"), ("Over the chord tension.", "tension")],
)
def test_curves_show_length_errors_of_any_size(written: Written, caption: str, over: str) -> None:
    """An elastic cable without weight stretches by Hooke's law; its length error is the sag of the exact cable."""
    ax = figure_of(written, caption).axes[0]
    lines = {str(line.get_label()): line for line in ax.get_lines()}
    x = np.asarray(lines["Elastic"].get_xdata(), dtype=np.float64)
    at = {"chord": 10.0, "density": 0.067, "tension": 100.0} | {over: x}
    angle = np.radians(-30.0)
    span, rise = at["chord"] * np.cos(angle), at["chord"] * np.sin(angle)
    exact = sl.Catenary().from_tension(sl.Cable(at["density"], 44e3), span, rise, at["tension"]).unstrained_length
    shallow = sl.Parabolic().from_tension(sl.Cable(at["density"], 44e3), span, rise, at["tension"]).unstrained_length
    hooke = at["chord"] / (1.0 + at["tension"] / 44e3)
    drawn = np.asarray(lines["Elastic"].get_ydata())
    np.testing.assert_allclose(drawn, 1e3 * np.abs(hooke - exact), rtol=1e-6, atol=1e-10)
    drawn = np.asarray(lines["Parabolic"].get_ydata())
    np.testing.assert_allclose(drawn, 1e3 * np.abs(shallow - exact), rtol=1e-6, atol=1e-10)
    assert drawn.min() < 1e-3  # less than a micrometer, where such curves are easily cut


@extended
def test_borders_of_the_sufficient_model_are_where_the_error_is_the_tolerance(written: Written) -> None:
    ax = figure_of(written, "Error over chord and tension.").axes[0]
    bands = {
        matplotlib.colors.to_hex(np.asarray(band.get_facecolor())[0]): band.get_paths()[0]
        for band in ax.collections
        if isinstance(band, QuadContourSet)
    }
    names = ("Parabolic", "Empirical", "Elastic", "Straight")
    assert len(bands) == len(names)
    random = np.random.default_rng(11)
    chord, tension = np.exp(random.uniform(np.log((1.0, 5.0)), np.log((30.0, 2000.0)), (400, 2))).T
    cable, (span, rise) = sl.Cable(0.067, 44e3), (chord * np.sqrt(0.75), -0.5 * chord)
    exact = sl.Catenary().from_tension(cable, span, rise, tension).unstrained_length
    for name, path in zip(names, bands.values(), strict=True):
        error = np.abs(getattr(sl, name)().from_tension(cable, span, rise, tension).unstrained_length - exact)
        clear = (error < 0.97e-3) | (error > 1.03e-3)
        inside = path.contains_points(np.column_stack((tension, chord)))
        np.testing.assert_array_equal(inside[clear], error[clear] < 1e-3, err_msg=name)


def test_a_map_is_filled_by_the_size_of_the_error_and_gray_where_it_is_too_small() -> None:
    """An error that falls linearly from +10 to −10 m: the width of each band is the range of its errors."""
    x = np.linspace(-10.0, 10.0, 2001)
    y = np.array([0.0, 1.0])
    edges = np.array([0.01, 0.1, 1.0])
    figure, ax = map_axes("x", "y")
    draw_errors(ax, x, y, np.stack((-x, -x)), edges, (0.01, 1.0), (1.0,))
    filled = next(drawn for drawn in ax.collections if isinstance(drawn, QuadContourSet))
    colors = np.array(filled.get_facecolor())
    place = np.array([-5.0, -0.5, -0.05, 0.003, 0.05, 0.5, 5.0])
    found = [k for at in place for k, path in enumerate(filled.get_paths()) if path.contains_point((at, 0.5))]
    assert len(found) == len(place)
    shown = colors[found]
    np.testing.assert_array_equal(shown[:3], shown[:3:-1])  # the sign has no effect on the color
    assert matplotlib.colors.to_hex(shown[3]) == "#bbbbbb"
    brightness = shown[:4, :3].sum(axis=1)
    assert all(a < b for a, b in pairwise(brightness[:3]))  # a darker color for a larger error
    labels = [text for text in ax.texts if text.get_text()]
    assert [text.get_text().replace("\u00a0", " ") for text in labels] == ["1 m"]
    assert labels[0].get_path_effects()
    assert re.search(r"\b10\smm$", figure.axes[1].get_ylabel())


@extended
@pytest.mark.parametrize("model", ["Straight", "Elastic", "Empirical", "Parabolic"])
def test_numbers_of_maps_are_inside_the_axes(written: Written, model: str) -> None:
    figure = figure_of(written, f"{model}: length error.")
    figure.draw_without_rendering()
    ax = figure.axes[0]
    names = [text for text in ax.texts if text.get_text()]
    assert len(names) >= 2
    for text in names:
        box = text.get_window_extent()
        assert ax.bbox.x0 <= box.x0, text
        assert box.x1 <= ax.bbox.x1, text
        assert ax.bbox.y0 <= box.y0, text
        assert box.y1 <= ax.bbox.y1, text


@extended
def test_the_first_picture_shows_the_numbers_of_the_study(written: Written) -> None:
    numbers = written.report.numbers["simulation"]["five-models"]["largest_error"]
    _, figure = written.figures[-1]
    ax = figure.axes[0]
    for robot in ("suspended", "mixed"):
        (line,) = [line for line in ax.get_lines() if line.get_label() == robot]
        np.testing.assert_array_equal(line.get_xdata(), [errors[f"{robot}_mm"] for errors in numbers.values()])
    assert [tick.get_text() for tick in ax.get_yticklabels()] == list(numbers)
    assert [text.get_text() for text in ax.texts].count("0 (rounding)") == 2
