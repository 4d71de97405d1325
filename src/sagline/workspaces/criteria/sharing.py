"""Which ways of sharing a load criteria can look at: tensions that jump from pose to pose bound no region."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from sagline.core.errors import InvalidValueError
from sagline.tension.closest import Closest
from sagline.tension.improved_closed_form import ImprovedClosedForm
from sagline.tension.lowest_maximum import LowestMaximum
from sagline.tension.lowest_sum import LowestSum
from sagline.tension.method import TensionMethod
from sagline.tension.polygon_walk import PolygonWalk
from sagline.tension.puncture import Puncture
from sagline.workspaces.criteria.criterion import Criterion

JUMPING: Final = (LowestSum, LowestMaximum, ImprovedClosedForm, Puncture)
CONTINUOUS: Final = "MinimumNorm, QuadraticProgram, PNorm, AnalyticCenter, Centroid, ClosedForm"


def jumps(method: TensionMethod) -> bool:
    """Whether tensions shared so change by leaps where the pose changes a little.

    Args:
        method: The way of sharing, each pose alone.
    """
    return isinstance(method, JUMPING) or (isinstance(method, PolygonWalk) and method.optimum == "1-norm")


def check_sharing(method: TensionMethod, criteria: Sequence[Criterion]) -> None:
    """Refuse criteria on tensions that jump, or that depend on the pose before.

    Args:
        method: How the load is shared.
        criteria: What looks at it.

    Raises:
        InvalidValueError: If there are such criteria; the message names the continuous methods.
    """
    if not (jumps(method) or isinstance(method, Closest)) or not any(one.needs_tensions for one in criteria):
        return
    first = next(one for one in criteria if one.needs_tensions)
    jump = "has tensions that jump from pose to pose" if jumps(method) else "depends on the pose before"
    value = f"{type(method).__name__}, which {jump}"
    step = f"{type(first).__name__} needs tensions that are continuous."
    raise InvalidValueError("tension", value, CONTINUOUS, step)
