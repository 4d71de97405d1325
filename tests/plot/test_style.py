"""Figures of journals and slides: widths, fonts, names at the ends of lines, and text as text."""

import re
import zlib
from base64 import b64decode
from io import BytesIO
from pathlib import Path as FilePath
from typing import Any

import matplotlib
import numpy as np
import pytest
from fontTools.ttLib import TTFont
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from scipy.optimize import lsq_linear

import sagline as sl
from sagline import InvalidValueError, plot
from sagline.plot.labels import spread_heights
from tests.plot import made
from tests.refusal import refused
from tests.tiers import extended, wide

ROBOT = sl.load_robot("article-suspended")
PATH = sl.article_path(rate=5.0)
WIDTHS = {  # in, from the instructions of publishers: 394.36 pt and 525.5 pt of 1/72.27 in for MDPI
    ("ieee", 1): 3.5, ("ieee", 2): 7.16, ("mdpi", 1): 394.36 / 72.27, ("mdpi", 2): 525.5 / 72.27,
}  # fmt: skip


def figure_of(drawn: Axes | Figure) -> Figure:
    figure = drawn if isinstance(drawn, Figure) else drawn.get_figure(root=True)
    assert isinstance(figure, Figure)
    return figure


def ends(ax: Axes) -> dict[str, Annotation]:
    return {text.get_text(): text for text in ax.texts if isinstance(text, Annotation)}


@extended
@pytest.mark.parametrize(("name", "columns"), WIDTHS)
def test_figures_have_the_width_of_the_column(name: str, columns: int) -> None:
    with plot.style(name, columns) as look:
        drawn = (
            plot.velocity(PATH),
            plot.path(PATH),
            plot.overview(made.plan()),
            plot.small_multiples(made.plan()),
            Figure(),
        )
        sizes = [figure_of(each).get_size_inches() for each in drawn]
    assert look.width == pytest.approx(WIDTHS[name, columns], abs=0.01)
    assert {width for width, _ in sizes} == {look.width}
    assert max(height for _, height in sizes) <= 9.0


@pytest.mark.parametrize("name", wide(["slides", "ieee", "mdpi"]))
def test_text_is_large_enough_and_its_font_exists(name: str) -> None:
    with plot.style(name) as look:
        figure = figure_of(plot.tensions(made.plan()))
    figure.draw_without_rendering()  # tick labels are created here, after the style has ended
    texts: list[Any] = [text for text in figure.findobj(Text) if text.get_text()]
    assert {text.get_fontfamily()[0] for text in texts} == {look.font}
    assert {text.get_fontsize() for text in texts} == {look.label, look.tick}
    assert min(look.label, look.tick) >= (14.0 if name == "slides" else 8.0)


def test_previous_settings_are_restored() -> None:
    before, plain = dict(matplotlib.rcParams), figure_of(plot.velocity(PATH)).get_figwidth()
    ieee = plot.style("ieee")
    with pytest.raises(ZeroDivisionError), ieee:
        _ = 1 / 0
    with ieee, plot.style("slides"), ieee:  # the same style again, also inside itself
        assert figure_of(plot.velocity(PATH)).get_figwidth() == 3.5
    assert dict(matplotlib.rcParams) == before
    assert figure_of(plot.velocity(PATH)).get_figwidth() == plain == 4.7

    @plot.style("mdpi")
    def drawn() -> Axes:
        return plot.velocity(PATH)

    assert figure_of(drawn()).get_figwidth() == pytest.approx(5.45)


@pytest.mark.parametrize(
    ("name", "columns", "item", "value", "allowed"),
    [
        ("nature", 1, "name", "'nature'", "ieee, mdpi, slides"),
        ("ieee", 3, "columns", "3", "1 to 2"),
        ("ieee", 1.5, "columns", "1.5", "a whole number, 1 to 2"),
    ],
)
def test_unknown_styles(name: str, columns: int, item: str, value: str, allowed: str) -> None:
    with refused(item, value, allowed, kind=InvalidValueError):
        plot.style(name, columns)  # at once, before it is used


def test_names_are_at_the_ends_of_lines() -> None:
    with plot.style("ieee"):
        ax = plot.tensions(made.plan())
    assert ax.get_legend() is None
    names = ends(ax)
    assert set(names) == {"cable", *map(str, range(8))}
    figure_of(ax).draw_without_rendering()
    lines = {str(line.get_label()).removeprefix("cable "): line for line in ax.get_lines()}
    boxes = {name: Text.get_window_extent(text) for name, text in names.items()}
    for name, line in lines.items():
        assert names[name].xy == tuple(np.asarray(line.get_xydata())[-1])
        assert names[name].get_color() == line.get_color()
        assert boxes[name].x0 > ax.bbox.x1  # beside the axes, not on the lines
    middles = {name: 0.5 * (box.y0 + box.y1) for name, box in boxes.items() if name != "cable"}
    last = [float(np.asarray(lines[name].get_ydata())[-1]) for name in sorted(middles, key=middles.__getitem__)]
    assert np.diff(last).min() > -1e-9 * last[-1]  # in the order of the lines; cables 0 and 4 have the same end
    assert np.diff(sorted(middles.values())).min() > 0.9 * 8.0 * figure_of(ax).dpi / 72.0  # separated by their height


