"""Programs in G-code: rounded corners, speeds over many moves, and parts."""

from itertools import pairwise
from math import cos, pi, sin, sqrt, tan
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from benchmarks.gcode import SETTINGS, lengths_of
from sagline.core.arrays import Array
from tests.files.programs import printed_house, written
from tests.refusal import refused
from tests.tiers import extended, wide

HEAD = "G0 X0 Y0 Z0\n"


def program(points: Array, feed: float) -> str:
    """Program of lines through points [m] at a speed [m/s]."""
    lines = (f"G1 X{x:.9f} Y{y:.9f} Z{z:.9f} F{60e3 * feed}" for x, y, z in 1e3 * np.asarray(points))
    return HEAD + "\n".join(lines)


def load(folder: Path, text: str, **settings: Any) -> sl.Path:
    """Path of a program."""
    return sl.load_gcode(written(folder, text), **settings)


def distances(points: Array, corners: Array) -> Array:
    """Distances (N,) of points from a polygon."""
    found = np.full(len(points), np.inf)
    for a, b in pairwise(corners):
        share = np.clip((points - a) @ (b - a) / np.sum((b - a) ** 2), 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(points - a - share[:, None] * (b - a), axis=1))
    return found


def random_corners(seed: int, count: int) -> Array:
    """Corners of a polygon, with long and short edges and some reversals."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 0, (count, 1))
    steps[::7] = -0.5 * steps[1::7][: len(steps[::7])] if count % 7 else steps[::7]
    return np.vstack((np.zeros(3), np.cumsum(steps, axis=0)))


def test_a_fine_polygon_is_as_slow_as_its_circle(tmp_path: Path) -> None:
    """720 lines on a circle of 10 mm: each turn is passed without a stop, and v^2 = a R bounds the speed."""
    angle = np.linspace(0.0, 2.0 * pi, 721)
    points = 0.01 * np.stack((np.cos(angle) - 1.0, np.sin(angle), 0.0 * angle), axis=1)
    path = load(tmp_path, program(points[1:], 0.5), acceleration=1.0)
    speed = np.linalg.norm(path.twist[:, :3], axis=1)
    assert speed.max() == pytest.approx(sqrt(1.0 * 0.01), rel=0.01)


@pytest.mark.parametrize("seed", wide(range(12), 2))
def test_rounded_corners_keep_the_tolerance_and_the_acceleration(tmp_path: Path, seed: int) -> None:
    corners = random_corners(seed, 40)
    tolerance, acceleration, feed, rate = 2e-3, 1.3, 0.4, 2000.0
    text = program(corners[1:], feed)
    path = load(tmp_path, text, tolerance=tolerance, acceleration=acceleration, rate=rate)
    assert distances(path.pose.position, corners).max() <= tolerance * (1 + 1e-9)
    velocity, change = path.twist[:, :3], path.twist_rate[:, :3]
    assert np.linalg.norm(velocity, axis=1).max() <= feed * (1 + 1e-12)
    assert np.linalg.norm(change, axis=1).max() <= sqrt(2.0) * acceleration * (1 + 1e-9)
    # no jumps of position and velocity: the velocity is the integral of the acceleration to second order in the step,
    # except at jumps of the acceleration, of at most 2 sqrt(2) times the limit
    h = np.diff(path.time)[:, None]
    assert np.abs(np.diff(path.pose.position, axis=0) - 0.5 * h * (velocity[1:] + velocity[:-1])).max() < 2e-6
    assert np.abs(np.diff(velocity, axis=0)).max() <= sqrt(2.0) * acceleration / rate * (1 + 1e-6)
    assert np.linalg.norm(np.diff(velocity, axis=0) - 0.5 * h * (change[1:] + change[:-1]), axis=1).max() < 2e-3
    stopping = load(tmp_path, text, acceleration=acceleration)
    assert path.duration < stopping.duration
    assert stopping.rests is not None
    assert path.rests is not None
    assert len(stopping.rests) == 41
    assert len(path.rests) < 10  # reversals


@pytest.mark.parametrize("angle", [0.02, 0.3, pi / 2, 2.5])
def test_an_arc_in_a_corner(tmp_path: Path, angle: float) -> None:
    """The arc of radius r is r (1/cos(angle/2) - 1) away from its corner, and begins r tan(angle/2) before it."""
    corner, end = np.array([1.0, 0.0, 0.0]), np.array([1.0 + cos(angle), sin(angle), 0.0])
    tolerance, acceleration = 5e-4, 0.7
    path = load(
        tmp_path, program(np.array([corner, end]), 1.0), tolerance=tolerance, acceleration=acceleration, rate=3e3
    )
    radius = min(tolerance / (1.0 / cos(angle / 2.0) - 1.0), 0.5 / tan(angle / 2.0))
    cut, off = radius * tan(angle / 2.0), radius * (1.0 / cos(angle / 2.0) - 1.0)
    speed = min(1.0, sqrt(acceleration * radius))
    away = np.linalg.norm(path.pose.position - corner, axis=1)
    assert away.min() == pytest.approx(off, rel=0.01)  # of the nearest sample
    inside = away < cut - 1e-6
    bend = np.linalg.norm(path.twist_rate[inside, :3], axis=1)
    np.testing.assert_allclose(np.linalg.norm(path.twist[inside, :3], axis=1), speed, rtol=1e-9)
    np.testing.assert_allclose(bend, speed**2 / radius, rtol=1e-7)
    line = 1.0 - cut
    peak = min(1.0, sqrt(acceleration * line + 0.5 * speed**2))
    ramps = (2.0 * peak - speed) / acceleration
    rest = line - (2.0 * peak**2 - speed**2) / (2.0 * acceleration)
    assert path.duration == pytest.approx(2.0 * (ramps + rest / peak) + radius * angle / speed, rel=1e-9)


def test_a_circle_of_lines_takes_the_time_of_a_circle(tmp_path: Path) -> None:
    angle = np.linspace(0.0, 2.0 * pi, 721)
    points = np.stack((2.0 * np.cos(angle) - 2.0, 2.0 * np.sin(angle), np.zeros(721)), axis=1)[1:]
    lines = load(tmp_path, program(points, 0.5), tolerance=1e-3, acceleration=1.0)
    arc = load(tmp_path, HEAD + "G3 X0 Y0 I-2000 F30000\n", acceleration=1.0)
    assert arc.duration == pytest.approx(4.0 * pi / 0.5 + 0.5, rel=1e-12)
    assert lines.duration == pytest.approx(arc.duration, rel=1e-4)
    radius = np.linalg.norm(arc.pose.position - [-2.0, 0.0, 0.0], axis=1)
    np.testing.assert_allclose(radius, 2.0, atol=1e-14)
    exact = load(tmp_path, program(points, 0.5), acceleration=1.0)  # changes of direction of 0.0087 rad are smooth
    assert exact.duration == pytest.approx(arc.duration, rel=1e-4)


def test_tangential_arcs_are_passed_and_others_are_stops(tmp_path: Path) -> None:
    smooth = "G1 X1000 F30000\nG3 X1500 Y500 J500\nG1 Y1000\nG2 X2000 Y1500 R500\n"
    path = load(tmp_path, HEAD + smooth)
    assert path.rests is not None
    assert len(path.rests) == 2
    assert path.duration == pytest.approx((1.5 + 0.5 * pi) / 0.5 + 0.5, rel=1e-12)
    sharp = load(tmp_path, HEAD + "G64 P1\nG1 X1000 F30000\nG3 X500 Y500 I-500\nG1 X0\nY0\n")
    assert sharp.rests is not None
    assert len(sharp.rests) == 3  # the corner of two lines is rounded


def speeds_by_two_sweeps(lengths: Array, limits: Array, acceleration: float) -> float:
    """Duration by the usual look-ahead: one sweep backward and one forward over the joints."""
    joints = [0.0, *(min(a, b) for a, b in pairwise(limits)), 0.0]
    for k in range(len(lengths) - 1, -1, -1):
        joints[k] = min(joints[k], sqrt(joints[k + 1] ** 2 + 2.0 * acceleration * lengths[k]))
    for k, length in enumerate(lengths):
        joints[k + 1] = min(joints[k + 1], sqrt(joints[k] ** 2 + 2.0 * acceleration * length))
    total = 0.0
    for (a, b), length, limit in zip(pairwise(joints), lengths, limits, strict=True):
        peak = min(limit, sqrt(0.5 * (a * a + b * b) + acceleration * length))
        even = length - (2.0 * peak**2 - a * a - b * b) / (2.0 * acceleration)
        total += (2.0 * peak - a - b) / acceleration + even / peak
    return total


@pytest.mark.parametrize("batch", [3, 100, 8192])
def test_speeds_along_a_line_need_no_more_than_their_own_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, batch: int
) -> None:
    monkeypatch.setattr("sagline.files.gcode_program.BATCH", batch)
    rng = np.random.default_rng(3)
    lengths, limits = 10.0 ** rng.uniform(-4, -1, 500), rng.uniform(0.05, 2.0, 500)
    text = (
        HEAD
        + "G91\n"
        + "\n".join(
            f"G1 X{1e3 * length:.12f} F{60e3 * limit:.12f}" for length, limit in zip(lengths, limits, strict=True)
        )
    )
    path = load(tmp_path, text, acceleration=0.9)
    assert path.duration == pytest.approx(speeds_by_two_sweeps(lengths, limits, 0.9), rel=1e-11)
    ends = np.cumsum(lengths)
    assert path.pose.position[-1, 0] == pytest.approx(ends[-1], rel=1e-12)


def test_parts_are_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = program(random_corners(5, 60)[1:], 0.4) + "\nG4 P2000\nG1 X0\n"
    settings: dict[str, Any] = {"tolerance": 1e-3, "rate": 25.0}
    path = load(tmp_path, text, **settings)
    monkeypatch.setattr("sagline.files.gcode_program.BATCH", 4)
    monkeypatch.setattr("sagline.motion.contour.BLOCK", 50)
    parts = list(sl.gcode_parts(tmp_path / "part.ngc", **settings))
    assert len(parts) > 30
    assert max(len(part.path) for part in parts) == 50
    for name in ("time", "twist", "twist_rate"):
        joined = np.concatenate([getattr(part.path, name) for part in parts])
        np.testing.assert_allclose(joined, getattr(path, name), atol=1e-8)
    np.testing.assert_allclose(np.concatenate([p.path.pose.position for p in parts]), path.pose.position, atol=1e-10)
    lines = np.concatenate([part.line for part in parts])
    assert (np.diff(lines) >= 0).all()
    assert lines[0] == 2
    assert lines[-1] == 63


def test_loads_that_change_along_a_program(tmp_path: Path) -> None:
    """A payload that decreases, and a hose from the ceiling: tensions balance the weight at each sample."""
    robot = sl.load_robot("cogiro")
    text = "G0 X0 Y0 Z1500\nG1 X1000 Z2500 F12000\nX-1000 Y500\n"
    for part in sl.gcode_parts(written(tmp_path, text), rate=10.0):
        wrench = np.zeros((len(part.path), 6))
        wrench[:, 2] = -9.81 * np.linspace(80.0, 20.0, len(part.path)) - 15.0 * part.path.pose.position[:, 2]
        plan = sl.inverse(robot, part.path, wrench=wrench)
        assert plan.feasible.all()
        still = sl.inverse(robot, part.path)
        heavier = plan.state.wrench[:, 2] - still.state.wrench[:, 2]
        np.testing.assert_allclose(heavier, wrench[:, 2], rtol=1e-12)


def test_a_print_in_bounded_memory(tmp_path: Path) -> None:
    file = tmp_path / "house.gcode"
    file.write_text("".join(printed_house(3e5)))
    longest, end, lines = 0, 0.0, 0
    for part in sl.gcode_parts(file, tolerance=1e-3, rate=2.0):
        longest, end, lines = max(longest, len(part.path)), float(part.path.time[-1]), int(part.line[-1])
    assert longest < 10_000
    assert end > 1000.0
    assert lines == sum(1 for _ in printed_house(3e5))


def test_a_path_that_does_not_fit_into_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sagline.core.arguments.free_memory", lambda: 1e8)
    file = written(tmp_path, HEAD + "G1 X4000 F60\n")  # 4,000 s at 1 mm/s
    with refused("the memory for a path of 393,216 or more samples", next_step="Use gcode_parts, or a lower rate."):
        sl.load_gcode(file)
    assert sum(len(part.path) for part in sl.gcode_parts(file)) == 400_002  # the last one at 4,000.001 s
    with refused("line 2", "the motion needs too many samples"):
        load(tmp_path, HEAD + "G1 X4000 F0.001\n")


@extended
def test_the_benchmark_holds_every_sample(tmp_path: Path) -> None:
    file = tmp_path / "house.gcode"
    file.write_text("".join(printed_house(1e5)))
    count = sum(len(part.path) for part in sl.gcode_parts(file, **SETTINGS))
    assert lengths_of(file) == count > 40_000
