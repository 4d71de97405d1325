"""Inverse kinematics: tensions and unstrained lengths from a motion of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import brief, callback, check_poses, choice, flag, instance
from sagline.core.arrays import Array, Indices, Progress, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kernels import codes
from sagline.kinematics import inverse_rows
from sagline.kinematics.forward_rows import Winding, checked_winding
from sagline.kinematics.inverse_rows import Given, InverseRows
from sagline.kinematics.plan import Plan
from sagline.kinematics.slanted import solve_slanted_axes
from sagline.kinematics.status import PoseStatus
from sagline.motion.anchors import AnchorMotion
from sagline.motion.path import Path
from sagline.robot.batch import first_of, has_routing, has_slanted_axes, on_platform, one_a_pose
from sagline.robot.equilibrium import Equilibrium, cables_of_results
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.reach import ROUNDING, check_reach
from sagline.robot.robot import Robot, with_anchors
from sagline.robot.routing import with_routing
from sagline.statics.balance import external_wrench, inertial_wrench
from sagline.statics.tables import pose_rows, refuse_missing_chords, robot_terms
from sagline.tension.method import TensionMethod, Variable, kernel_options, shared_tension
from sagline.tension.methods import DEFAULT, method_of

if TYPE_CHECKING:
    from sagline.kernels.inverse.poses import Robots as RobotTerms

# a cable counts as at rest below this share of the fastest cable's rate, because rates are accurate to 1e-8
STANDING: Final = 1e-7
_CATENARY = Catenary()


def inverse(
    robot: Robot | Sequence[Robot],
    motion: Path | PoseLike,
    model: CableModel | str = _CATENARY,
    tension: TensionMethod | str = DEFAULT,
    wrench: ArrayLike | None = None,
    previous: Plan | ArrayLike | None = None,
    *,
    winding: Winding | None = None,
    stability: bool = True,
    given: Sequence[Given] | None = None,
    level: float = 0.0,
    anchors: AnchorMotion | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Tensions that balance the platform within their limits, and the corresponding unstrained lengths.

    Args:
        robot: The robot, with m cables and n degrees of freedom. With m < n the platform is underconstrained: m values
            of the pose are given, and its other values follow from the force balance. Or a sequence of N robots, one
            per pose. The robots must have the same number of cables, motion pattern, plane normal, type of tension
            limits and gravity; all other data may differ.
        motion: A path of N samples, whose inertia is included; or a pose or batch of N poses at rest.
        model: Cable model; the default is exact.
        tension: Tension distribution method. `Closest` keeps its reference only along a path; in a batch of poses, each
            pose is solved independently.
        wrench: External wrench on the platform about its center of mass in world axes, without gravity and inertia:
            force [N], then moment [N m], shape (6,) or (N, 6). None for zero.
        previous: Initial reference tensions of `Closest`: a plan, whose last feasible tensions are used, or tensions in
            the tension variable [N], shape (m,).
        winding: Direction of each drum, which determines the friction of pulleys and guides: +1 winding in, -1 paying
            out, 0 at rest, shape (m,) or (N, m). With "path", the length changes of the plan without friction determine
            the directions. Friction affects only wrapped and dead lengths. None: no friction.
        stability: True to check the stability of every equilibrium. False saves about a tenth of the time; the status
            UNSTABLE is then not used.
        given: The m values of an underconstrained platform: names out of "x", "y", "z" (position of the platform
            origin), "yaw" (angle about z) and "level" (tension level). None: x, y, z with three cables, and level with
            a fourth. All other values of the pose are only the start of the search. Along a path, each search starts at
            the previous sample.
        level: Tension level of an underconstrained platform [N]: component of the chord tensions along the unit vector
            of the tensions that have the least effect on the platform.
        anchors: Motion of the frame anchors, in place of those of the robot, for a path within its times. The path
            remains a motion in the world.
        progress: Function that is called several times per second. The arguments are the number of finished poses and
            the number of all poses. A pose is finished if it is solved, or infeasible for a known reason.

    Returns:
        Plan with fields of shape (m,) for a single pose, (N, m) otherwise. At a pose without a solution, feasible is
        False, the status is the reason, and the values are NaN. An unstable equilibrium has values and the status
        UNSTABLE.

    Raises:
        InvalidValueError: If `given` does not fit a robot with fewer cables than degrees of freedom. If `tension` does
            not support the number of cables. If several robots do not fit together: the message names the property that
            differs. If `winding` is "path", or `anchors` is given, for poses without times. If the path is outside the
            times of `anchors`. If an argument has the wrong type or shape. If a pose is outside the motions of the
            robot's pattern. If the poses need more memory than is free.
        CableGeometryError: If a cable has no chord at some pose, because its ends coincide or its platform end is
            inside its pulley.

    Source:
        Gia Luan & Truong Thinh 2020, figure 16; made exact in docs/model.md, section 5.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> plan = sl.inverse(robot, sl.Pose.from_euler([1, 1, 2], 0, 0, 0))
        >>> print(plan.feasible, plan.unstrained_length.round(3))
        True [11.049 10.542  9.674  9.829  8.49   7.85   9.453  9.402]
    """
    motion, model, tension = _motion_of(motion), model_of(model), method_of(tension)
    stability, progress = flag(stability, "stability"), callback(progress, "progress")
    turning = _given_winding(winding, motion)
    method = tension if isinstance(motion, Path) or previous is not None else tension.alone
    pose = motion.pose if isinstance(motion, Path) else motion
    robots = one_a_pose(robot, len(pose) if pose.shape else None)
    places = None if anchors is None else _anchors_along(anchors, robots, motion)
    placed = robots if places is None else with_anchors(first_of(robots), places)
    shared = first_of(robots)
    _check_poses(placed, pose)
    values = inverse_rows.given_codes(shared, given)
    options = kernel_options(robots, model, method) if values is None else None
    rows, load = pose_rows(pose), _load_of(robots, motion, pose, wrench)
    loads = np.atleast_2d(load)
    reference = None if options is None else _reference(shared, previous, tension.variable)

    def solve(
        terms: RobotTerms,
        which: Indices | None = None,
        swivels: Array | None = None,
        first: bool = True,
        more: Array | None = None,
    ) -> tuple[InverseRows, Array]:
        """Results of the poses `which` for the robot arrays `terms` and further loads, and rows of the found poses."""
        at, report = slice(None) if which is None else which, progress if first else None
        acting, proves = loads[at] if len(loads) > 1 else loads, stability and more is None
        some, acting = locked(rows[at]), locked(acting if more is None else acting + more)
        if options is None or reference is None:
            asked = values, number(level, "level", "N"), isinstance(motion, Path), stability, report
            return inverse_rows.solve_underconstrained_rows(robots, model, some, acting, *asked, terms)
        found = inverse_rows.solve_inverse_rows(
            robots, method, options, some, acting, reference.copy(), proves, report, terms, swivels
        )
        inverse_rows.decide_rows(terms, options, some, acting, found, report)
        return found, some

    if has_slanted_axes(robots):
        chained = options is None or options.sharing[0] == codes.CLOSEST
        found, rows = solve_slanted_axes(placed, model, pose, solve, chained)
    else:
        found, rows = solve(robot_terms(robots, anchors=places))
    if options is None:
        pose = Pose.from_quaternion(rows[:, :3].reshape(*pose.shape, 3), rows[:, 3:].reshape(*pose.shape, 4))
    state = _state_of(robots, placed, model, pose, load, found, turning)
    if stability:
        _decide_stability(placed, model, rows, found)
    plan = _plan_of(state, motion if isinstance(motion, Path) else None, tension, found, anchors)
    return plan if winding is None or turning is not None else _with_path_friction(plan)


