"""Sizes of shared pages, and times of their kernels in node and in Python."""

from __future__ import annotations

import json

import numpy as np
from rich.console import Console

import sagline as sl
from benchmarks.measure import Row, best_seconds, one_core, show
from sagline.cables.models import Catenary
from sagline.kinematics.forward_rows import solve_forward_rows
from sagline.kinematics.inverse_rows import solve_inverse_rows
from sagline.share.machine import courses_at, model_data
from sagline.share.packing import MODULE
from sagline.share.page import robot_page
from sagline.statics.tables import pose_rows
from sagline.tension.method import kernel_options
from sagline.tension.methods import MinimumNorm
from tests.share.programs import in_node
from tests.share.test_kernels import poses, rows_of

ROBOTS = ("cogiro", "ipanema-2-pulleys")
POSES, REPEATS = 400, 50
UPDATES, LARGEST = 60, 400  # updates per second, kB


def rows_of_robot(robot: sl.Robot) -> list[Row]:
    """Size of the page, and time of one pose in node and in Python [µs]; Python solves a batch in one call."""
    pose = poses(robot, POSES)
    plan = sl.inverse(robot, pose)
    held = np.flatnonzero(plan.feasible)
    given = [rows_of(plan)[i] for i in held]
    times = json.loads(in_node(model_data(robot), given, repeat=REPEATS))["times"]
    node = {name: min(each) for name, each in times.items()}
    model, method, rows = Catenary(), MinimumNorm(), pose_rows(pose[held])
    options, rest, nothing = kernel_options(robot, model, method), np.zeros((1, 6)), np.full(robot.cable_count, np.nan)
    lengths, tension = np.array([row["given"] for row in given]), plan.chord_tension[held[0]]
    python = {
        "inverse": lambda: solve_inverse_rows(robot, method, options, rows, rest, nothing),
        "forward": lambda: solve_forward_rows(robot, model, lengths, rows, rest),
        "courses": lambda: [courses_at(robot, pose[int(held[0])], tension) for _ in held],
    }
    native = {name: 1e6 * best_seconds(run) / len(held) for name, run in python.items()}
    update = node["inverse"] + node["courses"]
    return [
        Row(f"page of {robot.name}", f"< {LARGEST} kB", f"{len(robot_page(robot).encode()) / 1e3:.0f} kB"),
        Row("inverse of a pose in node; in Python", "", f"{node['inverse']:.1f} µs; {native['inverse']:.1f} µs"),
        Row("forward of a pose in node; in Python", "", f"{node['forward']:.1f} µs; {native['forward']:.1f} µs"),
        Row("points of all cables in node; in Python", "", f"{node['courses']:.0f} µs; {native['courses']:.0f} µs"),
        Row("updates on one core, without WebGL", f">= {UPDATES} /s", f"{1e6 / update:,.0f} /s"),
    ]


def main() -> None:
    """Print the table."""
    one_core()
    size = Row("WebAssembly module", "", f"{len(MODULE.read_bytes()) / 1e3:.0f} kB")
    rows = [row for name in ROBOTS for row in rows_of_robot(sl.load_robot(name))]
    show("Shared pages", [size, *rows], Console())


if __name__ == "__main__":
    main()
