"""Fisher information of poses about the parameters, D-optimal choice of poses, and recommended measurements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from sagline.calibration.candidates import CandidatePoses
from sagline.calibration.log import Sensors
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.core.arrays import Array, Indices
from sagline.core.numbers import n

FEW: Final = 8  # readings per parameter; with more readings, exchanges of poses would reduce errors by less than 1 %
OPEN: Final = 1e-12  # a direction is unobservable if its singular value is below this share of the largest
ROUNDING: Final = 1e-6  # smallest squared component, in a unit vector, of a parameter that belongs to a direction
CONDITION: Final = 1e-13  # smallest prior information, relative to all candidates, that exceeds rounding errors
_WORTH: Final = 1e-9  # smallest increase of the log det by an exchange; smaller increases may be rounding errors


class Information:
    """Information about P parameters that the readings of chosen candidates contain."""

    def __init__(self, rows: Array, known: Array) -> None:
        """Begin without a chosen candidate; known: inverse (P, P) of the prior covariance."""
        self.rows = rows  # derivatives of the whitened readings by the internal parameters, (N, k, P)
        self.chosen: list[int] = []  # indices of the chosen candidates, in the order of choice
        self._known, self._unit = known, np.eye(rows.shape[1])
        # covariance (P, P) that follows from the prior and the chosen candidates
        self.covariance, self._heard = self._recompute()

    def gains(self) -> Array:
        """Increase (N,) of the log det of the information that each candidate would cause; -1 for chosen candidates."""
        gains: Array = np.linalg.slogdet(self._unit + self._heard)[1]
        gains[self.chosen] = -1.0
        return gains

    def best(self) -> tuple[int, float]:
        """The most informative candidate that is not chosen yet, and the increase of the log det that it causes."""
        gains = self.gains()
        best = int(np.argmax(gains))
        return best, float(gains[best])

    def take(self, candidate: int) -> None:
        """Add a candidate: C - C J^T (1 + J C J^T)^-1 J C; update the gains of all candidates."""
        rows = self.rows[candidate]
        across = self.covariance @ rows.T
        by = across @ np.linalg.inv(np.linalg.cholesky(self._unit + rows @ across)).T
        self.covariance = self.covariance - by @ by.T
        shares = self.rows @ by
        self._heard -= shares @ shares.transpose(0, 2, 1)
        self.chosen.append(candidate)

    def leave(self, candidate: int) -> None:
        """Remove a candidate and sum the information again; a subtraction would cause large rounding errors."""
        self.chosen.remove(candidate)
        self.covariance, self._heard = self._recompute()

    def _recompute(self) -> tuple[Array, Array]:
        """Covariance C with the chosen candidates, and the product J C J^T for each of all candidates."""
        root = np.linalg.inv(np.linalg.cholesky(self._known + information_of(self.rows[self.chosen])))
        shares = self.rows @ root.T
        return root.T @ root, shares @ shares.transpose(0, 2, 1)


def prior_information(rows: Array, root: Array) -> Array:
    """Prior information R^T R (P, P) in units of the priors, scaled up if rounding errors of `rows` would exceed it."""
    return np.asarray(root.T @ root * max(1.0, CONDITION * float((rows**2).sum())))


def choose_informative(rows: Array, known: Array, count: int) -> tuple[Indices, Array, Array]:
    """D-optimal choice of `count` candidates by a greedy algorithm; exchanges improve a choice of few candidates."""
    # Returns the indices of the chosen candidates, the most informative candidate first. Also returns the increase of
    # the log det (count,) and the deviations (count, P); row k - 1 is for the first k candidates.
    # The greedy algorithm reaches at least 1 - 1/e of the largest possible increase of the log det, because the log det
    # is submodular (Nemhauser, Wolsey & Fisher 1978). The exchanges follow Fedorov 1972.
    found = Information(rows, known)
    for _ in range(count):
        found.take(found.best()[0])
    if count < len(rows) and count * rows.shape[1] <= FEW * len(known):
        _exchange(found)
    among = np.array(sorted(found.chosen))
    again = Information(rows[among], known)
    gains, deviations = np.empty(count), np.empty((count, len(known)))
    for k in range(count):
        candidate, gains[k] = again.best()
        again.take(candidate)
        deviations[k] = np.sqrt(np.diag(again.covariance))
    return among[again.chosen], np.cumsum(gains), deviations


def _exchange(found: Information) -> None:
    """Replace each chosen candidate by the best candidate that is not chosen, if this increases the log det."""
    for candidate in tuple(found.chosen):
        found.leave(candidate)
        gains = found.gains()
        best = int(np.argmax(gains))
        found.take(best if gains[best] > gains[candidate] + _WORTH else candidate)


def deviations_of(rows: Array, held: Array, root: Array) -> Array:
    """Standard deviations (P,) of the parameters; infinite for unobserved parameters."""
    # rows: whitened slopes; held: inverse prior deviations (P,); root: `correlation_root` (P, P).
    whole = np.concatenate((rows.reshape(-1, len(held)), root * held))
    _, size, vectors = np.linalg.svd(np.linalg.qr(whole, mode="r"))  # J^T J would square the condition number
    there = size > OPEN * size[0]
    variance = ((vectors[there] / size[there, None]) ** 2).sum(axis=0)
    left = (vectors[~there] ** 2).sum(axis=0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.minimum(np.where(left > ROUNDING, np.inf, np.sqrt(variance)), 1.0 / held))


def information_of(rows: Array) -> Array:
    """Fisher information J^T J (P, P) of whitened slopes `rows` (..., P)."""
    flat = rows.reshape(-1, rows.shape[-1])
    return np.asarray(flat.T @ flat)


TOTAL_STATION: Final = 1e-3  # [m], standard deviation of each coordinate that a total station measures
CELL_SHARE: Final = 0.01  # standard deviation of a typical load cell, relative to the median tension
NEARLY: Final = 0.9  # a cheaper measurement is preferred if it has this share of the largest decrease of log errors
WORTH: Final = 0.99  # a measurement is recommended only if it multiplies the errors by a smaller factor


# For each kind of parameter: text of the measurement; standard deviation of the measurement, in the unit of the kind or
# relative to the value; True if relative.
TOOLS: Final[dict[str, tuple[str, float, bool]]] = {
    "mass": ("weighing the platform to 0.1 %", 1e-3, True),
    "linear_density": ("weighing a length of the cable to 1 %", 0.01, True),
    "axial_stiffness": ("stretching a length of the cable on a test bench, to 2 %", 0.02, True),
    "pulley_radius": ("a caliper on the pulleys, to 0.1 mm", 1e-4, False),
    "drum_radius": ("a caliper on the drums, to 0.1 mm", 1e-4, False),
    "load_cell_gain": ("a known weight on each load cell, to 0.5 %", 5e-3, True),
    "load_cell_bias": ("reading each load cell without load, to 1 N", 1.0, False),
}
Option = tuple[str, Array]  # text of an additional measurement, and the information (P, P) after it


class Situation(NamedTuple):
    """Calibration poses and the information about the parameters from measurements at these poses."""

    machine: MachineTerms  # the robot, the unknowns and the sensors
    scale: Array  # unit of each internal parameter, shape (P,)
    known: Array  # prior information, shape (P, P); small for a parameter without a prior
    standing: CandidatePoses  # the chosen poses
    rows: Array  # whitened slopes of the readings, in units of `scale`, shape (N, k, P)

    @property
    def information(self) -> Array:
        """Information after the measurements at the chosen poses, shape (P, P)."""
        return np.asarray(self.known + information_of(self.rows))

    def rows_by(self, sensors: Sensors) -> Array:
        """Whitened slopes (N, m + 6, P) that the sensors `sensors` would have at the poses, in units of `scale`."""
        poses, lengths = self.standing.poses, self.standing.lengths
        return np.asarray(predicted_rows(self.machine.with_sensors(sensors), poses, lengths).matrix * self.scale)


def most_helpful(situation: Situation) -> str:
    """Sentence that recommends the measurement with the largest reduction of the mean log error."""
    before = _deviations(situation.information)
    best: Option | None = None
    most = -np.log(WORTH)
    for option in _options(situation):  # cheap options come before expensive options
        fall = float(np.log(before / _deviations(option[1])).mean())
        if fall > most / (1.0 if best is None else NEARLY):
            best, most = option, fall
    if best is None:
        return "No additional measurement of the list reduces the errors by more than 1 %."
    return (
        f"Best additional measurement: {best[0]}. It multiplies the errors by {n(np.exp(-most), '.2f')} on average; "
        f"{_largest_reduction(situation, before, _deviations(best[1]))}."
    )


def _options(situation: Situation) -> Iterator[Option]:
    """Possible additional measurements, with the information after each measurement."""
    parameters, sensors = situation.machine.parameters, situation.machine.sensors
    for name, (words, deviation, is_share) in TOOLS.items():
        if name in parameters.names:
            mine = np.flatnonzero([other == name for other in parameters.names])
            size = parameters.prior[mine] if is_share else np.ones(len(mine))
            gain = np.zeros(len(situation.scale))
            gain[mine] = (situation.scale[mine] * situation.machine.slopes[mine] / (deviation * size)) ** 2
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
    """Options to measure one frame anchor or three frame anchors."""
    names, cables = np.array(situation.machine.parameters.names), situation.machine.parameters.cables
    m = situation.machine.robot.cable_count
    rows = np.zeros((m, 3, len(names)))
    for cable in range(m):
        where = np.flatnonzero((names == "frame_anchors") & (cables == cable))
        rows[cable, range(3), where] = situation.scale[where] / TOTAL_STATION
    yield from _best_subset(situation, rows, rows, {1: "frame anchor {} measured", 3: "frame anchors {} measured"})


def _measured_positions(situation: Situation) -> Iterator[Option]:
    """Options to measure the position of the platform at three or six of the poses."""
    sensors = situation.machine.sensors.replace(position_deviation=TOTAL_STATION)
    alone = situation.rows_by(sensors.replace(tension_deviation=None, rotation_deviation=None))
    words = dict.fromkeys((3, 6), "the position at poses {} measured")
    yield from _best_subset(situation, alone, situation.rows_by(sensors), words, situation.rows)


def _best_subset(
    situation: Situation, rows: Array, beside: Array, words: dict[int, str], instead: Array | None = None
) -> Iterator[Option]:
    """Most informative sets of measurements; the keys of `words` are the numbers of measurements in a set."""
    # rows: whitened slopes of each measurement alone; beside: rows to add for a measurement; instead: rows to replace.
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
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(known))))


def _largest_reduction(situation: Situation, before: Array, after: Array) -> str:
    """Text about the kind of parameter with the largest reduction of errors."""
    names = np.array(situation.machine.parameters.names)
    name = min(dict.fromkeys(names), key=lambda name: float(np.log(after / before)[names == name].mean()))
    mine = names == name
    unit = situation.machine.parameters.units[int(np.argmax(mine))]
    size = situation.scale * np.abs(situation.machine.slopes)
    one, other = (error_text(float(np.sqrt(np.mean((each * size)[mine] ** 2))), unit) for each in (before, after))
    return f"the errors of {name} fall from {one} to {other}"


def error_text(value: float, unit: str) -> str:
    """Text of an error with two digits; an error in meters is written in millimeters."""
    return n(1e3 * value, ".2g", "mm") if unit == "m" else n(value, ".2g", unit)


def typical_load_cell_deviation(tensions: Array) -> float:
    """Standard deviation [N] of commercial load cells that are suitable for the tensions (N, m)."""
    return float(f"{CELL_SHARE * float(np.median(tensions)):.1g}")
