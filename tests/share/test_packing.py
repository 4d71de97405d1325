"""Data of a page, decoded as in page/states.js, and their size."""

import re
import zlib
from base64 import b64decode
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.share.course import MOST_RATE, SharedMotion
from sagline.share.packing import PackedColumn, encode_columns
from sagline.share.page import course_page
from tests.tiers import extended

MOST = 3_000_000  # bytes of a page with a run of a minute


def unpacked(header: dict[str, Any], text: str) -> dict[str, Array]:
    """By planes of bytes and cumulative sums, written here again."""
    data, place, found = zlib.decompress(b64decode(text)), 0, {}
    for channel in header["channels"]:
        columns = []
        for order, planes in channel["columns"]:
            part = np.frombuffer(data, np.uint8, planes * header["count"], place).reshape(planes, -1).astype(np.int64)
            code = sum(part[k] << (8 * k) for k in range(planes))
            code = np.where(code % 2, -(code + 1) // 2, code // 2)
            for _ in range(order):
                code = np.cumsum(code)
            value = code * channel["step"] if channel["scale"] == "linear" else np.exp(code * channel["step"])
            columns.append(np.where(code == channel["nothing"], np.nan, value) if channel["nothing"] else value)
            place += planes * header["count"]
        found[channel["name"]] = np.stack(columns, axis=1)
    assert place == len(data)
    return found


def test_values_are_decoded_to_half_a_step() -> None:
    rng = np.random.default_rng(3)
    time = np.linspace(0.0, 60.0, 5000)
    smooth = np.stack((np.sin(time), -1e4 * np.cos(0.1 * time), np.zeros_like(time)), axis=1)
    rough = np.exp(rng.normal(0.0, 3.0, (5000, 4)))
    rough[rng.random((5000, 4)) < 0.1] = np.nan
    found = unpacked(
        *encode_columns([PackedColumn("smooth", smooth, 1e-5), PackedColumn("rough", rough, 1e-4, "relative")])
    )
    np.testing.assert_allclose(found["smooth"], smooth, rtol=0.0, atol=0.5001e-5)
    np.testing.assert_allclose(found["rough"], rough, rtol=0.501e-4)


def test_smooth_motion_takes_less_than_a_byte_a_number() -> None:
    time = np.linspace(0.0, 60.0, 6000)
    _, text = encode_columns([PackedColumn("place", np.sin(time)[:, None] * np.arange(1.0, 4.0), 1e-5)])
    assert len(text) < 18000


@extended
@pytest.mark.parametrize("name", ["cogiro", "falcon-7", "fast"])
def test_a_minute_of_run_is_small(name: str) -> None:
    """At the rate of control loops, with noise of tensions, the worst case of compression."""
    robot = sl.load_robot(name)
    assert robot.test_box is not None
    low, high = robot.test_box.low, robot.test_box.high
    turn = np.linspace(0.0, 12.0 * np.pi, 9001)
    wave = np.stack((np.cos(turn), np.sin(turn), np.cos(0.7 * turn)), axis=1)
    pose = sl.Pose(0.5 * (low + high) + 0.2 * wave * (high - low), np.eye(3))
    path = sl.path_from_samples(np.linspace(0.0, 60.0, 9001), pose)
    course = SharedMotion.of_plan(sl.inverse(robot, path))
    assert len(course.time) == len(course.thinned().time) == 9001
    noise = np.exp(np.random.default_rng(1).normal(0.0, 0.01, course.tension.shape))
    object.__setattr__(course, "tension", course.tension * noise)
    size = len(course_page(course, "run").encode())
    assert size < MOST / 4


def test_faster_runs_are_thinned_with_a_note() -> None:
    robot = sl.load_robot("cogiro")
    ends = sl.Pose(np.array([[0.0, 0.0, 2.0], [1.0, 0.0, 2.0]]), np.stack([np.eye(3)] * 2))
    course = SharedMotion.of_plan(sl.inverse(robot, sl.quintic_path(ends, durations=[4.0], rate=1000)))
    kept = course.thinned()
    assert len(kept.time) == 4.0 * MOST_RATE + 1
    assert kept.time[-1] == course.time[-1]
    (note,) = kept.notes
    assert re.findall(r"[\d,]+", note) == ["10", "4,001"]
    assert kept.notes[0] in course_page(course, "run")
