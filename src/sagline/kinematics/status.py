"""Statuses of poses of a plan and of samples of a forward solution, with the next step."""

from __future__ import annotations

from sagline.core.results import Status
from sagline.kernels import codes


class PoseStatus(Status):
    """Status of one pose of a plan; `text` states its meaning and the next step."""

    SOLVED = codes.POSE_SOLVED, "solved"
    INFEASIBLE = (
        codes.POSE_INFEASIBLE,
        "no tensions within the limits balance the platform; move it, widen the limits of the blocking cables, "
        "or change the load by the shortfall",
    )
    SINGULAR = (
        codes.POSE_SINGULAR,
        "the structure matrix has lost rank: no cable resists some motion of the platform; move the platform",
    )
    TOO_SLACK = codes.POSE_TOO_SLACK, "a cable has no catenary between its guides; raise tension_min"
    NOT_CONVERGED = codes.POSE_NOT_CONVERGED, "the tensions did not converge; please report this robot and pose"
    NO_CHORD = (
        codes.POSE_NO_CHORD,
        "both ends of a cable coincide, or its platform end is inside or below its pulley, closer to the swivel axis "
        "than the diameter of the pulley; move the platform away from the anchor",
    )
    NOT_COVERED = (
        codes.POSE_NOT_COVERED,
        "tensions within the limits exist, but the chosen tension distribution method does not find them; "
        "choose MinimumNorm or AnalyticCenter",
    )
    UNBOUNDED = (
        codes.POSE_UNBOUNDED,
        "the feasible tensions are unbounded, so they have no center; give tension_max, or choose MinimumNorm",
    )
    NO_POSE = (
        100,  # the callers of kernels set this status, because kernels never get invalid poses
        "the value is not a pose: a number is not finite, or the quaternion is not of length 1; give a position and "
        "a unit quaternion, scalar last",
    )
    BORDERLINE = (
        codes.POSE_BORDERLINE,
        "too near the border of feasibility: neither tensions nor a proof of infeasibility was found; move the "
        "platform, or change the load by more than the shortfall's bracket",
    )
    UNSTABLE = (
        codes.POSE_UNSTABLE,
        "the tensions balance the platform, but the equilibrium is unstable, and the platform would leave it; raise "
        "tension_min, choose a method with higher tensions such as AnalyticCenter, or move the platform",
    )
    NO_EQUILIBRIUM = (
        codes.POSE_NO_EQUILIBRIUM,
        "the robot has fewer cables than degrees of freedom, and no equilibrium with the given values was found; move "
        "the platform to the middle, give the tension level instead of the yaw, or start at a closer rotation",
    )


class ForwardStatus(Status):
    """Status of one sample of a forward solution; `text` states its meaning and the next step."""

    SOLVED = codes.FORWARD_SOLVED, "solved: a stable equilibrium"
    LOOSE = (
        codes.FORWARD_LOOSE,
        "a stable equilibrium, but fewer cables are taut than the platform has degrees of freedom: the lengths are too "
        "long to hold it; shorten the slack cables",
    )
    OVERSTRETCHED = (
        codes.FORWARD_OVERSTRETCHED,
        "a cable is stretched by more than 10 %, which breaks a real cable: the lengths are too short; "
        "lengthen the cables with the highest tension",
    )
    UNSTABLE = (
        codes.FORWARD_UNSTABLE,
        "an unstable equilibrium: the platform would leave it; "
        "to find a stable equilibrium, omit the start or use another one",
    )
    SINGULAR = (
        codes.FORWARD_SINGULAR,
        "an equilibrium in which no cable resists some motion: the lengths do not determine the pose",
    )
    NOT_CONVERGED = (
        codes.FORWARD_NOT_CONVERGED,
        "no equilibrium was found within the allowed number of steps; use a closer start, or omit the start",
    )
    NO_LENGTHS = codes.FORWARD_NO_LENGTHS, "all lengths of the sample are NaN, as in a plan at an infeasible pose"
    FITTED = (
        codes.FORWARD_FITTED,
        "straight cables have no forces: this pose fits the lengths best; see cables.closure_residual",
    )


# Statuses of poses with tensions and lengths.
BALANCED = (PoseStatus.SOLVED, PoseStatus.UNSTABLE)
# Statuses of stable equilibria.
STABLE = (ForwardStatus.SOLVED, ForwardStatus.LOOSE, ForwardStatus.OVERSTRETCHED)
