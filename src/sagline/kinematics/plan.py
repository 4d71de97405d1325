"""Plan: cable tensions and unstrained lengths for a motion of the platform."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.cables.model import CableStatus
from sagline.core.arrays import Array, Codes, locked
from sagline.core.results import Columns, Result, Saved, Tabular
from sagline.kernels import tables
from sagline.kinematics.frame_forces import FrameForces, frame_forces_of
from sagline.kinematics.inverse_rows import solve_inverse_rows
from sagline.kinematics.status import BALANCED, PoseStatus
from sagline.kinematics.uncertainty import Uncertainty
from sagline.motion.anchors import AnchorMotion
from sagline.motion.path import Path, spline_rates
from sagline.robot.batch import Robots, first_of, has_slanted_axes
from sagline.robot.equilibrium import Equilibrium, cables_of_results
from sagline.robot.pose import Pose
from sagline.robot.reach import LEVEL, ROUNDING, forbidden_turn, is_underconstrained, turn_in_words
from sagline.robot.robot import Robot, with_anchors
from sagline.robot.routing import with_routing
from sagline.statics.balance import inertial_wrench
from sagline.statics.tables import pose_rows, robot_terms
from sagline.tension.method import TensionMethod, kernel_options, shared_tension
from sagline.tension.methods import Closest

SHARE = 1e-5  # step relative to the time scale of the motion; central differences are then accurate to 1e-9
ONE_SIDED = 4.0  # factor of the step for one-sided differences, whose rounding errors are four times as large
LONGEST = 1e-2  # largest step relative to the time between samples
_CONSTANT = 1e-9  # differences of a wrench below this share of its largest component count as zero


class Gap(NamedTuple):
    """Gap in a plan: consecutive poses that have no solution, or consecutive unstable equilibria.

    Attributes:
        first: Index of the first pose.
        last: Index of the last pose.
        status: Reason for the missing solution at the first pose, or UNSTABLE.
        shortfall: Largest finite shortfall in the gap [N]; infinite if all are infinite, NaN if none is known.
        cables: Indices of the cables whose limits oppose the wrench at any pose of the gap.
        hopeless: Number of poses of the gap that no change of the force alone makes feasible.
    """

    first: int
    last: int
    status: PoseStatus
    shortfall: float
    cables: tuple[int, ...]
    hopeless: int = 0


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Plan(Result, Saved, Tabular):
    """Result of `inverse`: a single pose with fields of shape (m,), or N poses with fields of shape (N, m).

    Attributes:
        state: Robot, poses, wrench and cables; forces and lengths are NaN at poses without a solution.
        path: The path of the plan; None for poses without times.
        tension: Tension distribution method.
        status: Codes of `PoseStatus`, shape () or (N,).
        shortfall: Smallest change of the force on the platform that makes the pose feasible [N], shape () or (N,). The
            shortfall is 0 for a feasible pose, infinite if a proof shows that no change of the force alone is
            sufficient, and NaN if the force is not the cause or no value was found.
        wrench_residual: Norms of the unbalanced force [N] and moment [N m] along the platform's free motions, shape
            (2,) or (N, 2).
        blocking: True for cables at a limit that opposes the needed wrench, shape (m,) or (N, m). A wider limit would
            reduce the shortfall.
        farkas: Proof of each infeasible pose, shape (6,) or (N, 6), NaN at other poses. Let y = farkas. J is the
            structure matrix, s_i(tau_i) is the sag force of cable i, and G_i s_i is its wrench. Along y, the cables
            supply the sum of y . (J_i tau_i - G_i s_i(tau_i)). For all chord tensions within their limits, this sum is
            less than y . (needed without its sag forces). The proof uses exact catenaries. The proof excludes tensions
            below a tenth of the cable's weight, and, for a cable without an upper limit, tensions that stretch it to
            more than twice its length. The force part of y has length 1, so that the difference is in newtons. NaN if
            the proof needs more than one direction.
        needed: The wrench J tau that the chord tensions must supply, shape (6,) or (N, 6), due to weight, given wrench,
            and the sag forces T_z - tau sin phi. Without a solution, the sag forces belong to the tensions with the
            smallest unbalanced wrench.
        bracket: Proved lower bound of the shortfall, and a sufficient value [N], shape (2,) or (N, 2). The sufficient
            value is infinite if none was found.
        relief: Change of the force that makes the pose feasible, in world axes [N], shape (3,) or (N, 3). Its magnitude
            is the sufficient value in `bracket`. NaN if no change is needed or known.
        at_border: True for feasible poses at which the iterations found no tensions, close to the border of
            feasibility, shape () or (N,). The tensions there balance the platform, but `tension` did not select them.
        anchors: Motion of the frame anchors; None for fixed anchors. With moving anchors, `state.robot` has one robot
            per pose, whose frame anchors are those at its time.

    `farkas`, `needed`, `bracket`, `relief` and `at_border` are None for a plan from an old file.
    """

    _columns: ClassVar[Columns] = (
        "path.time",
        "state.pose",
        "L#=unstrained_length",
        "T#=chord_tension",
        ("status", PoseStatus),
    )

    state: Equilibrium
    path: Path | None
    tension: TensionMethod
    status: Codes
    shortfall: Array
    wrench_residual: Array
    blocking: NDArray[np.bool_]
    farkas: Array | None = None
    needed: Array | None = None
    bracket: Array | None = None
    relief: Array | None = None
    at_border: NDArray[np.bool_] | None = None
    anchors: AnchorMotion | None = None

    @property
    def robot(self) -> Robot:
        """The robot of all poses; with moving anchors, the robot at the first pose.

        Raises:
            InvalidValueError: If the plan has one robot per pose that differ by more than moving anchors.
        """
        return self.state.one_robot if self.anchors is None else first_of(self.state.robot)

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """True if tensions within the limits balance the platform, even without stability, shape () or (N,)."""
        return np.isin(self.status, BALANCED)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """True if the pose is feasible and its equilibrium is stable, shape () or (N,)."""
        return np.asarray(self.status == PoseStatus.SOLVED)

    @property
    def method(self) -> str:
        """Name of the tension distribution method; "balance" for an underconstrained platform, which has no method."""
        return "balance" if is_underconstrained(first_of(self.state.robot)) else self.tension.title

    @property
    def unstrained_length(self) -> Array:
        """Unstrained lengths L off the drums [m], including wrapped and dead lengths."""
        return self.state.unstrained_length

    @property
    def horizontal_tension(self) -> Array:
        """Horizontal tensions T_x [N]."""
        return self.state.cables.horizontal_tension

    @property
    def vertical_force(self) -> Array:
        """Vertical forces T_z on the cables at their platform ends [N]."""
        return self.state.cables.vertical_force

    @property
    def chord_tension(self) -> Array:
        """Chord tensions tau = T_x/cos phi [N]."""
        return self.state.chord_tension

    @property
    def free_length(self) -> Array:
        """Unstrained length of the free spans [m], between exit points and platform ends."""
        return self.state.free_length

    @property
    def exit_point(self) -> Array:
        """Exit points of the cables at the frame, world axes [m], shape (m, 3) or (N, m, 3)."""
        return self.state.exit_point

    @property
    def wrap_angle(self) -> Array | None:
        """Wrap angle Psi of the cables on their pulleys [rad]; None if there are no pulleys and no dead lengths."""
        return None if self.state.contact is None else self.state.contact.wrap_angle

    @property
    def length_rate(self) -> Array | None:
        """Rate dL/dt of `unstrained_length` along the path [m/s], shape (N, m); None without a path.

        The rate is due to changes of pose, anchors and tension; NaN where the plan has no solution. Each call computes
        the rates again. See docs/model.md, section 7.
        """
        return None if self.path is None else _length_rate(self, self.path)

    @property
    def stiffness_min(self) -> Array:
        """Smallest stiffness of the platform against its free motions [N/m], shape () or (N,).

        A rotation is measured by its arc at the root mean square distance of the platform ends from the center of mass,
        as in `ForwardSolution`. The value is zero or negative for an unstable equilibrium, NaN for a pose without a
        solution and for straight cables. Each call computes the value again.
        """
        from sagline.statics.stiffness import smallest_stiffness  # not needed for a plan alone

        return smallest_stiffness(self.state)

    def frame_forces(self) -> FrameForces:
        """Compute the forces of the cables on anchors, pulleys and winches, for the design of the frame.

        Returns:
            FrameForces; NaN where the plan has no solution.

        Raises:
            InvalidValueError: If the plan has one robot per pose.

        Examples:
            >>> import sagline as sl
            >>> robot = sl.load_robot("cogiro")
            >>> path = sl.quintic_path([(0, 0, 2), (2, 1, 2.5)], durations=2.0)
            >>> found = sl.inverse(robot, path).frame_forces()
            >>> print(found.magnitude.max(axis=0).round(), "N")
            [402. 372. 463. 426. 503. 559. 441. 408.] N

        Source:
            Force balance of the cable on its pulley and in its guide; docs/model.md, section 10.
        """
        return frame_forces_of(self.state, self.path)

    def uncertainty(self) -> Uncertainty:
        """Compute the errors of poses and tensions that the tolerances of the robot cause, by first order.

        The winches have the lengths of the plan. The true robot deviates from the robot of the plan by independent
        errors, with the standard deviations in `Robot.tolerances`, or the standard errors of its calibration if these
        are smaller. The wrench of the plan stays the same. Tolerances of load cells have no effect.

        Returns:
            Uncertainty; NaN where the plan is not solved.

        Raises:
            InvalidValueError: If the robot has no tolerances, an infinite tolerance, or a tolerance of a quantity that
                it does not have. If the cable model is neither `Catenary` nor `Elastic`.

        Examples:
            >>> import sagline as sl
            >>> robot = sl.load_robot("cogiro")
            >>> robot = robot.replace(tolerances={"frame_anchors": 0.002, "mass": 0.5})
            >>> found = sl.inverse(robot, (1, 0.5, 1.5)).uncertainty()
            >>> print(f"{1e3 * found.position:.2f} mm, mostly {found.position_source}")
            2.92 mm, mostly frame_anchors

        Source:
            Implicit function theorem, with the derivatives of `calibrate`: docs/model.md, section 14.
        """
        # loaded by name on demand, because calibration imports this module
        found: Uncertainty = import_module("sagline.calibration.uncertainty").uncertainty_of(self)
        return found

    @property
    def gaps(self) -> tuple[Gap, ...]:
        """Gaps in order: ranges of consecutive poses that are not solved. A single pose counts as a batch of one.

        Adjacent infeasible and unstable poses are in separate gaps.
        """
        kind = np.where(np.atleast_1d(self.solved), 0, np.where(np.atleast_1d(self.feasible), 1, 2))
        edges = np.flatnonzero(np.diff(np.concatenate(([0], kind, [0]))))
        return tuple(self._gap(int(a), int(b) - 1) for a, b in itertools.pairwise(edges) if kind[a])

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings: rotations that are not free, nearly infeasible poses, and a cable model beyond its validity."""
        robot, count, cables = first_of(self.state.robot), self.status.size, self.state.cables
        found = []
        # all poses have the same rotation, because `inverse` refuses other poses
        turn = forbidden_turn(robot, self.state.pose, LEVEL)[:1]
        if np.linalg.norm(turn) > ROUNDING:
            found.append(
                f"the platform is turned by {turn_in_words(turn[0])}, but motion_pattern {robot.motion_pattern} does "
                "not allow this rotation, and the force balance contains no moment about its axis; correct the pose, "
                "or choose another motion_pattern"
            )
        if self.at_border is not None and (near := np.count_nonzero(self.at_border)):
            found.append(
                f"{near} of {count} poses are at the border of feasibility: their tensions "
                f"balance the platform, but {type(self.tension).__name__} did not select them; widen the limits"
            )
        below = np.atleast_2d(cables.status == CableStatus.BELOW_VALIDITY) & np.atleast_1d(self.feasible)[:, None]
        found += [
            f"cable {cable}: at {invalid} of {count} poses its tension is below w D/(2 |sin phi|), where the "
            "empirical model's lowest point enters the span; raise tension_min, set lowest_point_margin, or use "
            "Catenary()"
            for cable, invalid in enumerate(below.sum(axis=0))
            if invalid
        ]
        return tuple(found)

    def _gap(self, first: int, last: int) -> Gap:
        part = slice(first, last + 1)
        shortfall = np.atleast_1d(self.shortfall)[part]
        finite, hopeless = shortfall[np.isfinite(shortfall) & (shortfall > 0.0)], int(np.isinf(shortfall).sum())
        cables = np.flatnonzero(np.atleast_2d(self.blocking)[part].any(axis=0))
        return Gap(
            first=first,
            last=last,
            status=PoseStatus(np.atleast_1d(self.status)[first]),
            shortfall=float(finite.max()) if finite.size else np.inf if hopeless else np.nan,
            cables=tuple(int(i) for i in cables),
            hopeless=hopeless,
        )