def _check_poses(robots: Robot | tuple[Robot, ...], pose: Pose) -> None:
    """Refuse poses that are out of reach, or outside the plane of a planar robot, or too many."""
    shared = first_of(robots)
    check_reach(shared, pose, "pose")
    _check_plane(shared, pose)
    check_poses(len(pose) if pose.shape else 1, shared.cable_count, has_routing(robots))


def _load_of(robots: Robot | tuple[Robot, ...], motion: Path | Pose, pose: Pose, wrench: ArrayLike | None) -> Array:
    """Wrenches (6,) or (N, 6) of the loads on the platform: external and, along a path, inertial."""
    load = external_wrench(wrench, len(pose) if pose.shape else None)
    if isinstance(motion, Path):
        load = locked(inertial_wrench(robots, pose, motion.twist, motion.twist_rate) + load)
    return load


def _decide_stability(
    placed: Robot | tuple[Robot, ...], model: CableModel, rows: Array, found: inverse_rows.InverseRows
) -> None:
    """Give solved poses (rows `rows`) that are unstable this status in `found`."""
    if on_platform(placed).any():
        found.pose_status[found.pose_status == codes.POSE_SOLVED] = codes.UNPROVED_STABILITY
    inverse_rows.decide_stability(placed, (model.code, *model.parameters), rows, found)


