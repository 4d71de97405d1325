"""Forward kinematics as arrays: kernel calls for batches, guides and friction, and the result `ForwardSolution`."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Flags, Indices, Progress, blocks, checked, locked, rows_of
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels import codes, fit_poses, forward_poses, tables
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.memory import memory_for
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.batch import Robots, first_of, has_routing, robots_at
from sagline.robot.equilibrium import Equilibrium, cables_of_results, result_rows
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.robot.routing import with_routing
from sagline.statics.tables import body_table, cable_table, check_slanted

if TYPE_CHECKING:
    from sagline.kernels.forward.platform import LastEquilibriumArrays, SolutionArrays


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ForwardSolution(Result, Tabular):
    """Result of `forward`, single or with a leading axis N.

    Attributes:
        state: Robot, poses, wrench and cables in equilibrium; NaN if the lengths are NaN.
        status: Codes of `ForwardStatus`, shape () or (N,).
        stiffness_min: Smallest stiffness of the platform against its free motions [N/m], shape () or (N,). A rotation
            is measured by its arc length at the root mean square distance of the platform ends from the center of mass.
        energy: Potential energy of cables, weight and given force [J], shape () or (N,). Heights of cables are measured
            from their frame ends; all other heights are measured from the world origin. NaN for the shallow models,
            which have no energy. For straight cables, half the sum of squared length errors [m^2], which the fit
            minimizes.
        wrench_residual: Norms of the unbalanced force [N] and moment [N m] along the platform's free motions, shape
            (2,) or (N, 2).
        iterations: Number of Newton steps, shape () or (N,).
        covariance: Covariance of a pose from measured tensions: displacement of the center of mass [m] and rotation
            vector [rad], world axes, shape (6, 6) or (N, 6, 6). None if no tensions were measured.
    """

    _columns: ClassVar[Columns] = (
        "pose",
        "force_residual=wrench_residual.0",
        "moment_residual=wrench_residual.1",
        "stiffness_min",
        "iterations",
        ("status", ForwardStatus),
    )

    state: Equilibrium
    status: Codes
    stiffness_min: Array
    energy: Array
    wrench_residual: Array
    iterations: Indices
    covariance: Array | None = None

    @property
    def pose(self) -> Pose:
        """Pose of the platform."""
        return self.state.pose

    @property
    def solved(self) -> Flags:
        """True for a stable equilibrium in which the cables hold the platform, shape () or (N,)."""
        return np.asarray(self.status == ForwardStatus.SOLVED)

    @property
    def stable(self) -> Flags:
        """True for any stable equilibrium, even if the cables do not fully constrain the platform, shape () or (N,)."""
        return np.isin(self.status, STABLE)

    @property
    def slack(self) -> Flags:
        """True for slack cables, shape (m,) or (N, m): tau is at most half the weight of a cable of the chord's length.

        A slack cable sags by a quarter of its chord or more. A weightless cable is slack if its tension is zero.
        """
        cables = self.state.cables
        density = np.zeros(()) if cables.model.weightless else cables.cable.linear_density
        return np.asarray(cables.chord_tension <= 0.5 * density * cables.gravity * cables.chord)


_OPEN = (codes.FORWARD_NOT_CONVERGED, codes.FORWARD_NO_LENGTHS)  # statuses of samples without a result
BLOCK = 1 << 13  # cables per block; a block takes at most 130 ms, and interrupts are handled between blocks


class ForwardRows(NamedTuple):
    """Results of the kernel for N samples, in the order of the kernel's arguments."""

    poses: Array
    results: Array
    cable_status: Codes
    numbers: Array
    pose_status: Codes

    def keep(self, samples: Indices | slice, other: ForwardRows, which: Indices | slice = slice(None)) -> None:
        """Replace the results of the samples with the indices `which` (k,) by the results in `other`, (k,)."""
        self.results[:, samples] = other.results[:, which]
        for own, new in ((self[k], other[k]) for k in (0, 2, 3, 4)):  # all fields but the results
            own[samples] = new[which]

    def part(self, samples: Indices) -> ForwardRows:
        """Copies of the results of some samples (k,)."""
        cables, numbers, status = self.cable_status[samples], self.numbers[samples], self.pose_status[samples]
        return ForwardRows(self.poses[samples], self.results[:, samples], cables, numbers, status)

    def last_pose(self, before: Array) -> Array:
        """Last pose row with a result, (1, POSE_COLUMNS), or `before` if no sample has a result."""
        which = np.flatnonzero(~np.isin(self.pose_status, _OPEN))[-1:]
        return locked(self.poses[which]) if which.size else before

    @property
    def arrays(self) -> SolutionArrays:
        """The arrays as a plain tuple, because kernels accept plain tuples fastest."""
        return self.poses, self.results, self.cable_status, self.numbers, self.pose_status

    @classmethod
    def empty(cls, robot: Robots, count: int) -> ForwardRows:
        """Empty arrays for `count` samples."""
        cables = first_of(robot).cable_count
        return cls(
            np.empty((count, tables.POSE_COLUMNS)),
            np.empty((result_rows(robot), count, cables)),
            np.empty((count, cables), dtype=np.int8),
            np.empty((count, tables.FORWARD_NUMBERS)),
            np.empty(count, dtype=np.int8),
        )

    @property
    def stable(self) -> Flags:
        """True for samples in stable equilibrium, (N,)."""
        return np.isin(self.pose_status, STABLE)

    def solution(
        self, robot: Robots, model: CableModel, load: Array, shape: tuple[int, ...], covariance: Array | None = None
    ) -> ForwardSolution:
        """Result of `forward` with the shape `shape`: () or (N,). `load`: (6,) or (N, 6). `covariance`: (N, 6, 6)."""
        pose = Pose._adopt(self.poses[:, :3].reshape(*shape, 3), self.poses[:, 3:].reshape(*shape, 4))
        whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*shape, 6))))
        residuals = self.numbers[:, [tables.FORCE_RESIDUAL, tables.MOMENT_RESIDUAL]]
        cables, contact = cables_of_results(robot, model, self.results, self.cable_status, shape)
        return ForwardSolution(
            state=Equilibrium(robot, pose, whole, cables, contact),
            status=locked(self.pose_status.reshape(shape)),
            stiffness_min=locked(self.numbers[:, tables.STIFFNESS_MIN].reshape(shape)),
            energy=locked(self.numbers[:, tables.ENERGY].reshape(shape)),
            wrench_residual=locked(residuals.reshape(*shape, 2)),
            iterations=locked(self.numbers[:, tables.ITERATIONS].astype(np.int64).reshape(shape)),
            covariance=None if covariance is None else locked(covariance.reshape(*shape, 6, 6)),
        )


