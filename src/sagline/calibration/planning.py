"""Choice of calibration poses before any measurement, and text of the chosen poses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Final

import numpy as np

from sagline.cables.models import Catenary
from sagline.calibration import information
from sagline.calibration.candidates import CandidatePoses, candidates_of, shortest_tour, tour_length
from sagline.calibration.findings import UNITS
from sagline.calibration.log import READINGS, Sensors
from sagline.calibration.observations import MachineTerms, predicted_rows
from sagline.calibration.parameters import DEFAULT, Parameters, Unknown, correlation_root, parameters_of
from sagline.core.arguments import callback, check_memory, instance, optional, whole_number
from sagline.core.arrays import Array, Flags, Indices, Progress, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import SPACE, counted, n
from sagline.core.results import Result, Saved
from sagline.robot.checks import ROTATING
from sagline.robot.drum import has_drum_data
from sagline.robot.pose import Pose, PoseBox
from sagline.robot.robot import Robot

WIDTH: Final = 80
COLUMNS: Final = (20, 9, 13, 13, 15)  # widths of the columns of the table of errors, in characters
NARROW: Final = (16, 8, 9, 11, 13)  # the same widths for a narrow terminal
WIDE: Final = 2 + sum(COLUMNS)
KILO: Final = 1e4  # [N]; tensions are written in kN if one of them exceeds this value
FAR: Final = 100.0  # [m]; positions are written with fewer decimals if one of them exceeds this value


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CalibrationPoses(Result, Saved):
    """Result of `calibration_poses`, in the order of a short tour.

    Attributes:
        robot: The robot.
        sensors: The sensors with readings at every pose.
        parameters: The unknowns.
        poses: Poses, N of them.
        frame_end_tension: Tensions at the frame ends [N], (N, m).
        unstrained_length: Unstrained lengths off the drums [m], (N, m).
        expected_error: Standard error of each parameter after a calibration at the poses, in its unit, (P,).
        random_error: Standard error of each parameter with N random poses, as a median over sets of poses, (P,).
        share_of_random: Errors with the chosen poses divided by errors with random poses, as a geometric mean over the
            observable directions. The errors of single parameters also contain unobservable directions, such as a shift
            of the world, which no choice of poses can improve.
        gain: Increase of the log det of the information by the first k chosen poses, k = 1 to N, (N,).
        enough: Number of poses after which one more pose reduces no error by more than 1 %; N if every pose helps more.
        most_helpful: Sentence that recommends an additional measurement.
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
        """Text of the expected errors, in lines of at most 80 characters."""
        return poses_text(self)

    def table(self) -> str:
        """Text with poses and tensions, one pose per line."""
        return poses_table(self)


def poses_text(plan: CalibrationPoses, width: int = WIDTH) -> str:
    """Text with expected errors at the chosen poses and at random poses, in lines of at most `width` characters."""
    position, read, share = plan.poses.position, plan.sensors, plan.share_of_random
    places = position[np.concatenate(([True], (np.diff(position, axis=0) != 0.0).any(axis=1)))]  # no repetition
    way = n(tour_length(places, np.arange(len(places))), ".3g", "m")
    what = f"{counted(len(plan), 'pose')} to find {counted(len(plan.parameters.names), 'number')} of {plan.robot.name}"
    deviations = [getattr(read, name) for name in ("length_deviation", *READINGS.values())]
    texts = [
        f"{quantity}s ({information.error_text(float(np.max(deviation[np.isfinite(deviation)])), UNITS[quantity])})"
        for quantity, deviation in zip(UNITS, deviations, strict=True)
        if deviation is not None and quantity != "frequency"
    ]
    if plan.enough < len(plan):
        enough = f"With {counted(plan.enough, 'pose')}, an additional pose reduces no error by more than 1{SPACE}%."
    else:
        enough = f"More poses still help: an additional pose reduces an error by more than 1{SPACE}%."
    lines = [
        *wrap(f"{what}: {counted(len(places), 'place')}, {way} to drive", width),
        *wrap(f"read by {' and '.join(texts)}", width, initial_indent="  ", subsequent_indent="  "),
        *_errors(plan, width),
        *wrap(
            f"In the observable directions, the errors are {n(share, '.2f')} times the errors of random poses. "
            f"{n(share**-2, '.2g')} times as many random poses have the same errors.",
            width,
        ),
        *wrap(enough, width),
        *wrap(plan.most_helpful, width),
    ]
    return "\n".join(lines).replace(SPACE, " ")


def poses_table(plan: CalibrationPoses, width: int = WIDTH) -> str:
    """Text with poses and tensions in driving order, one pose per line; lines longer than `width` are wrapped."""
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
    """Cells of a table column of equal width: the heading `head`, then the numbers."""
    cells = [head, *(f"{round(float(value), decimals) + 0.0:.{decimals}f}" for value in values)]
    width = 1 + max(map(len, cells))
    return [f"{cell:>{width}}" for cell in cells]


