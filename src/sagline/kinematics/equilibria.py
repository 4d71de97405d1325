"""Search for all stable equilibria of a platform at given lengths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import check_memory, instance, whole_number
from sagline.core.arrays import Array, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels import tables
from sagline.kinematics.forward import checked_lengths, from_orientations, start_quaternions
from sagline.kinematics.forward_rows import ForwardRows, ForwardSolution, iterate_routing
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.checks import PLANAR, ROTATING
from sagline.robot.robot import Robot
from sagline.robot.routing import differs, with_routing
from sagline.statics.balance import external_wrench

START_BYTES = 250.0  # memory per cable and per start of the search [bytes]
_SAME = 1e-6  # two poses count as equal if their distance (relative to the mean length) and angle [rad] are smaller
_KEPT = (*STABLE, ForwardStatus.FITTED)
_CATENARY = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Equilibria(Result, Tabular):
    """Result of `equilibria`: K stable equilibria, in order of increasing energy.

    Attributes:
        solutions: The equilibria, a batch of K.
        reached: For each equilibrium, number of starts of the search that ended in it, shape (K,). The number of starts
            is not a probability.
        starts: Number of all starts of the search. A start may also end at an unstable equilibrium, or may not
            converge.
    """

    _columns: ClassVar[Columns] = (
        "solutions.pose",
        "solutions.stiffness_min",
        "reached",
        ("solutions.status", ForwardStatus),
    )

    solutions: ForwardSolution
    reached: Indices
    starts: int

    def __len__(self) -> int:
        """Number K of equilibria."""
        return len(self.reached)


def equilibria(
    robot: Robot,
    unstrained_length: ArrayLike,
    model: CableModel | str = _CATENARY,
    wrench: ArrayLike | None = None,
    starts: int = 300,
    seed: int = 0,
) -> Equilibria:
    """Stable equilibria of a robot at given lengths, found by a search over orientations.

    For a fixed orientation, the energy is convex in the position, so that the platform has only one equilibrium
    position. The search therefore starts at random orientations (uniformly distributed), each at its equilibrium
    position. A robot without rotations has exactly one equilibrium. For other robots, the list can be incomplete,
    because perhaps no start reaches some equilibrium.

    Args:
        robot: The robot, with m cables.
        unstrained_length: L [m], > 0, shape (m,).
        model: Cable model. The shallow models have no energy. Equilibria of a shallow model are sorted by the number of
            starts. For straight cables, the results are local least-squares fits, sorted by their sum of squares.
        wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for zero.
        starts: Number of initial orientations, >= 1.
        seed: Seed of the random orientations.

    Returns:
        Equilibria.

    Raises:
        InvalidValueError: If a length is wrong: the message names the cable. If `starts` is below 1 or needs too much
            memory. If an argument has the wrong type.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> pose = sl.Pose.from_euler((1.0, 0.5, 2.0), 0.0, 0.0, 0.0)
        >>> lengths = sl.inverse(robot, pose).unstrained_length
        >>> found = sl.equilibria(robot, lengths, starts=20)

    Source:
        docs/model.md, section 6.
    """
    model = model_of(model)
    lengths = checked_lengths(instance(robot, Robot, "robot"), unstrained_length)
    if lengths.ndim != 1 or np.isnan(lengths).any():
        allowed, step = f"({robot.cable_count},), no NaN", "Give the lengths of one sample."
        raise InvalidValueError("unstrained_length", f"of shape {lengths.shape}", allowed, step)
    starts, seed = whole_number(starts, "starts", 1), whole_number(seed, "seed", 0)
    check_memory("starts", START_BYTES * starts * robot.cable_count, "Choose fewer starts.")
    load = external_wrench(wrench, None)
    quaternions = _quaternions(robot, starts, seed)
    samples = locked(np.repeat(lengths[None], len(quaternions), axis=0))
    loads = locked(load[None].copy())
    found = from_orientations(robot, model, samples, loads, quaternions)
    if differs(robot, None):
        found = iterate_routing(robot, model, found, samples, loads, None)
    chosen, reached = _distinct(found, float(lengths.mean()))
    solutions = found.part(chosen).solution(robot, model, load, (len(chosen),))
    solutions = replace(solutions, state=with_routing(solutions.state, None))
    return Equilibria(solutions, locked(reached), len(quaternions))


def _quaternions(robot: Robot, count: int, seed: int) -> Array:
    """Start orientations (K, 4): level, then tilted, then uniformly random within the free rotations."""
    known = start_quaternions(robot)
    if robot.motion_pattern not in ROTATING or count <= len(known):
        return known[:count]
    generator = np.random.default_rng(seed)
    rest = count - len(known)
    if robot.motion_pattern in PLANAR:
        half = generator.uniform(-0.5 * np.pi, 0.5 * np.pi, (rest, 1))
        drawn = np.hstack((np.sin(half) * robot.freedom[2, 3:], np.cos(half)))
    else:
        drawn = generator.normal(size=(rest, 4))
        drawn /= np.linalg.norm(drawn, axis=1, keepdims=True)
    return np.vstack((known, drawn))


def _distinct(found: ForwardRows, length: float) -> tuple[Indices, Indices]:
    """Index of each different stable equilibrium, in order of energy, and number of starts that ended in it."""
    counts: dict[int, int] = {}  # key: index of an equilibrium that differs from all others
    for index in np.flatnonzero(np.isin(found.pose_status, _KEPT)).tolist():
        same = (k for k in counts if _distance(found.poses[index], found.poses[k], length) < _SAME)
        chosen = next(same, index)
        counts[chosen] = counts.get(chosen, 0) + 1
    different, reached = (np.array([*each], dtype=np.int64) for each in (counts, counts.values()))
    energy = np.nan_to_num(found.numbers[different, tables.ENERGY], nan=0.0)
    order = np.lexsort((-reached, energy))
    return different[order], reached[order]


def _distance(row: Array, other: Array, length: float) -> float:
    """Distance of two pose rows: their relative displacement or their angle, whichever is larger."""
    shift = float(np.linalg.norm(row[:3] - other[:3])) / length
    sign = np.copysign(1.0, row[3:] @ other[3:])
    return max(shift, 2.0 * float(np.linalg.norm(row[3:] - sign * other[3:])))