def _state_of(
    robots: Robot | tuple[Robot, ...],
    placed: Robot | tuple[Robot, ...],
    model: CableModel,
    pose: Pose,
    load: Array,
    found: inverse_rows.InverseRows,
    winding: ArrayLike | None,
) -> Equilibrium:
    """Equilibria of the rows `found`, without lengths that are too slack. `placed`: robots with moved anchors."""
    if (found.pose_status == codes.POSE_NO_CHORD).any():
        refuse_missing_chords(placed, pose)
    direction = None if winding is None else checked_winding(winding, pose.shape, first_of(robots).cable_count)
    whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*pose.shape, 6))))

    def equilibrium() -> Equilibrium:
        cables, contact = cables_of_results(robots, model, found.results, found.cable_status, pose.shape)
        return with_routing(Equilibrium(placed, pose, whole, cables, contact), direction)

    state = equilibrium()
    return equilibrium() if found.reject_slack(state.unstrained_length) else state


def _anchors_along(anchors: AnchorMotion, robots: Robot | tuple[Robot, ...], motion: Path | Pose) -> Array:
    """Positions (N, m, 3) [m] of the moving anchors of one robot along a path."""
    if not isinstance(robots, Robot):
        raise InvalidValueError("anchors", "given for several robots", "None, or one robot", "Give a single robot.")
    if not isinstance(motion, Path):
        step = "Plan along a Path, or give robot.replace(frame_anchors=anchors.at(time))."
        raise InvalidValueError("anchors", "given for poses without times", "None, or a path", step)
    return instance(anchors, AnchorMotion, "anchors")._of(robots, motion.time)


def _plan_of(
    state: Equilibrium,
    path: Path | None,
    tension: TensionMethod,
    found: inverse_rows.InverseRows,
    anchors: AnchorMotion | None,
) -> Plan:
    """Plan from the rows `found`, with the shape of the poses."""
    shared, shape = first_of(state.robot), state.pose.shape
    return Plan(
        state=state,
        path=path,
        tension=tension,
        status=locked(found.pose_status.reshape(shape)),
        shortfall=locked(found.shortfall.reshape(shape)),
        wrench_residual=locked(found.residuals.reshape(*shape, 2)),
        blocking=locked(found.blocking.reshape(*shape, shared.cable_count)),
        farkas=locked(_in_world(found.farkas, shared).reshape(*shape, 6)),
        needed=locked(_in_world(found.needed, shared).reshape(*shape, 6)),
        bracket=locked(found.brackets.reshape(*shape, 2)),
        relief=locked(np.ascontiguousarray(_in_world(found.reliefs, shared)[:, :3]).reshape(*shape, 3)),
        at_border=locked(found.at_border.reshape(shape)),
        anchors=anchors,
    )


def _check_plane(robot: Robot, pose: Pose) -> None:
    """Refuse poses of a planar robot at which the cables would not be in the plane of the frame anchors."""
    away = _out_of_plane(robot, pose)
    if (outside := np.flatnonzero(np.abs(away) > ROUNDING)).size:
        k = int(outside[0])
        name = f"pose[{k}]" if pose.shape else "pose"
        value = f"{away[k]:.6g} m along plane_normal from the plane of the frame anchors"
        step = "Project the poses onto the plane, or choose another motion_pattern of the robot."
        raise InvalidValueError(name, value, f"0 m, by motion_pattern {robot.motion_pattern}", step)


