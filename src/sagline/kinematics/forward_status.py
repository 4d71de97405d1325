"""How the forward calculation of one sample ended, and what to do about it."""

from __future__ import annotations

from sagline.core.status import Status
from sagline.kernels import codes


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
