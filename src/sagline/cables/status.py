"""How the calculation of one cable ended, and what to do about it."""

from __future__ import annotations

from enum import IntEnum

from sagline.kernels import codes


class CableStatus(IntEnum):
    """Status of one cable; `text` says what it means and what to do."""

    SOLVED = codes.CABLE_SOLVED
    SLACK = codes.CABLE_SLACK
    NO_TENSION = codes.CABLE_NO_TENSION
    BELOW_VALIDITY = codes.CABLE_BELOW_VALIDITY
    TOO_SLACK = codes.CABLE_TOO_SLACK
    NOT_CONVERGED = codes.CABLE_NOT_CONVERGED

    @property
    def text(self) -> str:
        """One sentence for a person."""
        return _TEXTS[self]


_TEXTS = {
    CableStatus.SOLVED: "solved",
    CableStatus.SLACK: "slack: the cable carries no chord tension; shorten it if it should pull",
    CableStatus.NO_TENSION: "a straight cable has no tension for a length; use another model, or give the tension",
    CableStatus.BELOW_VALIDITY: (
        "the empirical model is outside its validity: the lowest point of the cable lies inside the span; "
        "raise the tension above w D/(2 |sin phi|), or use Catenary()"
    ),
    CableStatus.TOO_SLACK: "the chord tension is below a thousandth of the cable's weight; raise it",
    CableStatus.NOT_CONVERGED: "the iteration did not converge; please report this cable's data",
}
