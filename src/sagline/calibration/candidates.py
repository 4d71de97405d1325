"""Candidates for calibration poses: feasible poses of a box, each with several sets of tensions; short tours."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Flags, Indices, Progress, blocks, locked
from sagline.core.errors import CableGeometryError, InvalidValueError
from sagline.kinematics.inverse import inverse
from sagline.kinematics.status import PoseStatus
from sagline.robot.checks import ROTATING
from sagline.robot.pose import Pose, PoseBox
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows
from sagline.tension.method import TensionMethod
from sagline.tension.methods import MinimumNorm, QuadraticProgram

MOST_SETS: Final = 5  # number of sets of tensions at one pose
ROUNDS: Final = 6  # largest number of draws of random poses; a box with many infeasible poses needs more than one
KEPT: Final = 0.02  # margin at both tension limits, as a share of their range; actual and planned tensions differ
GROUP: Final = 20  # number of poses with the same random target corners of the tension range
UNLIMITED: Final = 3.0  # multiple of the largest minimum-norm tension that replaces an infinite tension limit
SAME: Final = 1e-6  # two sets of tensions are equal if they differ by less than this share of the largest tension


class CandidatePoses(NamedTuple):
    """Candidates for calibration poses: N equilibria, each with a pose, lengths and tensions."""

    poses: Array  # pose rows, shape (N, POSE_COLUMNS)
    lengths: Array  # unstrained lengths off the drums [m], shape (N, m)
    tensions: Array  # tensions at the frame ends [N], shape (N, m)
    place: Indices  # index of the pose, shape (N,); all sets of tensions at one pose have the same index
    usual: Flags  # True if the pose belongs to the uniform distribution over the box, shape (N,)

    def part(self, which: Flags | Indices | slice) -> CandidatePoses:
        """Subset of the candidates."""
        return CandidatePoses(*(locked(np.ascontiguousarray(each[which])) for each in self))


def candidates_of(
    robot: Robot, model: CableModel, box: PoseBox, count: int, seed: int, progress: Progress | None = None
) -> CandidatePoses:
    """At most `count` feasible poses of `box`, each with several sets of tensions near corners of the tension range."""
    # Half of the poses are uniformly distributed in the box. Half of the poses are nearer to the faces of the box and
    # to the largest tilt, where readings are most informative. Raises an error with the reason if no pose is feasible.
    rng = np.random.default_rng(seed)
    sets = min(MOST_SETS, 1 + 2 * max(robot.cable_count - robot.degrees_of_freedom, 0))
    for kept in (KEPT, 0.0):
        found: list[CandidatePoses] = []
        statuses: list[Codes] = []
        first, missing = 0, count
        for _ in range(ROUNDS):
            drawn = _random_poses(robot, box, -(-missing // sets), rng)
            own, status = _feasible(_with_margins(robot, model, drawn, kept), model, drawn, sets, rng, progress)
            found.append(own._replace(place=own.place + first))
            statuses.append(status)
            first += len(drawn)
            missing -= len(own.place)
            if missing <= 0 or not found[0].place.size:
                break
        if found[0].place.size:
            return _concatenated(found).part(slice(count))
    raise _none_feasible(robot, np.concatenate(statuses))


def _concatenated(parts: list[CandidatePoses]) -> CandidatePoses:
    return CandidatePoses(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _random_poses(robot: Robot, box: PoseBox, count: int, rng: np.random.Generator) -> Pose:
    """Random poses of a box: in turn a pose of a uniform distribution, and a pose that tends to be near the borders."""
    share, part = rng.uniform(size=(count, 3)), rng.uniform(size=count)
    share[1::2] = 0.5 - 0.5 * np.cos(np.pi * share[1::2])
    part[1::2] **= 0.25
    position = box.low + share * (box.high - box.low)
    axis = rng.normal(size=(count, 3))
    if robot.plane_normal is not None:
        away = (position - 0.5 * (box.low + box.high)) @ robot.plane_normal
        position -= away[:, None] * robot.plane_normal
        axis = np.sign(axis[:, :1]) * robot.plane_normal
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    half = 0.5 * part * (box.tilt if robot.motion_pattern in ROTATING else 0.0)
    turned = np.concatenate((np.sin(half)[:, None] * axis, np.cos(half)[:, None]), axis=1)
    return Pose.from_quaternion(position, turned)


def _with_margins(robot: Robot, model: CableModel, poses: Pose, kept: float) -> Robot:
    """Robot with finite tension limits, which leave a margin: the share `kept` of the original range at each end."""
    low, high = robot.tension_min, robot.tension_max
    if np.isinf(high).any():
        least = np.nan_to_num(_solve(robot, model, poses[:GROUP], MinimumNorm())[2])
        high = np.where(np.isinf(high), UNLIMITED * max(float(least.max(initial=0.0)), float(low.max()), 1.0), high)
    clear = kept * (high - low)
    return robot.replace(tension_min=low + clear, tension_max=high - clear)


def _feasible(
    robot: Robot, model: CableModel, poses: Pose, sets: int, rng: np.random.Generator, progress: Progress | None
) -> tuple[CandidatePoses, Codes]:
    """Feasible combinations of a pose and a set of tensions, and the solution status of all combinations."""
    found, statuses = [], []
    for part in blocks(len(poses), GROUP, progress):
        corners = np.where(rng.uniform(size=(sets, robot.cable_count)) < 0.5, robot.tension_min, robot.tension_max)
        group = poses[part]
        every = [_solve(robot, model, group, QuadraticProgram(target=corner)) for corner in corners]
        status, lengths, tensions = (np.stack(parts, axis=1) for parts in zip(*every, strict=True))
        statuses.append(status.ravel())
        usable = (status == PoseStatus.SOLVED) & _in_range(robot, lengths, tensions)
        apart = np.abs(tensions[:, :, None] - tensions[:, None]).max(axis=-1)
        same = np.tril(apart <= SAME * np.nanmax(tensions, initial=0.0), -1).any(axis=-1)  # as a previous set
        which, number = np.nonzero(usable & ~same)
        place, own = part.start + which, (lengths[which, number], tensions[which, number])
        found.append(CandidatePoses(pose_rows(group)[which], *own, place, place % 2 == 0))
    return _concatenated(found), np.concatenate(statuses)


def _solve(robot: Robot, model: CableModel, poses: Pose, method: TensionMethod) -> tuple[Codes, Array, Array]:
    """Status, lengths and frame-end tensions of each pose."""
    try:
        plan = inverse(robot, poses, model, method)
    except CableGeometryError:  # one of the poses has a platform anchor at a frame anchor or inside a pulley
        missing = np.full((len(poses), robot.cable_count), np.nan)
        return np.full(len(poses), PoseStatus.NO_CHORD, dtype=np.int8), missing, missing
    return plan.status, plan.unstrained_length, plan.state.cables.frame_end_tension


def _in_range(robot: Robot, lengths: Array, tensions: Array) -> Flags:
    """True where the winches have enough cable for `lengths` (..., m) and the load cells can measure `tensions`."""
    winches = robot.winches
    fits = np.ones(lengths.shape, dtype=np.bool_)
    if winches is not None and winches.cable_length is not None:
        strain = winches.winding_tension / robot.cables.axial_stiffness
        fits &= lengths * (1.0 + strain) <= winches.cable_length
    if winches is not None and winches.load_cell_range is not None:
        fits &= tensions * winches.load_cell_gain + winches.load_cell_bias <= winches.load_cell_range
    return np.asarray(fits.all(axis=-1))


def _none_feasible(robot: Robot, statuses: Codes) -> InvalidValueError:
    """Error for a box without a feasible pose. The message names the most frequent reason."""
    codes, counts = np.unique(statuses, return_counts=True)
    reason = PoseStatus(int(codes[np.argmax(counts)]))
    beyond = "the winches do not have enough cable, or the tensions are outside the range of the load cells"
    why = beyond if reason is PoseStatus.SOLVED else reason.text.split(";")[0]
    value = f"without a pose that {robot.name} can hold among {len(statuses):,} tried ({why})"
    step = "Give box=PoseBox(low, high, tilt) with other poses."
    return InvalidValueError("box", value, "a box with feasible poses", step)


PASSES: Final = 50  # passes over all pairs of edges; a tour of a hundred places takes fewer than ten
_ROUNDING: Final = 1e-9  # smaller improvements of a tour, relative to the largest distance, are rounding errors


def shortest_tour(places: Array) -> Indices:
    """Order (N,) of places (N, d) on a short open tour that visits each place once (2-opt, Croes 1958)."""
    count = len(places)
    apart = np.zeros((count + 1, count + 1))  # the last place is virtual, so that the tour is open
    apart[:count, :count] = np.linalg.norm(places[:, None] - places[None], axis=-1)
    order = np.concatenate(([count], _nearest_neighbor_tour(apart[:count, :count]), [count]))
    for _ in range(PASSES):
        if not _reverse_segments(order, apart, _ROUNDING * apart.max()):
            break
    return np.asarray(order[1:-1])


def tour_length(places: Array, order: Indices) -> float:
    """Length of a tour through places (N, d) in an order (N,), in the unit of the places."""
    return float(np.linalg.norm(np.diff(places[order], axis=0), axis=-1).sum())


def _nearest_neighbor_tour(apart: Array) -> Indices:
    """Tour that starts at the farthest place and always continues to the nearest remaining place."""
    order = np.empty(len(apart), dtype=np.int64)
    left = np.ones(len(apart), dtype=np.bool_)
    here = int(np.argmax(apart.sum(axis=1)))
    for k in range(len(apart)):
        order[k] = here
        left[here] = False
        here = int(np.argmin(np.where(left, apart[here], np.inf)))
    return order


def _reverse_segments(order: Indices, apart: Array, floor: float) -> bool:
    """Reverse each segment of `order` in place if this shortens the tour; True if a segment was reversed."""
    changed = False
    for i in range(len(order) - 2):
        before, first, lasts, after = order[i], order[i + 1], order[i + 1 : -1], order[i + 2 :]
        saved = apart[before, first] + apart[lasts, after] - apart[before, lasts] - apart[first, after]
        best = int(np.argmax(saved))
        if saved[best] > floor:
            order[i + 1 : i + 2 + best] = order[i + 1 : i + 2 + best][::-1].copy()
            changed = True
    return changed