def solve_forward_rows(
    robot: Robots,
    model: CableModel,
    lengths: Array,
    starts: Array,
    wrenches: Array,
    *,
    chained: bool = False,
    freedom: Array | None = None,
    progress: Progress | None = None,
) -> ForwardRows:
    """Run the kernel over samples (N, m) in blocks, with pose rows `starts` and `wrenches`, 1 or N rows each."""
    # chained: True if each sample starts at the result of the previous sample; freedom: free motions (n, 6), by default
    # those of the robot; progress: called after each block with the number of finished samples and of all samples
    count, m = lengths.shape
    allowed = first_of(robot).freedom if freedom is None else freedom
    check_slanted(robot, model)
    bodies, cables, behind = body_table(robot), cable_table(robot, slanted=True), has_routing(robot) or None
    chain, memory = new_chain(m, len(allowed)), memory_for(m)  # the chain continues in the next block
    found = ForwardRows.empty(robot, count)
    for part in blocks(count, max(1, BLOCK // m), progress):
        block = ForwardRows.empty(robot, part.stop - part.start)
        per_sample = (rows_of(bodies, part), rows_of(cables, part), lengths[part], rows_of(starts, part))
        given = (allowed, *per_sample, rows_of(wrenches, part))
        if model.code == codes.STRAIGHT:
            fit_poses(chained, given, chain, memory, block.arrays)
        else:
            forward_poses((model.code, *model.parameters, behind), chained, given, chain, memory, block.arrays)
        found.keep(part, block)
        if chained:
            starts = block.last_pose(starts)
    return found


def new_chain(cables: int, freedoms: int) -> LastEquilibriumArrays:
    """Arrays that pass the last equilibrium of a chain to the next sample, and are NaN at the start of the chain."""
    return (
        np.full((CABLE_ROWS, cables), np.nan),
        np.full((freedoms, freedoms), np.nan),
        np.full(tables.LAST_COLUMNS, np.nan),
    )


Winding = ArrayLike | Literal["path"]
# largest number of iterations; usually about ten suffice, but not with high friction
ITERATIONS: Final = 100
MEMORY: Final = 5  # number of previous iterations that Anderson mixing uses
_RANK: Final = 1e-6
TOLERANCE: Final = 1e-13  # convergence tolerance, relative to a length


def checked_winding(winding: ArrayLike, shape: tuple[int, ...], cables: int) -> Array:
    """Winding directions +1, -1 and 0 of the cables, (m,) or (N, m), for poses of the shape `shape`, () or (N,)."""
    array = checked(winding, "winding", "")
    shapes = [(cables,)] + [(*shape, cables)] * bool(shape)
    if array.shape not in shapes:
        step = "Give one direction for each cable, or None for no friction."
        raise InvalidValueError("winding", f"of shape {array.shape}", f"shape {' or '.join(map(str, shapes))}", step)
    wrong = ~np.isin(array, (-1.0, 0.0, 1.0))
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        allowed = "1 winding in, -1 paying out, or 0 at rest"
        item, step = f"winding[{', '.join(map(str, index))}]", "Give the sign of the motion."
        raise InvalidValueError(item, f"{array[index]:g}", allowed, step)
    return array


def without_guides(robot: Robot, solver: str, instead: str) -> Robot:
    """Return `robot`, or refuse it if it has guides, which the function `solver` does not support."""
    if robot.winches is None or robot.winches.guides is None:
        return robot
    step = f"Use {instead}(), or robot.replace(winches=robot.winches.replace(guides=None)) for a straight guided run."
    raise InvalidValueError("winches: guides", "given", f"None for {solver}", step)


def iterate_routing(
    robot: Robots,
    model: CableModel,
    found: ForwardRows,
    lengths: Array,
    loads: Array,
    winding: Array | None,
    taken: Array | None = None,
) -> ForwardRows:
    """Equilibria at lengths (N, m) that include the actual routing. `found`: equilibria with straight guided cables."""
    # The lengths for the kernels are the given lengths minus a correction for guides and friction. Each iteration
    # computes this correction from the last tensions. `found` is without friction, at the given lengths minus the
    # initial correction `taken` [m], (N, m), None for zero. The status is NOT_CONVERGED if the iteration does not
    # converge, or a cable is too slack for a catenary between its guides.
    more = np.zeros(lengths.shape) if taken is None else taken.copy()
    past: deque[tuple[Array, Array]] = deque(maxlen=MEMORY)  # inputs and residuals of the last iterations
    still = np.flatnonzero(~np.isin(found.pose_status, _OPEN))
    for _ in range(ITERATIONS):
        if not still.size:
            return found
        some = found.part(still)
        turning = winding if winding is None or winding.ndim == 1 else winding[still]
        added = _routing_change(robots_at(robot, still), model, some, turning)
        slack = np.isnan(added)
        missed = np.where(slack, 0.0, added - more[still])
        moving = (np.abs(missed) > TOLERANCE * lengths[still]).any(axis=1)
        whole = np.zeros(lengths.shape)
        whole[still] = missed
        mixed = more[still] + _anderson_step(more[still], missed, [(x[still], f[still]) for x, f in past])
        past.append((more.copy(), whole))
        given = lengths[still] - mixed
        lost = np.where(moving, ~(given > 0.0).all(axis=1), slack.any(axis=1))
        found.pose_status[still[lost]] = codes.FORWARD_NOT_CONVERGED
        again = moving & ~lost
        still, starts = still[again], locked(some.poses[again])
        if still.size:
            more[still] = mixed[again]
            load = loads if len(loads) == 1 else locked(loads[still])
            found.keep(still, solve_forward_rows(robots_at(robot, still), model, locked(given[again]), starts, load))
            still = still[~np.isin(found.pose_status[still], _OPEN)]
    found.pose_status[still] = codes.FORWARD_NOT_CONVERGED
    return found


def _anderson_step(taken: Array, missed: Array, past: list[tuple[Array, Array]]) -> Array:
    """Next input of the iteration, (N, m), by Anderson mixing of previous inputs and residuals."""
    if not past:
        return missed
    changes = np.stack([missed - before for _, before in past], axis=-1)
    moves = np.stack([taken - before for before, _ in past], axis=-1)
    shares = np.linalg.pinv(changes, rcond=_RANK) @ missed[..., None]
    step: Array = missed - ((moves + changes) @ shares)[..., 0]
    return step


def _routing_change(robot: Robots, model: CableModel, found: ForwardRows, winding: Array | None) -> Array:
    """Change of the lengths due to guides and friction [m], (N, m). NaN if a cable is too slack for its guides."""
    shape = (len(found.poses),)
    plain = found.solution(robot, model, np.zeros(6), shape).state
    real = with_routing(plain, winding)
    assert plain.contact is not None
    assert real.contact is not None
    return (real.contact.wrapped_length - plain.contact.wrapped_length) + (
        real.contact.dead_length - plain.contact.dead_length
    )
