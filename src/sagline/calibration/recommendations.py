"""Recommended measurements: those beside the readings that are most informative of the unknowns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.calibration.candidates import Candidates
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


class Tool(NamedTuple):
    """A tool for one kind of unknowns.

    Attributes:
        words: What to do with it.
        deviation: What is known then, in the unit of the kind; a share of the value where `share`.
        share: Whether it is.
    """

    words: str
    deviation: float
    share: bool


BESIDE: Final[dict[str, Tool]] = {
    "mass": Tool("weighing the platform to 0.1 %", 1e-3, True),
    "linear_density": Tool("weighing a length of the cable to 1 %", 0.01, True),
    "axial_stiffness": Tool("stretching a length of the cable on a test bench, to 2 %", 0.02, True),
    "pulley_radius": Tool("a caliper on the pulleys, to 0.1 mm", 1e-4, False),
    "drum_radius": Tool("a caliper on the drums, to 0.1 mm", 1e-4, False),
    "load_cell_gain": Tool("a known weight on each load cell, to 0.5 %", 5e-3, True),
    "load_cell_bias": Tool("reading each load cell without load, to 1 N", 1.0, False),
}


class Situation(NamedTuple):
    """Information on the parameters after the poses.

    Attributes:
        robot: The robot.
        model: Cable model.
        parameters: What is looked for.
        sensors: What reads.
        scale: A unit of each internal parameter, in which information is counted, shape (P,).
        slopes: Of the values by the internal parameters, shape (P,).
        known: Information beforehand, with a little where there is none, shape (P, P).
        standing: The poses chosen.
        rows: What they tell, in the scale, shape (N, k, P).
    """

    robot: Robot
    model: CableModel
    parameters: Parameters
    sensors: Sensors
    scale: Array
    slopes: Array
    known: Array
    standing: Candidates
    rows: Array

    @property
    def told(self) -> Array:
        """Information afterwards, shape (P, P)."""
        told: Array = self.known + information_of(self.rows)
        return told

    def read_by(self, sensors: Sensors) -> Array:
        """Whitened rows of the poses with other sensors, in the scale, shape (N, m + 6, P)."""
        poses, lengths = self.standing.poses, self.standing.lengths
        rows: Array = (
            predicted_rows(self.robot, self.model, self.parameters, sensors, poses, lengths).matrix * self.scale
        )
        return rows


class Recommendation(NamedTuple):
    """A measurement that was not foreseen.

    Attributes:
        words: What it is.
        known: Information with it, shape (P, P).
    """

    words: str
    known: Array


def most_helpful(situation: Situation) -> str:
    """Sentence on the recommended measurement: the one that lowers the mean logarithm of the errors most."""
    before = _deviations(situation.told)
    best: Recommendation | None = None
    most = -np.log(WORTH)
    for further in _options(situation):  # from the least costly of its kind on
        fall = float(np.log(before / _deviations(further.known)).mean())
        if fall > most / (1.0 if best is None else NEARLY):
            best, most = further, fall
    if best is None:
        return "No further measurement known here lowers the errors by more than a hundredth."
    return (
        f"Most helpful beside the poses: {best.words}; it leaves {n(np.exp(-most), '.2f')} of the errors on average, "
        f"{_largest_reduction(situation, before, _deviations(best.known))}."
    )


def _options(situation: Situation) -> Iterator[Recommendation]:
    """All that is thought of and not there."""
    parameters, sensors = situation.parameters, situation.sensors
    for name, beside in BESIDE.items():
        if name in parameters.names:
            yield Recommendation(beside.words, situation.told + _tool_information(situation, name, beside))
    if sensors.tension_deviation is None:
        deviation = typical_load_cell_deviation(situation.standing.tensions)
        rows = situation.read_by(sensors.replace(tension_deviation=deviation))
        yield Recommendation(f"load cells, of {n(deviation, '.2g', 'N')}", situation.known + information_of(rows))
    if "frame_anchors" in parameters.names:
        yield from _anchors(situation)
    if sensors.position_deviation is None:
        yield from _positions(situation)


def _tool_information(situation: Situation, name: str, beside: Tool) -> Array:
    mine = np.flatnonzero([other == name for other in situation.parameters.names])
    size = situation.parameters.prior[mine] if beside.share else np.ones(len(mine))
    told = np.zeros(len(situation.scale))
    told[mine] = (situation.scale[mine] * situation.slopes[mine] / (beside.deviation * size)) ** 2
    return np.diag(told)


def _anchors(situation: Situation) -> Iterator[Recommendation]:
    """One frame anchor, or three, measured."""
    names, cables = np.array(situation.parameters.names), situation.parameters.cables
    m = situation.robot.cable_count
    rows = np.zeros((m, 3, len(names)))
    for cable in range(m):
        where = np.flatnonzero((names == "frame_anchors") & (cables == cable))
        rows[cable, range(3), where] = situation.scale[where] / TOTAL_STATION
    yield from _best_subset(situation, rows, rows, {1: "frame anchor {} measured", 3: "frame anchors {} measured"})


def _positions(situation: Situation) -> Iterator[Recommendation]:
    """The position measured at three of the poses, or six."""
    read = situation.sensors.replace(position_deviation=TOTAL_STATION)
    alone = situation.read_by(read.replace(tension_deviation=None, rotation_deviation=None))
    words = dict.fromkeys((3, 6), "the position at poses {} measured")
    yield from _best_subset(situation, alone, situation.read_by(read), words, situation.rows)


def _best_subset(
    situation: Situation, rows: Array, beside: Array, words: dict[int, str], instead: Array | None = None
) -> Iterator[Recommendation]:
    """Numbers of rows for which there are words, each the most informative subset.

    rows: information of each alone; beside: with what it comes with; instead: readings that are replaced.
    """
    found = Information(rows, situation.told)
    for _ in range(min(max(words), len(rows))):
        found.take(found.best()[0])
        if (size := len(found.chosen)) in words:
            known = situation.told + information_of(beside[found.chosen])
            if instead is not None:
                known = known - information_of(instead[found.chosen])
            listed = ", ".join(map(str, sorted(found.chosen)))
            yield Recommendation(f"{words[size].format(listed)} to {error_text(TOTAL_STATION, 'm')}", known)


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