def _errors(plan: CalibrationPoses, width: int) -> Iterator[str]:
    """Lines with the root mean square of the errors for each kind of parameter."""
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
                information.error_text(float(np.sqrt(np.mean(one[mine] ** 2))), str(unit)) for one in errors
            )
            cells = zip((mine.sum(), before, after, usual), others, strict=True)
            yield f"  {name:<{first}}" + "".join(f"{cell:>{own}}" for cell, own in cells)


MOST: Final = 1_000  # largest number of poses; the measurement of more poses would take days
MOST_CANDIDATES: Final = 20_000
DRAWS: Final = 21  # number of sets of random poses, for a median of their errors
ENOUGH: Final = 0.01  # a smaller relative improvement of an error is irrelevant
SEEN: Final = 3.0  # information of a direction divided by its prior information; 3 halves the error
LOOSE: Final = 10.0  # largest unit of a parameter, in multiples of the usual deviation of an unknown value
_CATENARY: Final = Catenary()


def calibration_poses(
    robot: Robot,
    count: int,
    unknowns: Sequence[str | Unknown] | None = None,
    sensors: Sensors | None = None,
    *,
    box: PoseBox | None = None,
    candidates: int = 500,
    seed: int = 0,
    progress: Progress | None = None,
) -> CalibrationPoses:
    """Choose the most informative poses and tension sets for the unknowns, before any measurement.

    A greedy algorithm with exchanges makes a D-optimal choice among candidates. The candidates are feasible poses of a
    box, each with several sets of tensions. The result lists all chosen sets of tensions of a pose before the next
    pose.

    Args:
        robot: The robot before the calibration.
        count: Number of sets of readings, each at one pose with one set of tensions, 1 to 1,000.
        unknowns: Parameters to estimate, as in `calibrate`.
        sensors: Sensors with readings at every pose; None for lengths with a deviation of 0.5 mm, and load cells with
            the load_cell_deviation of the winches, or 1 % of the median tension.
        box: Box of poses; None for the robot's test_box.
        candidates: Number of candidates, `count` to 20,000; a candidate is a pose with one set of tensions.
        seed: Seed of the random numbers that determine the candidates and the random poses for comparison.
        progress: Called repeatedly with the number of finished poses and the number of all poses.

    Returns:
        The poses, their tensions and lengths, and the expected errors.

    Raises:
        InvalidValueError: If `box` is missing, or has too few feasible poses; if no reading depends on an unknown; if
            an argument has a wrong type or is out of range.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> plan = sl.calibration_poses(robot, 40, ("frame_anchors", "length_zero"))
        >>> print(len(plan), bool((plan.expected_error < plan.random_error).all()))
        40 True

    Source:
        Fedorov 1972; Borm & Menq 1991 (choice of calibration poses); docs/model.md, section 14.
    """
    instance(robot, Robot, "robot")
    size = whole_number(count, "count", 1, MOST)
    tried = whole_number(candidates, "candidates", size, MOST_CANDIDATES)
    drawn = whole_number(seed, "seed", 0)
    optional(sensors, Sensors, "sensors")
    callback(progress, "progress")
    where = _box(robot, box)
    standing = candidates_of(robot, _CATENARY, where, tried, drawn, progress)
    read = sensors or _default_sensors(robot, standing.tensions)
    if all(getattr(read, deviation) is None for name, deviation in READINGS.items() if name != "frequency"):
        step = "Give Sensors(tension_deviation=...), or leave sensors out."
        raise InvalidValueError("sensors", "lengths alone", "load cells, positions or rotations in addition", step)
    parameters = parameters_of(robot, (DEFAULT,) if unknowns is None else unknowns, read, counted=has_drum_data(robot))
    check_memory(
        f"{tried:,} candidates",
        8.0 * 3.0 * tried * (robot.cable_count + 6) * len(parameters.names),
        "Ask for fewer candidates.",
    )
    machine = MachineTerms(robot, _CATENARY, parameters, read)
    scale, held = _scale(parameters, machine.slopes)
    rows = predicted_rows(machine, standing.poses, standing.lengths).matrix * scale
    stable = np.flatnonzero(np.isfinite(rows).all(axis=(1, 2)))
    standing, rows = standing.part(stable), _read(rows[stable])
    _refuse(robot, parameters, size, tried, rows)
    root, unit = correlation_root(parameters), scale * np.abs(machine.slopes)
    known = information.prior_information(rows, root)
    chosen, gain, deviation = information.choose_informative(rows, known, size)
    order = chosen[_driving_order(standing.part(chosen))]
    poses, own, random = standing.part(order), rows[order], _random(rows, standing.usual, size, drawn)
    return CalibrationPoses(
        robot=robot,
        sensors=read,
        parameters=parameters,
        poses=Pose.from_quaternion(poses.poses[:, :3], poses.poses[:, 3:]),
        frame_end_tension=poses.tensions,
        unstrained_length=poses.lengths,
        expected_error=locked(information.deviations_of(own, held, root) * unit),
        random_error=locked(
            np.median([information.deviations_of(other, held, root) for other in random], axis=0) * unit
        ),
        share_of_random=_share(known, own, random),
        gain=locked(gain),
        enough=_sufficient_count(deviation),
        most_helpful=information.most_helpful(information.Situation(machine, scale, known, poses, own)),
    )


