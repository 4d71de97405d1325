"""What the bracket of a pose's margin says, and what to do about it."""

from __future__ import annotations

from sagline.core.status import Status
from sagline.kernels import codes


class MarginStatus(Status):
    """Status of one pose of a margin; `text` says what it means and what to do."""

    FEASIBLE = codes.MARGIN_FEASIBLE, "the cables balance every load of the set within their limits, sag included"
    INFEASIBLE = (
        codes.MARGIN_INFEASIBLE,
        "a load of the set is beyond what the cables can balance within their limits, whatever their sag; move the "
        "platform, widen the limits of the limiting cable, or ask for less load",
    )
    OPEN = (
        codes.MARGIN_OPEN,
        "within the bracket that the cables' sag leaves: neither proved; ask inverse at single loads, or move the "
        "platform by a millimeter",
    )
    SINGULAR = (
        codes.MARGIN_SINGULAR,
        "the structure matrix has lost rank: some motion no cable resists; move the platform",
    )
    NO_CHORD = (
        codes.MARGIN_NO_CHORD,
        "both ends of a cable coincide, or its platform end is inside its pulley or hangs from it nearer to the swivel "
        "axis than the pulley's diameter, or the pose is not known; move the platform away from the anchor",
    )
    TOO_SLACK = (
        codes.MARGIN_TOO_SLACK,
        "a cable may carry less than a thousandth of its weight at most; raise tension_max",
    )
