"""Programs in G-code: words and geometry against complex numbers, and the meaning of each word."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.files.programs import OFFSETS, Writer, written
from tests.refusal import refused
from tests.tiers import wide

FAST = "G1 F60000\n"  # 1 m/s


def load(folder: Path, text: str, name: str = "part.ngc", **settings: Any) -> sl.Path:
    """Path of a program."""
    return sl.load_gcode(written(folder, text, name), **settings)


def stops(path: sl.Path) -> list[list[float]]:
    """Positions at rest [mm], without repetitions; the path must have a sample at each."""
    assert path.rests is not None
    found: list[list[float]] = []
    for rest in path.rests:
        k = int(np.argmin(np.abs(path.time - rest)))
        place = (1e3 * path.pose.position[k]).round(3).tolist()
        if not found or found[-1] != place:
            found.append(place)
    return found


@pytest.mark.parametrize("seed", wide(range(40), 6))
def test_random_programs_move_as_complex_numbers_do(tmp_path: Path, seed: int) -> None:
    writer, acceleration = Writer(seed), 1.7
    file = written(tmp_path, writer.write(20))
    durations = [motion.duration(acceleration) for motion in writer.motions]
    ends = np.cumsum(durations)
    settings: dict[str, Any] = {"acceleration": acceleration, "offsets": OFFSETS, "rate": 10.0}
    path = sl.load_gcode(file, **settings)
    lines = np.concatenate([part.line for part in sl.gcode_parts(file, **settings)])
    which = np.minimum(np.searchsorted(ends, path.time, side="right"), len(ends) - 1)
    since = path.time - ends[which] + np.array(durations)[which]
    expected = np.array([writer.motions[k].at(time, acceleration) for k, time in zip(which, since, strict=True)])
    np.testing.assert_allclose(path.pose.position, expected[:, 0], atol=1e-9)
    np.testing.assert_allclose(path.twist[:, :3], expected[:, 1], atol=1e-8)
    inner = np.array([writer.motions[k].is_steady(time, acceleration) for k, time in zip(which, since, strict=True)])
    assert inner.sum() > len(path) - 5
    np.testing.assert_allclose(path.twist_rate[inner, :3], expected[inner, 2], atol=1e-7)
    assert lines.tolist() == [writer.motions[k].line for k in which]
    assert len(path) == int(np.ceil(10.0 * ends[-1])) + 1
    assert path.rests is not None
    np.testing.assert_allclose(path.rests, np.append(0.0, ends), rtol=1e-11)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("g1x10y5\n", [[0, 0, 0], [10, 5, 0]]),
        ("G 1 X 10.5\n", [[0, 0, 0], [10.5, 0, 0]]),
        ("N10 G1 X10 (go) Y5 ; here\n/ N20 X20\n", [[0, 0, 0], [10, 5, 0], [20, 5, 0]]),
        ("G20 G1 X1\n", [[0, 0, 0], [25.4, 0, 0]]),
        ("G91 G1 X10\nX10 Y-5\n", [[0, 0, 0], [10, 0, 0], [20, -5, 0]]),
        ("G92 X5\nG1 X6 Y1\nG92.1\nG1 X6\n", [[0, 0, 0], [1, 1, 0], [6, 1, 0]]),
        ("G92 X5\nG92.2\nG1 X6 Y1\nG92.3\nG1 X6\n", [[0, 0, 0], [6, 1, 0], [1, 1, 0]]),
        ("G55\nG1 X10\nG53 G1 X10\nY5\n", [[0, 0, 0], [110, 0, 0], [10, 0, 0], [10, 205, 0]]),
        ("G1 X10\nM2\nX20\n", [[0, 0, 0], [10, 0, 0]]),
        ("T1 M6\nM3 S1000\nG1 X10 M8\n", [[0, 0, 0], [10, 0, 0]]),
        ("G1 X10\nG28\nM30\n", [[0, 0, 0], [10, 0, 0]]),
        ("G2 X100 Y100 I100 J0\nG1 X50\n", [[0, 0, 0], [100, 100, 0], [50, 100, 0]]),
        ("G1 X10\nX10.0000000001\nX10\nY9\n", [[0, 0, 0], [10, 0, 0], [10, 9, 0]]),
    ],
)
def test_words_lead_where_they_say(tmp_path: Path, text: str, expected: list[list[float]]) -> None:
    path = load(tmp_path, "G0 X0 Y0 Z0\n" + FAST + text, offsets={"G55": (0.1, 0.2, 0.0)}, rate=1e4)
    assert stops(path) == expected


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("G1 X1000 F60000\n", 2.0),  # 1 m at 1 m/s with 1 m/s^2
        ("G1 X1000 F30000\n", 2.5),
        ("G1 X250 F60000\n", 1.0),  # half a meter per second is reached
        ("G20 G1 X100 F1181.10236220472441\n", 2.54 / 0.5 + 0.5),
        ("G93 G1 X1000 F30\n", 2.5),  # half a meter per second
        ("G0 X1000\n", 2.5),
        ("G0 X1000\nG4 P0.25\n", 2.75),
        ("G61.1 G1 X500 F60000\nX1000\n", 2 * 2 * 0.5**0.5),
        ("G1 X500 F60000\nX1000\n", 2.0),
        # 0.4 m up to the peak p and down to 0.5 m/s, p^2 - 0.25/2 = 0.4; then 0.6 m, of which 0.125 m to stop
        ("G1 X400 F60000\nX1000 F30000\n", 2 * 0.525**0.5 - 0.5 + 0.475 / 0.5 + 0.5),
    ],
)
def test_times_follow_from_feeds(tmp_path: Path, text: str, seconds: float) -> None:
    assert load(tmp_path, "G0 X0 Y0 Z0\n" + text).duration == pytest.approx(seconds, rel=1e-12)


def test_programs_for_printers_have_their_own_conventions(tmp_path: Path) -> None:
    text = "G28\nM117 It's (printing\nG1 Z100 F6000 *71\nG92 E0\nG1 E5\nG0 X1000 E-2 F30000\nG4 P250\nG4 S1\nM221 S95\n"
    path = load(tmp_path, text, "house.gcode", rapid=9.0)
    assert path.duration == pytest.approx(2.5 + 1.25)
    assert stops(path) == [[0, 0, 100], [1000, 0, 100]]
    with refused("line 2"):
        load(tmp_path, text)
    assert load(tmp_path, text, dialect="marlin").duration == path.duration


@pytest.mark.parametrize("dwells", ["G4 P1.5\n", "G4 P1\nG28\nG4 P0.5\n"])
def test_a_dwell_before_the_first_motion_does_not_fix_the_position(tmp_path: Path, dwells: str) -> None:
    path = load(tmp_path, f"{dwells}G0 X10 Y20 Z5\nG1 X30 F600\n")
    np.testing.assert_allclose(path.pose.position[0], (0.01, 0.02, 0.005), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.ptp(path.pose.position, axis=0), (0.02, 0.0, 0.0), rtol=0.0, atol=1e-12)
    waits = path.time[np.abs(path.twist[:, :3]).max(axis=1) == 0.0]
    assert waits[waits < path.time[-1]].max() == pytest.approx(1.5, abs=0.02)


def test_the_start_of_the_path(tmp_path: Path) -> None:
    text = "G0 X100\nG0 Y100 Z100\n"
    assert load(tmp_path, text).pose.position[0].tolist() == [0.1, 0.0, 0.0]
    assert load(tmp_path, text, offsets={"G54": (1, 2, 3)}).pose.position[0].tolist() == [1.1, 2.0, 3.0]
    assert load(tmp_path, text, start=(0, 0, 2)).pose.position[0].tolist() == [0.0, 0.0, 2.0]
    assert load(tmp_path, "G91\n" + text, offsets={"G54": (1, 2, 3)}).pose.position[0].tolist() == [1.0, 2.0, 3.0]
    moved = load(tmp_path, "G0 X100\nG28\nG0 X0 Y0\nX500\n", rate=1e3)
    assert stops(moved) == [[0, 0, 0], [500, 0, 0]]


def test_every_reader_of_paths_reads_programs(tmp_path: Path) -> None:
    text = "G0 X0 Y0 Z1000\nG1 X500 F12000\n"
    for name in ("a.ngc", "b.NC", "c.tap", "d.gcode", "e.gco"):
        path = sl.load_path(written(tmp_path, text, name))
        np.testing.assert_array_equal(path.pose.position, load(tmp_path, text).pose.position)
