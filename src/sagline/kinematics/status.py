"""How the calculation of one pose ended, and what to do about it."""

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
