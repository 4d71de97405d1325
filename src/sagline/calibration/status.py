"""How a calibration ended, and why rows of a log were left out."""

from __future__ import annotations

from sagline.core.status import Status


class CalibrationStatus(Status):
    """How a calibration ended; `text` says what to do."""

    FOUND = 0, "found"
    DOUBTFUL = (
        1,
        "found, but chi squared says that the model or the deviations are wrong: see residuals and outliers, "
        "and do not trust the standard errors",
    )
    NOT_CONVERGED = 2, "not converged: is it this robot's log? begin nearer, or with fewer unknowns"


class Omission(Status):
    """Why a row of a log was left out; `text` says it of one row."""

    NOT_A_NUMBER = 0, "a reading is missing that the rest of the log has"
    REPEATED = 1, "the readings of an earlier row again"
    MOVING = 2, "the platform moved"
    SLACK = 3, "a cable was slack"
    NO_EQUILIBRIUM = 4, "the platform finds no equilibrium at its lengths"
    OTHER_EQUILIBRIUM = 5, "the lengths put the platform elsewhere than its other readings do"
