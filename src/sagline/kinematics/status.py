"""Status of a pose of a plan, and of a sample of a forward solution, with what to do about it."""

from __future__ import annotations

from sagline.core.status import Status
from sagline.kernels import codes


class PoseStatus(Status):
    """Status of one pose of a plan; `text` says what it means and what to do."""

    SOLVED = codes.POSE_SOLVED, "solved"
    INFEASIBLE = (
        codes.POSE_INFEASIBLE,
        "no tensions within the limits balance the platform; move it, widen the limits of the blocking cables, "
        "or change the load by the shortfall",
    )
    SINGULAR = (
        codes.POSE_SINGULAR,
        "the structure matrix has lost rank: some motion no cable resists; move the platform",
    )
    TOO_SLACK = (
        codes.POSE_TOO_SLACK,
        "a cable would carry less than a thousandth of its weight, or not hang between its guides; raise tension_min",
    )
    NOT_CONVERGED = codes.POSE_NOT_CONVERGED, "the tensions did not settle; please report this robot and pose"
    NO_CHORD = (
        codes.POSE_NO_CHORD,
        "both ends of a cable coincide, or its platform end is inside its pulley or hangs from it nearer to the swivel "
        "axis than the pulley's diameter; move the platform away from the anchor",
    )
    NOT_COVERED = (
        codes.POSE_NOT_COVERED,
        "there are tensions within the limits, but the chosen way of sharing does not find them; "
        "choose MinimumNorm or AnalyticCenter",
    )
    UNBOUNDED = (
        codes.POSE_UNBOUNDED,
        "the feasible tensions have no upper end, and so no middle; give tension_max, or choose MinimumNorm",
    )
    NO_POSE = (
        100,  # no kernel says it: what is no pose does not reach one
        "what was given is no pose: a number is not finite, or the quaternion is not of length 1; give a position and "
        "a unit quaternion, scalar last",
    )
    BORDERLINE = (
        codes.POSE_BORDERLINE,
        "so near the border that neither tensions nor a proof that there are none was found; move the platform, or "
        "change the load by more than the shortfall's bracket",
    )


class ForwardStatus(Status):
    """Status of one sample of a forward solution; `text` says what it means and what to do."""

    SOLVED = codes.FORWARD_SOLVED, "solved: a stable equilibrium"
    LOOSE = (
        codes.FORWARD_LOOSE,
        "a stable equilibrium, but fewer cables pull than the platform has freedoms: the lengths are too long for it "
        "to be held, it hangs; shorten the slack cables",
    )
    OVERSTRETCHED = (
        codes.FORWARD_OVERSTRETCHED,
        "a cable is stretched by more than 10 %: the lengths are too short to meet, real cables would break; "
        "lengthen the cables of highest tension",
    )
    UNSTABLE = (
        codes.FORWARD_UNSTABLE,
        "an equilibrium, but not a stable one: the platform would leave it; "
        "start elsewhere, or leave out the start, to find where it goes",
    )
    SINGULAR = (
        codes.FORWARD_SINGULAR,
        "an equilibrium that some motion leaves without resistance: the pose is not determined",
    )
    NOT_CONVERGED = (
        codes.FORWARD_NOT_CONVERGED,
        "no equilibrium was found within the allowed steps; start closer, or leave out the start to search for one",
    )
    NO_LENGTHS = (
        codes.FORWARD_NO_LENGTHS,
        "all lengths of the sample are NaN, as a plan leaves them at an infeasible pose",
    )
    FITTED = (
        codes.FORWARD_FITTED,
        "straight cables know no forces: this is the pose whose lengths fit best; see cables.closure_residual",
    )


# Equilibria that the platform does not leave by itself.
STABLE = (ForwardStatus.SOLVED, ForwardStatus.LOOSE, ForwardStatus.OVERSTRETCHED)
