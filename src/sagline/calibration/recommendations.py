"""Recommended measurements: those beside the readings that are most informative of the unknowns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.candidates import CandidatePoses
from sagline.calibration.information import Information, information_of
from sagline.calibration.log import Sensors
from sagline.calibration.observations import predicted_rows
from sagline.calibration.parameters import Parameters
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.robot.robot import Robot

TOTAL_STATION: Final = 1e-3  # m, of each coordinate
CELL_SHARE: Final = 0.01  # of the tension in the middle: a usual load cell
NEARLY: Final = 0.9  # of the most that the logarithms of the errors fall by: what costs less will do
WORTH: Final = 0.99  # of the errors: what leaves more is not worth the while


# by kind: the measurement, its standard deviation in the unit of the kind, and True if that is a share of the value
TOOLS: Final[dict[str, tuple[str, float, bool]]] = {
    "mass": ("weighing the platform to 0.1 %", 1e-3, True),
    "linear_density": ("weighing a length of the cable to 1 %", 0.01, True),
    "axial_stiffness": ("stretching a length of the cable on a test bench, to 2 %", 0.02, True),
    "pulley_radius": ("a caliper on the pulleys, to 0.1 mm", 1e-4, False),
    "drum_radius": ("a caliper on the drums, to 0.1 mm", 1e-4, False),
    "load_cell_gain": ("a known weight on each load cell, to 0.5 %", 5e-3, True),
    "load_cell_bias": ("reading each load cell without load, to 1 N", 1.0, False),
}
Option = tuple[str, Array]  # a measurement in words, and the information with it, shape (P, P)


class Situation(NamedTuple):
    """Information on the parameters after the poses.

    Attributes:
        robot: The robot.
        model: Cable model.
        parameters: The unknowns.
        sensors: The sensors.
        scale: A unit of each internal parameter, in which information is counted, shape (P,).
        slopes: Of the values by the internal parameters, shape (P,).
        known: Prior information, with a little where there is none, shape (P, P).
        standing: The poses chosen.
        rows: Whitened rows of their readings, in the scale, shape (N, k, P).
    """

    robot: Robot
    model: CableModel
    parameters: Parameters
    sensors: Sensors
    scale: Array
    slopes: Array
    known: Array
    standing: CandidatePoses
    rows: Array

    @property
    def information(self) -> Array:
        """Information afterwards, shape (P, P)."""
        information: Array = self.known + information_of(self.rows)
        return information

    def rows_by(self, sensors: Sensors) -> Array:
        """Whitened rows of the poses with other sensors, in the scale, shape (N, m + 6, P)."""
        poses, lengths = self.standing.poses, self.standing.lengths
        found = predicted_rows(self.robot, self.model, self.parameters, sensors, poses, lengths)
        return np.asarray(found.matrix * self.scale)


def most_helpful(situation: Situation) -> str:
    """Sentence on the recommended measurement: the one that lowers the mean logarithm of the errors most."""
    before = _deviations(situation.information)
    best: Option | None = None
    most = -np.log(WORTH)
    for option in _options(situation):  # from the least costly of its kind on
        fall = float(np.log(before / _deviations(option[1])).mean())
        if fall > most / (1.0 if best is None else NEARLY):
            best, most = option, fall
    if best is None:
        return "No further measurement known here lowers the errors by more than a hundredth."
    return (
        f"Most helpful beside the poses: {best[0]}; it leaves {n(np.exp(-most), '.2f')} of the errors on average, "
        f"{_largest_reduction(situation, before, _deviations(best[1]))}."
    )


def _options(situation: Situation) -> Iterator[Option]:
    """Possible measurements that are not among the readings."""
    parameters, sensors = situation.parameters, situation.sensors
    for name, (words, deviation, is_share) in TOOLS.items():
        if name in parameters.names:
            mine = np.flatnonzero([other == name for other in parameters.names])
            size = parameters.prior[mine] if is_share else np.ones(len(mine))
            gain = np.zeros(len(situation.scale))
            gain[mine] = (situation.scale[mine] * situation.slopes[mine] / (deviation * size)) ** 2
            yield words, situation.information + np.diag(gain)
    if sensors.tension_deviation is None:
        deviation = typical_load_cell_deviation(situation.standing.tensions)
        rows = situation.rows_by(sensors.replace(tension_deviation=deviation))
        yield f"load cells, of {n(deviation, '.2g', 'N')}", situation.known + information_of(rows)
    if "frame_anchors" in parameters.names:
        yield from _measured_anchors(situation)
    if sensors.position_deviation is None:
        yield from _measured_positions(situation)


def _measured_anchors(situation: Situation) -> Iterator[Option]:
    """One frame anchor, or three, measured."""
    names, cables = np.array(situation.parameters.names), situation.parameters.cables
    m = situation.robot.cable_count
    rows = np.zeros((m, 3, len(names)))
    for cable in range(m):
        where = np.flatnonzero((names == "frame_anchors") & (cables == cable))
        rows[cable, range(3), where] = situation.scale[where] / TOTAL_STATION
    yield from _best_subset(situation, rows, rows, {1: "frame anchor {} measured", 3: "frame anchors {} measured"})


def _measured_positions(situation: Situation) -> Iterator[Option]:
    """The position measured at three of the poses, or six."""
    sensors = situation.sensors.replace(position_deviation=TOTAL_STATION)
    alone = situation.rows_by(sensors.replace(tension_deviation=None, rotation_deviation=None))
    words = dict.fromkeys((3, 6), "the position at poses {} measured")
    yield from _best_subset(situation, alone, situation.rows_by(sensors), words, situation.rows)


def _best_subset(
    situation: Situation, rows: Array, beside: Array, words: dict[int, str], instead: Array | None = None
) -> Iterator[Option]:
    """Most informative subset of some rows, for each number of them for which there are words.

    rows: information of each alone; beside: with what it comes with; instead: readings that are replaced.
    """
    found = Information(rows, situation.information)
    for _ in range(min(max(words), len(rows))):
        found.take(found.best()[0])
        if (size := len(found.chosen)) in words:
            known = situation.information + information_of(beside[found.chosen])
            if instead is not None:
                known = known - information_of(instead[found.chosen])
            listed = ", ".join(map(str, sorted(found.chosen)))
            yield f"{words[size].format(listed)} to {error_text(TOTAL_STATION, 'm')}", known


def _deviations(known: Array) -> Array:
    found: Array = np.sqrt(np.diag(np.linalg.inv(known)))
    return found


def _largest_reduction(situation: Situation, before: Array, after: Array) -> str:
    """Largest reduction of errors among the kinds."""
    names = np.array(situation.parameters.names)
    name = min(dict.fromkeys(names), key=lambda name: float(np.log(after / before)[names == name].mean()))
    mine = names == name
    unit = situation.parameters.units[int(np.argmax(mine))]
    size = situation.scale * np.abs(situation.slopes)
    one, other = (error_text(float(np.sqrt(np.mean((each * size)[mine] ** 2))), unit) for each in (before, after))
    return f"those of {name} fall from {one} to {other}"


def error_text(value: float, unit: str) -> str:
    """An error to two digits; lengths in millimeters."""
    return n(1e3 * value, ".2g", "mm") if unit == "m" else n(value, ".2g", unit)


def typical_load_cell_deviation(tensions: Array) -> float:
    """Standard deviation of load cells as sold for tensions (N, m) [N]."""
    return float(f"{CELL_SHARE * float(np.median(tensions)):.1g}")