def _box(robot: Robot, box: PoseBox | None) -> PoseBox:
    if box is None and robot.test_box is None:
        step = "Give box=PoseBox(low, high, tilt) with the allowed poses."
        raise InvalidValueError("box", f"missing, and {robot.name} has no test_box", "a PoseBox", step)
    found = optional(box, PoseBox, "box") or robot.test_box
    assert found is not None
    if found.tilt > 0.0 and robot.motion_pattern not in ROTATING:
        allowed = f"0 rad, because a platform with motion_pattern {robot.motion_pattern} cannot rotate"
        step = "Give box=PoseBox(low, high), without a tilt."
        raise InvalidValueError("box: tilt", f"{found.tilt:g} rad", allowed, step)
    return found


def _default_sensors(robot: Robot, tensions: Array) -> Sensors:
    winches = robot.winches
    if winches is not None and (winches.load_cell_deviation > 0.0).all():
        return Sensors(tension_deviation=winches.load_cell_deviation)
    return Sensors(tension_deviation=information.typical_load_cell_deviation(tensions))


def _scale(parameters: Parameters, slopes: Array) -> tuple[Array, Array]:
    """Units (P,) of the internal parameters, and inverse prior deviations (P,) in these units; 0 without a prior."""
    deviation = parameters.prior_deviation / np.abs(slopes)
    loose = LOOSE * parameters.usual_deviation
    scale = np.fmin(deviation, loose)
    return scale, scale / deviation


def _read(rows: Array) -> Array:
    """Rows of `rows` that belong to a sensor with readings; one row of zeros if no sensor has readings."""
    there = rows.any(axis=(0, 2))
    return np.ascontiguousarray(rows[:, there] if there.any() else rows[:, :1])


def _refuse(robot: Robot, parameters: Parameters, count: int, tried: int, rows: Array) -> None:
    """Reject a box with fewer feasible poses than `count`, and unknowns with neither readings nor a prior."""
    if len(rows) < count:
        value = f"{count}, with {len(rows)} of {tried} candidates feasible and stable"
        step = "Give a smaller count, more candidates, or a box with more feasible poses."
        raise InvalidValueError("count", value, f"1 to {len(rows)}", step)
    names, observed = np.array(parameters.names), np.abs(rows).max(axis=(0, 1)) > 0.0
    for name in dict.fromkeys(parameters.names):
        mine = names == name
        if not observed[mine].any() and not parameters.stated[mine].any():
            step = f"Omit this unknown, add sensors, or give a prior: Unknown('{name}', deviation=...)."
            raise InvalidValueError(f"unknown: {name}", "observed by no reading", "observed, or with a prior", step)


def _driving_order(chosen: CandidatePoses) -> Indices:
    """Order of the candidates: a short tour of the positions; at each position, the sum of tensions increases."""
    _, first, place = np.unique(chosen.place, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[shortest_tour(chosen.poses[first, :3])] = np.arange(len(first))
    return np.lexsort((chosen.tensions.sum(axis=1), rank[place]))


def _random(rows: Array, usual: Flags, count: int, seed: int) -> list[Array]:
    """Whitened slopes (count, k, P) of `DRAWS` sets of `count` random poses."""
    rng = np.random.default_rng((seed, 1))
    pool = np.flatnonzero(usual) if usual.sum() >= count else np.arange(len(rows))
    return [rows[rng.choice(pool, count, replace=False)] for _ in range(DRAWS)]


def _share(known: Array, rows: Array, random: list[Array]) -> float:
    """Ratio of errors to errors with random poses, in directions in which random poses at least halve prior errors."""
    own, *others = (information.information_of(each) for each in (rows, *random))
    size, vectors = np.linalg.eigh(np.mean(others, axis=0))
    seen = vectors[:, size > SEEN]
    if not seen.size:
        return 1.0
    variance = [np.einsum("pk,pk->k", seen, np.linalg.solve(known + each, seen)) for each in (own, *others)]
    return float(np.exp(0.5 * np.log(variance[0] / np.median(variance[1:], axis=0)).mean()))


def _sufficient_count(deviation: Array) -> int:
    """Number of poses after which one more pose reduces no error by more than 1 %; deviation: errors (N, P)."""
    lowered = (1.0 - deviation[1:] / deviation[:-1]).max(axis=1)
    still = np.flatnonzero(lowered > ENOUGH)
    return int(still[-1]) + 2 if still.size else 1
