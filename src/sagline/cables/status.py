"""How the calculation of one cable ended, and what to do about it."""

from __future__ import annotations

from sagline.core.status import Status
from sagline.kernels import codes


class CableStatus(Status):
    """Status of one cable; `text` says what it means and what to do."""

    SOLVED = codes.CABLE_SOLVED, "solved"
    SLACK = codes.CABLE_SLACK, "slack: the cable carries no chord tension; shorten it if it should pull"
    NO_TENSION = (
        codes.CABLE_NO_TENSION,
        "a straight cable has no tension for a length; use another model, or give the tension",
    )
    BELOW_VALIDITY = (
        codes.CABLE_BELOW_VALIDITY,
        "the empirical model is outside its validity: the lowest point of the cable lies inside the span; "
        "raise the tension above w D/(2 |sin phi|), or use Catenary()",
    )
    TOO_SLACK = codes.CABLE_TOO_SLACK, "the chord tension is below a thousandth of the cable's weight; raise it"
    NOT_CONVERGED = codes.CABLE_NOT_CONVERGED, "the iteration did not converge; please report this cable's data"
