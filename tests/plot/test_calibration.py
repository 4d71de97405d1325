"""Figures of a calibration show the correct residuals, outliers, correlations and maps."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline import Calibration, plot
from sagline.core.arrays import Array
from sagline.plot.calibration import MOST_POSES, REACH, _mark_outliers
from tests.calibration.made_up import NAMES, made_up
from tests.plot.readable import drawn_texts, overlaps
from tests.refusal import refused


@pytest.fixture(scope="module")
def found() -> sl.Calibration:
    return made_up(count=20)


def lines_of(ax: Any, label: str) -> Array:
    """Points of a line."""
    return np.asarray(next(line for line in ax.get_lines() if line.get_label() == label).get_xydata())


def test_residuals_are_at_their_rows_in_standard_deviations(found: sl.Calibration, snapshot: SnapshotAssertion) -> None:
    lengths, cells, places = plot.calibration(found, "residuals").axes
    for ax, first, deviation, names in (
        (lengths, 0, 5e-4, [f"cable {k}" for k in range(8)]),
        (cells, 8, 5.0, [f"cable {k}" for k in range(8)]),
        (places, 16, 1e-3, ["$x$", "$y$", "$z$"]),
    ):
        assert ax.get_ylabel().endswith(r"[$\sigma$]")
        for k, name in enumerate(names):
            points, wanted = lines_of(ax, name), found.residuals[:, first + k] / deviation
            np.testing.assert_array_equal(points[:, 0], found.rows)
            np.testing.assert_allclose(points[:, 1], np.where(np.abs(wanted) > REACH, np.nan, wanted), rtol=1e-12)
    assert cells.get_ylim()[0] < -2.0 < 2.0 < cells.get_ylim()[1]
    patches: list[Any] = list(cells.patches)
    bands = sorted(patch.get_height() for patch in patches)
    assert bands == [2.0, 4.0]
    assert places.get_xlabel() == snapshot


def test_outliers_have_a_ring_and_a_number(found: sl.Calibration) -> None:
    lengths, cells, _ = plot.calibration(found, "residuals").axes
    rings = [line for line in lengths.get_lines() if line.get_markerfacecolor() == "none"]
    assert [tuple(np.asarray(ring.get_xydata())[0]) for ring in rings] == [(4.0, REACH), (17.0, -REACH)]
    assert [text.get_text() for text in lengths.texts] == ["cable 3, 20\u00a0mm", "cable 6, −15\u00a0mm"]
    edges = {line.get_marker(): np.asarray(line.get_xydata()) for line in lengths.get_lines() if len(line.get_xydata())}  # type: ignore[arg-type]
    np.testing.assert_array_equal(edges["^"], [[4.0, REACH]])
    np.testing.assert_array_equal(edges["v"], [[17.0, -REACH]])
    assert not cells.texts


@pytest.mark.parametrize(
    ("quantity", "text"), [("rotation", "0.2 rad"), ("frequency", "0.2 Hz"), ("load cell", "0.2 N")]
)
def test_the_number_of_an_outlier_has_the_unit_of_its_reading(found: sl.Calibration, quantity: str, text: str) -> None:
    ax = Figure().add_subplot()
    outliers = (replace(found.outliers[0], cable=None, quantity=quantity, size=0.2),)
    _mark_outliers(ax, replace(found, outliers=outliers), quantity)
    assert [each.get_text().replace("\u00a0", " ") for each in ax.texts] == [text]


def test_missing_sensors_have_no_panel(found: sl.Calibration) -> None:
    some = np.array(found.residuals)
    some[:, 8:] = np.nan
    assert len(plot.calibration(replace(found, residuals=some), "residuals").axes) == 1


def test_a_selection_of_many_poses_and_all_outliers_are_drawn(found: sl.Calibration) -> None:
    count = 5 * MOST_POSES
    rows = np.arange(count)
    long = replace(
        found, rows=rows, residuals=np.resize(found.residuals, (count, 22)), weights=np.ones(count),
        chi_squared_of_pose=np.ones(count),
        outliers=(replace(found.outliers[0], row=1234),),
    )  # fmt: skip
    ax = plot.calibration(long, "residuals").axes[0]
    drawn = lines_of(ax, "cable 5")[:, 0]
    assert len(drawn) <= MOST_POSES + 1
    assert 1234 in drawn
    assert "every 5th" in plot.calibration(long, "residuals").axes[-1].get_xlabel()


def test_the_matrix_is_the_correlation_by_kinds(found: sl.Calibration) -> None:
    figure = plot.calibration(found, "correlation")
    ax = figure.axes[0]
    np.testing.assert_array_equal(np.asarray(ax.images[0].get_array()), found.correlation)
    names = {text.get_text().replace(" ", "_"): text.xy[1] for text in ax.texts}  # type: ignore[attr-defined]
    assert names == dict(zip(NAMES, (11.5, 27.5, 32.0, 33.0, 35.0), strict=True))
    assert figure.axes[1].get_ylabel() == "correlation"
    with plot.style("ieee"):
        assert list(overlaps(drawn_texts(plot.calibration(found, "correlation")))) == []


def test_the_whole_figure_is_higher_than_a_slide_where_its_parts_would_overlap(found: sl.Calibration) -> None:
    with plot.style("slides") as look:
        figure = plot.calibration(found)
    assert figure.get_figheight() > 2.0 * look.tallest
    drawn_texts(figure)  # the first drawing determines the layout
    assert list(overlaps(drawn_texts(figure))) == []
    with plot.style("slides"):
        assert plot.calibration(found, "correlation").get_figheight() <= look.tallest


def test_maps_are_the_expected_errors_before_and_after(
    found: sl.Calibration, monkeypatch: pytest.MonkeyPatch, snapshot: SnapshotAssertion
) -> None:
    def errors(self: Calibration, pose: sl.Pose) -> SimpleNamespace:
        """Half of the mean standard error in the middle, more with the distance; a tenth of it without a shift."""
        size = np.mean(self.standard_error[:24]) * (0.5 + np.linalg.norm(pose.position, axis=-1))
        return SimpleNamespace(position=size, own_position=0.1 * size)

    monkeypatch.setattr(Calibration, "pose_error", errors)
    for one, share in ((found, 0.1), (replace(found, gauge=()), 1.0)):
        figure = plot.calibration(one, "errors", height=2.0)
        for ax, size in zip(figure.axes[:2], (0.05, float(np.mean(found.standard_error[:24]))), strict=True):
            mesh = next(each for each in ax.collections if isinstance(each, QuadMesh))
            corners = np.asarray(mesh.get_coordinates())
            middles = 0.25 * (corners[1:, 1:] + corners[1:, :-1] + corners[:-1, 1:] + corners[:-1, :-1])
            away = np.linalg.norm(np.dstack((middles, np.full(middles.shape[:2], 2.0))), axis=-1)
            shown = np.asarray(mesh.get_array()).reshape(away.shape)
            np.testing.assert_allclose(shown, 1e3 * share * size * (0.5 + away), rtol=1e-9)
            assert (figure.axes[1].get_xlabel(), ax.get_ylabel()) == ("$x$ [m]", "$y$ [m]")
        assert [figure.subfigs[0].get_suptitle(), figure.axes[2].get_ylabel()] == snapshot


def test_maps_of_undetermined_errors_have_a_note(
    found: sl.Calibration, monkeypatch: pytest.MonkeyPatch, snapshot: SnapshotAssertion
) -> None:
    def expected(_: sl.Calibration, poses: sl.Pose) -> Any:
        return SimpleNamespace(position=np.full(len(poses), np.inf), own_position=np.full(len(poses), np.inf))

    monkeypatch.setattr(Calibration, "pose_error", expected)
    titles = [ax.get_title() for ax in plot.calibration(found, "errors").axes]
    assert titles[:2] == snapshot


@pytest.mark.parametrize(
    ("arguments", "item", "value"),
    [
        ({"part": "all of it"}, "part", "'all of it'"),
        ({"height": 99.0}, "height", "99 m"),
        ({"height": np.nan}, "height", None),
        ({"height": "up"}, "height", None),
    ],
)
def test_invalid_parts_and_heights_are_refused(
    found: sl.Calibration, arguments: dict[str, Any], item: str, value: str | None
) -> None:
    with refused(item, value, kind=sl.InvalidValueError):
        plot.calibration(found, **{"part": "errors"} | arguments)


def test_other_objects_are_refused() -> None:
    with refused("found", kind=sl.InvalidValueError):
        plot.calibration("found.nc")  # type: ignore[arg-type]
