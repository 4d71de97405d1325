"""The poses and tensions worth measuring."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sagline.cables.catenary import Catenary
from sagline.calibration.calibrate import UNKNOWNS
from sagline.calibration.candidates import Candidates, candidates_of
from sagline.calibration.chosen_poses import CalibrationPoses
from sagline.calibration.further import Situation, most_helpful, usual_cells
from sagline.calibration.information import Choice, deviations_of, ground, most_telling, told_by
from sagline.calibration.observing import observed
from sagline.calibration.paid import can_count
from sagline.calibration.parameters import parameters_of, slopes_of_values
from sagline.calibration.sensors import Sensors
from sagline.calibration.tour import short_tour
from sagline.calibration.unknowns import KINDS, Parameters, Unknown
from sagline.core.arguments import callback, instance, optional, whole_number
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.memory import check_memory
from sagline.core.progress import Progress
from sagline.robot.pattern import ROTATING
from sagline.robot.pose import Pose
from sagline.robot.pose_box import PoseBox
from sagline.robot.robot import Robot

MOST: Final = 1_000  # poses; nobody stands at more
MOST_CANDIDATES: Final = 20_000
DRAWS: Final = 21  # of random poses, whose middle is told
ENOUGH: Final = 0.01  # of an error: by less nobody sees it fall
SEEN: Final = 3.0  # of what is known beforehand: readings that tell so much lower an error by half
LOOSE: Final = 10.0  # usual deviations of what a drawing does not give: the unit of what nothing is known of
_CATENARY: Final = Catenary()


def calibration_poses(
    robot: Robot,
    count: int,
    unknowns: Sequence[str | Unknown] = UNKNOWNS,
    sensors: Sensors | None = None,
    *,
    box: PoseBox | None = None,
    candidates: int = 500,
    seed: int = 0,
    progress: Progress | None = None,
) -> CalibrationPoses:
    """The poses and tension sets that tell most of what is unknown, before anybody measures.

    Of feasible poses of a box, each with several sets of tensions, those are chosen that lower the volume of what
    remains possible most: D-optimal, greedily. Sets of tensions at one pose follow each other.

    Args:
        robot: The robot as it is believed to be.
        count: How many sets of readings are to be taken, 1 to 1,000.
        unknowns: What is to be found, as of `calibrate`.
        sensors: What will read, at every pose; None for load cells of 1 % of the tension in the middle (or the
            load_cell_deviation of the winches) and lengths good to 0.5 mm.
        box: Where the platform may stand; None for the robot's test_box.
        candidates: Among how many poses and sets of tensions is chosen, `count` to 20,000.
        seed: Of the candidates, and of the random poses to compare with.
        progress: Called after every few candidates: how many poses are tried, of how many.

    Returns:
        The poses, their tensions and lengths, and the errors to expect.

    Raises:
        InvalidValueError: If there is no box, not enough of it is feasible, sensors read nothing that tells of the
            unknowns, or an argument is of the wrong kind or out of range; the message says what to give.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> plan = sl.calibration_poses(robot, 40, ("frame_anchors", "length_zero"))
        >>> print(len(plan), bool((plan.expected_error < plan.random_error).all()))
        40 True

    Source:
        Fedorov 1972; Borm & Menq 1991 (poses to calibrate robots by); docs/model.md, section 14.
    """
    instance(robot, Robot, "robot")
    size = whole_number(count, "count", 1, MOST)
    tried = whole_number(candidates, "candidates", size, MOST_CANDIDATES)
    drawn = whole_number(seed, "seed", 0)
    optional(sensors, Sensors, "sensors")
    callback(progress, "progress")
    where = _box(robot, box)
    standing = candidates_of(robot, _CATENARY, where, tried, drawn, progress)
    read = sensors or _usual_sensors(robot, standing.tensions)
    if read.tension_deviation is None and read.position_deviation is None and read.rotation_deviation is None:
        step = "Give Sensors(tension_deviation=...), or leave sensors out."
        raise InvalidValueError("sensors", "lengths alone", "load cells, positions or rotations beside them", step)
    parameters = parameters_of(robot, unknowns, read, counted=can_count(robot))
    check_memory(
        f"{tried:,} candidates",
        8.0 * 3.0 * tried * (robot.cable_count + 6) * len(parameters.names),
        "Ask for fewer candidates.",
    )
    slopes = slopes_of_values(robot, parameters)
    scale, held = _scale(parameters, slopes)
    rows = observed(robot, _CATENARY, parameters, read, standing.poses, standing.lengths).matrix * scale
    stable = np.flatnonzero(np.isfinite(rows).all(axis=(1, 2)))
    standing, rows = standing.part(stable), _read(rows[stable])
    _refuse(robot, parameters, size, tried, rows)
    known, unit = ground(rows), scale * np.abs(slopes)
    choice = most_telling(rows, known, size)
    order = choice.order[_driven(standing.part(choice.order))]
    chosen, told, random = standing.part(order), rows[order], _random(rows, standing.usual, size, drawn)
    return CalibrationPoses(
        robot=robot,
        sensors=read,
        parameters=parameters,
        poses=Pose.from_quaternion(chosen.poses[:, :3], chosen.poses[:, 3:]),
        frame_end_tension=chosen.tensions,
        unstrained_length=chosen.lengths,
        expected_error=locked(deviations_of(told, held) * unit),
        random_error=locked(np.median([deviations_of(other, held) for other in random], axis=0) * unit),
        share_of_random=_share(known, told, random),
        gain=locked(choice.gain),
        enough=_enough(choice),
        most_helpful=most_helpful(Situation(robot, _CATENARY, parameters, read, scale, slopes, known, chosen, told)),
    )


def _box(robot: Robot, box: PoseBox | None) -> PoseBox:
    if box is None and robot.test_box is None:
        step = "Give box=PoseBox(low, high, tilt), where its platform may stand."
        raise InvalidValueError("box", f"missing, and {robot.name} has no test_box", "a PoseBox", step)
    found = optional(box, PoseBox, "box") or robot.test_box
    assert found is not None
    if found.tilt > 0.0 and robot.motion_pattern not in ROTATING:
        allowed = f"0 rad, by motion_pattern {robot.motion_pattern}: its platform does not turn"
        step = "Give box=PoseBox(low, high), without a tilt."
        raise InvalidValueError("box: tilt", f"{found.tilt:g} rad", allowed, step)
    return found


def _usual_sensors(robot: Robot, tensions: Array) -> Sensors:
    winches = robot.winches
    if winches is not None and (winches.load_cell_deviation > 0.0).all():
        return Sensors(tension_deviation=winches.load_cell_deviation)
    return Sensors(tension_deviation=usual_cells(tensions))


def _scale(parameters: Parameters, slopes: Array) -> tuple[Array, Array]:
    """A unit of each internal parameter, and the inverse of its deviation beforehand in it: 1, or less, or 0."""
    deviation = parameters.prior_deviation / np.abs(slopes)
    loose = np.array([LOOSE * KINDS[name].assumed for name in parameters.names])
    scale = np.fmin(deviation, loose)
    return scale, scale / deviation


def _read(rows: Array) -> Array:
    """Rows of sensors that are there; where they tell of nothing, one of zeros."""
    there = rows.any(axis=(0, 2))
    return np.ascontiguousarray(rows[:, there] if there.any() else rows[:, :1])


def _refuse(robot: Robot, parameters: Parameters, count: int, tried: int, rows: Array) -> None:
    """Refuse to choose among too few poses, or for unknowns that none of them tells of."""
    if len(rows) < count:
        value = f"{count}, with {len(rows)} of {tried} candidates feasible and stable"
        step = "Ask for fewer, raise candidates, or give a box of which more is feasible."
        raise InvalidValueError("count", value, f"1 to {len(rows)}", step)
    names, told = np.array(parameters.names), np.abs(rows).max(axis=(0, 1)) > 0.0
    for name in dict.fromkeys(parameters.names):
        mine = names == name
        if not told[mine].any() and not parameters.stated[mine].any():
            step = f"Leave it out, add sensors, or say what is known: Unknown('{name}', deviation=...)."
            raise InvalidValueError(f"unknown: {name}", "seen by no reading", "what readings tell of", step)


def _driven(chosen: Candidates) -> Indices:
    """An order that is short to drive: through the positions, at each from the least sum of tensions to the largest."""
    _, first, place = np.unique(chosen.place, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[short_tour(chosen.poses[first, :3])] = np.arange(len(first))
    return np.lexsort((chosen.tensions.sum(axis=1), rank[place]))


def _random(rows: Array, usual: Flags, count: int, seed: int) -> list[Array]:
    """Slopes at poses that nobody chose, some draws of (count, k, P)."""
    rng = np.random.default_rng((seed, 1))
    pool = np.flatnonzero(usual) if usual.sum() >= count else np.arange(len(rows))
    return [rows[rng.choice(pool, count, replace=False)] for _ in range(DRAWS)]


def _share(known: Array, told: Array, random: list[Array]) -> float:
    """Errors by what is told, as a share of those of random poses, in directions that these lower by half or more."""
    own, *others = (told_by(each) for each in (told, *random))
    size, vectors = np.linalg.eigh(np.mean(others, axis=0))
    seen = vectors[:, size > SEEN]
    if not seen.size:
        return 1.0
    variance = [np.einsum("pk,pk->k", seen, np.linalg.solve(known + each, seen)) for each in (own, *others)]
    return float(np.exp(0.5 * np.log(variance[0] / np.median(variance[1:], axis=0)).mean()))


def _enough(choice: Choice) -> int:
    """From how many poses on another one lowers no error by more than a hundredth."""
    lowered = (1.0 - choice.deviation[1:] / choice.deviation[:-1]).max(axis=1)
    still = np.flatnonzero(lowered > ENOUGH)
    return int(still[-1]) + 2 if still.size else 1
