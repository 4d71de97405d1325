"""Figures of an execution show the recorded numbers."""

import sys

import numpy as np
import pytest
from syrupy.assertion import SnapshotAssertion

import sagline as sl
from sagline.control import Execution, State
from tests.files.executions import execution
from tests.tiers import extended


def test_four_panels_with_units_and_a_line_at_each_fault(snapshot: SnapshotAssertion) -> None:
    figure = sl.plot.execution(execution())
    band, tensions, error, place = figure.axes
    assert [panel.get_ylabel() for panel in (tensions, error, place)] == snapshot
    assert place.get_xlabel() == "time [s]"
    for panel in figure.axes:
        marks = [line for line in panel.lines if np.shape(line.get_xdata()) == (2,)]
        assert [float(np.asarray(line.get_xdata())[0]) for line in marks] == [0.5]
    assert [text.get_text() for text in band.texts] == ["cell stuck"]


def test_lines_are_the_recorded_numbers() -> None:
    done = execution()
    lines = sl.plot.measured_tensions(done).lines
    assert len(lines) == 16
    for i in (0, 5):
        assert np.array_equal(np.asarray(lines[i].get_ydata()), done.tension[:, i], equal_nan=True)
        assert np.array_equal(np.asarray(lines[8 + i].get_ydata()), done.planned_tension[:, i])
    place = sl.plot.place_errors(done).lines[1]
    away = 1e3 * sl.control.position_error(done)[:, 1]
    assert np.array_equal(np.asarray(place.get_ydata()), away, equal_nan=True)
    mendable = sl.plot.mendable_tensions(done).lines[3]
    assert np.array_equal(np.asarray(mendable.get_ydata()), sl.control.null_space_error(done)[:, 3])


def test_the_band_shows_each_state_for_its_duration() -> None:
    parts = {name: getattr(execution(), name) for name in execution().__slots__}
    states = np.repeat([State.IDLE, State.MOVING, State.FAULT, State.READY], [20, 100, 41, 40]).astype(np.int8)
    ax = sl.plot.states(Execution(**parts | {"state": states}))
    widths = {
        str(bars.get_label()): sum(path.get_extents().width for path in bars.get_paths()) for bars in ax.collections
    }
    assert widths == pytest.approx({"MOVING": 1.0, "FAULT": 0.41, "standing": 0.6})


def test_long_recordings_keep_their_peaks(monkeypatch: pytest.MonkeyPatch) -> None:
    done = execution()
    monkeypatch.setattr(sys.modules["sagline.plot.sheet"], "MOST_POINTS", 20)
    line = sl.plot.measured_tensions(done).lines[2]
    values = np.asarray(line.get_ydata(), dtype=float)
    assert values.size < 50
    assert np.nanmax(values) == np.nanmax(done.tension[:, 2])
    assert np.nanmin(values) == np.nanmin(done.tension[:, 2])
    assert (np.diff(np.asarray(line.get_xdata(), dtype=float)) >= 0.0).all()


@extended
@pytest.mark.parametrize("width", [80.0, 120.0])
def test_a_panel_fits_paper(width: float) -> None:
    """All parts are on the sheet [mm]."""
    from sagline.plot.sheet import sheet

    figure = sheet(2.2)
    figure.set_size_inches(width / 25.4, 2.2)
    sl.plot.place_errors(execution(), figure.add_subplot())
    figure.draw_without_rendering()
    box = figure.get_tightbbox()
    assert box.width <= width / 25.4 + 1e-6
    assert box.height <= 2.2 + 1e-6