def _out_of_plane(robot: Robot, pose: Pose) -> Array:
    """Signed distances (N,) [m] between the plane of the platform ends and the plane of the frame ends."""
    # The distances are zero for a robot that is not planar, or whose frame ends or platform ends are not in one plane.
    away = np.zeros(len(np.atleast_2d(pose.position)))
    if robot.plane_normal is None:
        return away
    frame, platform = robot.frame_anchors @ robot.plane_normal, robot.platform_anchors @ robot.plane_normal
    if np.ptp(frame) > ROUNDING or np.ptp(platform) > ROUNDING:
        return away
    distance: Array = np.atleast_2d(pose.position) @ robot.plane_normal + platform[0] - frame[0]
    return distance


def equilibrium_at(robot: Robot, pose: PoseLike, tension: TensionMethod | str = DEFAULT) -> Equilibrium:
    """Equilibrium at `pose`, a pose or a batch. An infeasible single pose raises an error that names the shortfall."""
    plan = inverse(robot, pose, tension=tension)
    if not plan.state.pose.shape and not plan.feasible:
        why, short = PoseStatus(int(plan.status)), float(plan.shortfall)
        value = why.name + (f", {n(short, '.4g', 'N')} short" if np.isfinite(short) else "")
        raise InvalidValueError("pose", value, "a feasible pose", f"{why.text[0].upper()}{why.text[1:]}.")
    return plan.state


def _given_winding(winding: Winding | None, motion: Path | Pose) -> ArrayLike | None:
    """Check the winding directions of the caller. Returns None if `winding` is None or "path"."""
    if not isinstance(winding, str):
        return winding
    if choice(winding, "winding", ("path",)) and isinstance(motion, Path):
        return None
    step = "Plan along a Path, or give +1, -1 or 0 for each cable."
    raise InvalidValueError("winding", "'path' for poses without a path", "numbers, or None", step)


def _with_path_friction(plan: Plan) -> Plan:
    """The plan with friction. The directions of winding follow from the length changes of the plan."""
    if plan.state.contact is None or plan.length_rate is None:
        return plan
    rate = np.nan_to_num(plan.length_rate)
    standing = np.abs(rate) <= STANDING * np.abs(rate).max(initial=0.0)
    return replace(plan, state=with_routing(plan.state, locked(np.where(standing, 0.0, -np.sign(rate)))))


def _motion_of(motion: Path | PoseLike) -> Path | Pose:
    if isinstance(motion, Path | Pose | list | tuple | np.ndarray):
        return motion if isinstance(motion, Path) else pose_of(motion, "motion")
    step = "Give Pose(x, y, z), or quintic_path(waypoints, speed=1.0)."
    raise InvalidValueError("motion", brief(motion), "a Pose or a Path", step)


def _in_world(components: Array, robot: Robot) -> Array:
    """Wrenches (N, 6) from components (N, n) along the free motions; einsum is faster here than matrix products."""
    if components.shape[1] == robot.freedom.shape[1]:  # all motions are free, the matrix is the identity
        return components
    wrench: Array = np.einsum("pi,ij->pj", components, robot.freedom)
    return wrench


def _reference(robot: Robot, previous: Plan | ArrayLike | None, variable: Variable) -> Array:
    """Initial reference tensions (m,): `previous`, or the last solved tensions of this plan; NaN if none exist."""
    if previous is None:
        return np.full(robot.cable_count, np.nan)
    if not isinstance(previous, Plan):
        return exactly(previous, "previous", "N", (robot.cable_count,), low=0.0).copy()
    cables = previous.state.cables
    if cables.shape[-1] != robot.cable_count:
        value, step = f"a plan of {cables.shape[-1]} cables", "Continue a plan of this robot."
        raise InvalidValueError("previous", value, f"{robot.cable_count} cables", step)
    solved = np.atleast_1d(previous.feasible)
    if previous.at_border is not None:
        solved = solved & ~np.atleast_1d(previous.at_border)
    if not solved.any():
        return np.full(robot.cable_count, np.nan)
    state = previous.state
    return shared_tension(state[int(np.flatnonzero(solved)[-1])] if state.pose.shape else state, variable).copy()