def _length_rate(plan: Plan, path: Path) -> Array:
    """Rates of the unstrained lengths (N, m) along `path`; NaN where the plan has no solution."""
    # The rates are accurate to 1e-8 of the largest rate, and have first order at the border of feasibility.
    # Geometry and tensions both change: L(t) = L(pose(t), tau(t)). The tensions of most methods depend only on the
    # pose. They are computed again shortly before and after each sample. `Closest` depends on its previous tensions.
    # It is solved again one step and two steps after each sample, relative to the tensions at the sample. At a
    # discontinuity, for example where a cable reaches a limit, the rate belongs to one side of the discontinuity.
    state, tension, anchors = plan.state, plan.tension, plan.anchors
    kept, rates = np.flatnonzero(plan.feasible), np.full(state.cables.shape, np.nan)
    # a spline, because the path does not contain all of the pose, or the exit points need passes of their own
    if is_underconstrained(first_of(state.robot)) or has_slanted_axes(state.robot):
        for part in np.split(kept, np.flatnonzero(np.diff(kept) > 1) + 1):
            if len(part) > 1:
                rates[part] = spline_rates(path.time[part], state.unstrained_length[part])[0]
        return locked(rates)
    closest = isinstance(tension, Closest)
    robot = state.robot if anchors is None else plan.robot
    motion, step = _motion_near(robot, path, state.wrench, ONE_SIDED if closest else 1.0, anchors)
    reference = shared_tension(state, tension.variable) if closest else np.full(state.cables.shape[-1], np.nan)

    def lengths(h: float) -> Array:
        """Unstrained lengths (N, m) at the time `h` after each sample."""
        places = None if anchors is None else anchors._interpolated(path.time + h, 0)
        return lengths_near(state, tension, *motion(h), reference, places)

    now, after = state.unstrained_length, lengths(step)
    if closest:  # a step backward would cross active limits
        best = (4.0 * after - lengths(2.0 * step) - 3.0 * now) / (2.0 * step)
        one_sided = [after - now]
    else:
        before = lengths(-step)
        best = (after - before) / (2.0 * step)
        one_sided = [after - now, now - before]
    for change in one_sided:  # first order, at the border of feasibility: only one side has a solution
        best = np.where(np.isnan(best), change / step, best)
    rates[kept] = best[kept]
    return locked(rates)


