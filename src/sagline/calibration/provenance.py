"""What a calibrated robot keeps of its calibration."""

from __future__ import annotations

import numpy as np

from sagline.calibration.status import CalibrationStatus
from sagline.calibration.unknowns import KINDS, Parameters
from sagline.core.arrays import Array
from sagline.robot.provenance import Provenance
from sagline.robot.tolerances import UNCERTAIN


def provenance_of(
    parameters: Parameters, standard_error: Array, status: CalibrationStatus, log: str, date: str
) -> Provenance:
    """Where the numbers of a calibrated robot come from, each with its standard error.

    Args:
        parameters: What was looked for.
        standard_error: Of what was found, in the units of the parameters, (P,).
        status: How it ended; one that is not FOUND is noted.
        log: Where the readings come from.
        date: When it was done, ISO 8601.
    """
    errors: dict[str, Array] = {}
    for name in dict.fromkeys(parameters.names):
        if name not in UNCERTAIN or (name == "length_zero" and not parameters.counted):
            continue
        first, axes = KINDS[name].first, len(KINDS[name].axes)
        error = standard_error[np.asarray(parameters.where[first : first + axes], dtype=np.int64)].T
        own = error if UNCERTAIN[name].each else error[0]
        errors[name] = own if UNCERTAIN[name].axes else own[..., 0]
    return Provenance(log, date, errors, "" if status is CalibrationStatus.FOUND else status.text)