@extended
def test_a_legend_is_drawn_if_lines_end_elsewhere() -> None:
    x = np.array([0.0, 7.3])  # m: outside at the end, so that lines end earlier
    times, count = np.linspace(0.0, 1.0, 8), 8
    places = np.column_stack((np.repeat(x, [4, 4]), np.zeros(count), np.full(count, 1.5)))
    plan = sl.inverse(ROBOT, sl.Path(times, sl.Pose(places, np.eye(3)), np.zeros((8, 6)), np.zeros((8, 6))))
    assert plan.feasible.tolist() == [True] * 4 + [False] * 4
    with plot.style("ieee"):
        ax = plot.tensions(plan)
    legend = ax.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [*(f"cable {i}" for i in range(8)), "infeasible"]
    figure = figure_of(ax)
    figure.draw_without_rendering()
    box = legend.get_window_extent()
    assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert box.y0 >= ax.bbox.y1


def test_names_are_as_near_as_possible() -> None:
    generator = np.random.default_rng(8)
    for count in (1, 2, 5, 8):
        for _ in range(20):
            heights = generator.uniform(0.0, 1.0, count) ** generator.integers(1, 4)
            spacing = float(generator.uniform(0.02, 0.99 / count))
            placed = spread_heights(heights, spacing)
            order = np.argsort(heights, kind="stable")
            # the lowest one, and gaps between neighbors beyond the spacing; the upper end bounds their sum
            free = np.tril(np.ones((count, count)))
            steps = spacing * np.arange(count)
            best = lsq_linear(free, heights[order] - steps, bounds=([-9.0] + [0.0] * (count - 1), np.inf), tol=1e-13).x
            wanted = np.clip(free @ best, 0.5 * spacing, 1.0 - 0.5 * spacing - steps[-1]) + steps
            np.testing.assert_allclose(placed[order], wanted, atol=1e-6)
            assert np.diff(placed[order]).min(initial=1.0) > spacing - 1e-9


@extended
def test_long_labels_are_broken_at_a_word() -> None:
    with plot.style("ieee"):
        figure = plot.overview(made.plan())
    figure.draw_without_rendering()
    for ax in figure.axes:
        assert ax.yaxis.label.get_window_extent().height <= ax.bbox.height * 1.02, ax.get_ylabel()
        assert all(line.count("$") % 2 == 0 for line in ax.get_ylabel().split("\n"))


@extended
def test_lines_of_slides_are_thicker_once() -> None:
    plain = plot.velocity(PATH).get_lines()[0].get_linewidth()
    with plot.style("slides") as look:
        ax = plot.velocity(PATH)
    for _ in range(3):
        figure_of(ax).draw_without_rendering()
    assert ax.get_lines()[0].get_linewidth() == pytest.approx(look.line * plain)


@extended
def test_text_of_an_svg_is_text_with_an_embedded_font(tmp_path: FilePath) -> None:
    with plot.style("ieee"):
        ax = plot.tensions(made.plan(), "horizontal_tension")
    plot.save(ax, tmp_path / "a.svg")
    svg = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert ">time [s]</text>" in svg
    fonts = dict(re.findall(r"font-style:(\w+).*?base64,([^)]+)\) format\('woff'\)", svg))
    assert set(fonts) == {"normal", "italic"}
    letters = {style: set(TTFont(BytesIO(b64decode(font))).getBestCmap()) for style, font in fonts.items()}
    assert set(map(ord, "".join(re.findall(r">([^<\n]+)</text>", svg)))) <= letters["normal"]
    assert {ord("T"), ord("x")} <= letters["italic"]
    assert len(svg) < 100_000
    plot.save(ax, tmp_path / "b.svg")
    assert (tmp_path / "b.svg").read_bytes() == (tmp_path / "a.svg").read_bytes()


@extended
def test_text_of_a_pdf_is_text_with_embedded_fonts(tmp_path: FilePath) -> None:
    with plot.style("ieee"):
        ax = plot.velocity(PATH)
    plot.save(ax, tmp_path / "a.pdf")
    content = (tmp_path / "a.pdf").read_bytes()
    assert b"/Type3" not in content.replace(b" ", b"")
    assert len(re.findall(rb"/FontFile2 \d+ 0 R", content)) == 2  # upright and italic
    assert re.search(rb"/MediaBox \[ 0 0 252 ", content)  # 3.5 in
    streams = [
        zlib.decompressobj().decompress(part) for part in re.findall(rb"stream\r?\n(x.*?)endstream", content, re.S)
    ]
    page = b"".join(part for part in streams if b" Tf" in part)
    assert len(re.findall(rb"T[jJ]\b", page)) >= 10  # labels and numbers are text


def test_small_multiples_show_each_cable_before_all_others() -> None:
    figure = plot.small_multiples(made.plan(), "adjusting_length")
    values = 1e3 * made.plan().state.cables.adjusting_length
    for i, ax in enumerate(figure.axes):
        *others, own = ax.get_lines()
        np.testing.assert_array_equal(own.get_ydata(), values[:, i])
        np.testing.assert_array_equal([line.get_ydata() for line in others], np.delete(values, i, axis=1).T)
        assert ax.get_title(loc="left") == f"cable {i}"
        assert ax.get_ylim() == figure.axes[0].get_ylim()


@extended
def test_limits_within_the_axes_are_dotted() -> None:
    tight = ROBOT.replace(tension_max=float(made.plan().chord_tension.max()) * 1.001)
    figure = plot.small_multiples(sl.inverse(tight, PATH))
    heights = [np.asarray(line.get_ydata())[0] for line in figure.axes[0].get_lines() if line.get_linestyle() == ":"]
    assert tight.tension_max[0] in heights