def lengths_near(
    state: Equilibrium, tension: TensionMethod, pose: Pose, wrench: Array, reference: Array, places: Array | None = None
) -> Array:
    """Unstrained lengths (N, m) at poses near a state, with its guides and friction."""
    # reference: for `Closest`; places: positions of moving anchors (N, m, 3)
    robot = state.robot if places is None else first_of(state.robot)
    options, terms = kernel_options(robot, state.cables.model, tension), robot_terms(robot, anchors=places)
    found = solve_inverse_rows(robot, tension, options, pose_rows(pose), locked(wrench), reference, terms=terms)
    if state.contact is None:
        return np.asarray(found.results[tables.LENGTH])
    reached = cables_of_results(robot, state.cables.model, found.results, found.cable_status, pose.shape)
    placed = robot if places is None else with_anchors(first_of(robot), places)
    return with_routing(Equilibrium(placed, pose, wrench, *reached), state.contact.winding).unstrained_length


def _motion_near(
    robot: Robots, path: Path, wrench: Array, longer: float, anchors: AnchorMotion | None
) -> tuple[Callable[[float], tuple[Pose, Array]], float]:
    """A function that returns poses and wrenches at a time after each sample of `path`, and a time step [s] for it."""
    # wrench: external plus inertial, (N, 6); a spline interpolates its external part; longer: factor of the step
    jerk = path.jerk if path.jerk is not None else _rate(path.time, path.twist_rate)
    external = wrench - inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    changing = float(np.ptp(external, axis=0).max()) > _CONSTANT * float(np.abs(wrench).max())
    external_rate = _rate(path.time, external) if changing else np.zeros_like(external)

    def at(h: float) -> tuple[Pose, Array]:
        # third order for positions, second for orientations (third if the axis is constant)
        pose = moved_pose(path.pose, h * (path.twist + 0.5 * h * (path.twist_rate + h / 3.0 * jerk)))
        twist = path.twist + h * (path.twist_rate + 0.5 * h * jerk)
        inertial = inertial_wrench(robot, pose, twist, path.twist_rate + h * jerk)
        return pose, inertial + external + h * external_rate

    # a small share of two times: for a change by 1 m or 1 rad, and between samples
    moved = [[path.twist, path.twist_rate, jerk]]
    if anchors is not None:
        moved.append([anchors._interpolated(path.time, order) for order in (1, 2, 3)])
    sizes = (max(float(np.abs(rate).max()) for rate in rates) for rates in zip(*moved, strict=True))
    quickest = max(size ** (1.0 / order) for order, size in enumerate(sizes, start=1))
    between = float(np.diff(path.time).min()) if len(path) > 1 else 1.0
    return at, min(LONGEST * between, longer * SHARE / quickest if quickest > 0.0 else np.inf)


def _rate(time: Array, values: Array) -> Array:
    return spline_rates(time, values)[0] if len(time) > 1 else np.zeros_like(values)


def moved_pose(pose: Pose, motions: Array) -> Pose:
    """Poses after `motions` (N, 6): shifts of the origin [m] and rotation vectors [rad] in world axes."""
    from scipy.spatial.transform import Rotation  # this import takes a third of the load time of sagline

    turned = pose.quaternion
    if motions[:, 3:].any():
        turned = (Rotation.from_rotvec(motions[:, 3:]) * pose.rotation).as_quat()
    return Pose.from_quaternion(pose.position + motions[:, :3], turned)
