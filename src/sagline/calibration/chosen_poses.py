"""Poses to calibrate a robot by, and how a person reads them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from textwrap import wrap
from typing import Final

import numpy as np

from sagline.calibration.further import error_in_words
from sagline.calibration.sensors import Sensors
from sagline.calibration.tour import length_of
from sagline.calibration.unknowns import Parameters
from sagline.core.arrays import Array
from sagline.core.numbers import SPACE, counted, n
from sagline.core.results import Result, Saved
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

WIDTH: Final = 80
COLUMNS: Final = (20, 9, 13, 13, 15)  # of the table of errors
NARROW: Final = (16, 8, 9, 11, 13)  # the same in a narrow terminal
WIDE: Final = 2 + sum(COLUMNS)
KILO: Final = 1e4  # N: tensions from here on are written in kN
FAR: Final = 100.0  # m: positions from here on are written with one decimal less


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CalibrationPoses(Result, Saved):
    """Result of `calibration_poses`, in an order that is short to drive.

    Attributes:
        robot: The robot.
        sensors: What will measure it.
        parameters: What is to be found.
        poses: Where to stand, N of them.
        frame_end_tension: With which tensions [N], (N, m).
        unstrained_length: All cable off the drums there [m], (N, m).
        expected_error: Standard error of each number to be found, in its unit, (P,).
        random_error: The same of random poses of the same number, their median, (P,).
        share_of_random: What part of the errors of random poses is left, in the directions that readings tell of:
            geometric mean. Single numbers hide it where the readings leave, say, the place of the world open.
        gain: log det of what the first k poses chosen tell, in the order of choosing, (N,).
        enough: From how many poses on another one changes no error by more than a hundredth; N if none.
        most_helpful: Which further measurement would help most, in words.
    """

    robot: Robot
    sensors: Sensors
    parameters: Parameters
    poses: Pose
    frame_end_tension: Array
    unstrained_length: Array
    expected_error: Array
    random_error: Array
    share_of_random: float
    gain: Array
    enough: int
    most_helpful: str

    def __len__(self) -> int:
        """Number of poses N."""
        return len(self.poses)

    def __str__(self) -> str:
        """What to expect of them, in lines of at most 80 columns."""
        return in_words(self)

    def table(self) -> str:
        """Poses and tensions, one a line."""
        return table(self)


def in_words(plan: CalibrationPoses, width: int = WIDTH) -> str:
    """What to expect of poses to calibrate by, beside random ones, in lines of at most 80 columns.

    Args:
        plan: The poses.
        width: Columns of a line; numbers are not broken.
    """
    return "\n".join((*_head(plan, width), *_errors(plan, width), *_advice(plan, width))).replace(SPACE, " ")


def table(plan: CalibrationPoses, width: int = WIDTH) -> str:
    """Poses and tensions in the order to drive, one a line; more cables than fit go on in the next.

    Args:
        plan: The poses.
        width: Columns of a line.
    """
    position, tension = plan.poses.position, plan.frame_end_tension
    angles = np.degrees(plan.poses.rotation.as_euler("ZYX"))
    decimals = 1 if np.abs(position).max() >= FAR else 2
    kilo = tension.max() >= KILO
    poses = [
        _column("", range(len(plan)), 0),
        *(_column(axis, position[:, k], decimals) for k, axis in enumerate("xyz")),
        *(_column(name, angles[:, k], 1) for k, name in enumerate(("alpha", "beta", "gamma"))),
    ]
    cells = [_column(f"T{i}", row / (1e3 if kilo else 1.0), 1 if kilo else 0) for i, row in enumerate(tension.T)]
    left = sum(len(column[0]) for column in poses)
    most = max((width - left) // max(len(column[0]) for column in cells), 1)
    parts = [cells[first : first + most] for first in range(0, len(cells), most)]
    units = f"x, y, z in m; alpha about z, beta about y, gamma about x in °; tensions in {'kN' if kilo else 'N'}"
    lines = wrap(units, width)
    for k in range(len(plan) + 1):
        begin = "".join(column[k] for column in poses)
        for part in parts:
            lines.append(begin + "".join(column[k] for column in part))
            begin = " " * left
    return "\n".join(lines)


def _column(head: str, values: Iterable[float], decimals: int) -> list[str]:
    """A column of numbers below its head, all of one width."""
    cells = [head, *(f"{round(float(value), decimals) + 0.0:.{decimals}f}" for value in values)]
    width = 1 + max(map(len, cells))
    return [f"{cell:>{width}}" for cell in cells]


def _head(plan: CalibrationPoses, width: int) -> Iterator[str]:
    places = plan.poses.position[_first_of_each(plan.poses.position)]
    way = n(length_of(places, np.arange(len(places))), ".3g", "m")
    what = f"{counted(len(plan), 'pose')} to find {counted(len(plan.parameters.names), 'number')} of {plan.robot.name}"
    yield from wrap(f"{what}: {counted(len(places), 'place')}, {way} to drive", width)
    yield from wrap(f"read by {' and '.join(_sensors(plan))}", width, initial_indent="  ", subsequent_indent="  ")


def _first_of_each(position: Array) -> Array:
    """Flags of the poses that are not at the place of the one before."""
    moved: Array = np.concatenate(([True], (np.diff(position, axis=0) != 0.0).any(axis=1)))
    return moved


def _sensors(plan: CalibrationPoses) -> Iterator[str]:
    read = plan.sensors
    for words, deviation, unit in (
        ("lengths", read.length_deviation, "m"),
        ("load cells", read.tension_deviation, "N"),
        ("positions", read.position_deviation, "m"),
        ("rotations", read.rotation_deviation, "rad"),
    ):
        if deviation is not None:
            yield f"{words} ({error_in_words(float(np.max(deviation)), unit)})"


def _errors(plan: CalibrationPoses, width: int) -> Iterator[str]:
    """Root mean squares of the errors of each kind."""
    names = np.array(plan.parameters.names)
    first, *others = COLUMNS if width >= WIDE else NARROW
    heads = (*zip(("numbers", "before", "afterwards", "random poses"), others, strict=True),)
    title = "standard errors of" if width >= WIDE else "errors of"
    yield f"  {title:<{first}}" + "".join(f"{head:>{own}}" for head, own in heads)
    for name in dict.fromkeys(plan.parameters.names):
        for unit in dict.fromkeys(np.array(plan.parameters.units)[names == name]):
            mine = (names == name) & (np.array(plan.parameters.units) == unit)
            errors = (plan.parameters.prior_deviation, plan.expected_error, plan.random_error)
            before, after, usual = (
                error_in_words(float(np.sqrt(np.mean(one[mine] ** 2))), str(unit)) for one in errors
            )
            cells = zip((mine.sum(), before, after, usual), others, strict=True)
            yield f"  {name:<{first}}" + "".join(f"{cell:>{own}}" for cell, own in cells)


def _advice(plan: CalibrationPoses, width: int) -> Iterator[str]:
    share, times = plan.share_of_random, plan.share_of_random**-2
    yield from wrap(
        f"In the directions that readings tell of, the errors are {n(share, '.2f')} of those of random poses, of which "
        f"it would take {n(times, '.2g')} times as many.",
        width,
    )
    if plan.enough < len(plan):
        text = f"From {counted(plan.enough, 'pose')} on, another one lowers no error by more than 1{SPACE}%."
    else:
        text = f"More poses still help: each lowers some error by more than 1{SPACE}%."
    yield from wrap(text, width)
    yield from wrap(plan.most_helpful, width)
