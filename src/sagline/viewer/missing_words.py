"""What is missing where the platform cannot be held, in words and as HTML."""

from __future__ import annotations

from html import escape
from typing import Final

import numpy as np

from sagline.core.errors import SaglineError
from sagline.core.numbers import n
from sagline.kinematics.status import PoseStatus
from sagline.tension.singular import unresisted_motion
from sagline.viewer.channel import chosen_by
from sagline.viewer.missing import Missing
from sagline.viewer.missing_nearest import NearestHeld
from sagline.viewer.polygon_figure import SHARING
from sagline.viewer.readout import block
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.wording import ForceUnit, method_name, number

GO: Final = "go-there"  # topic of the button that puts the platform to the nearest pose
TURNS_LITTLE: Final = 1e-9  # of a force at an arm of a meter: no moment
OTHERWISE: Final = "AnalyticCenter"  # finds tensions wherever there are any


def explanation(snapshot: Snapshot, missing: Missing | None, nearest: NearestHeld | None, *, looking: bool) -> str:
    """HTML: the missing force, the limits that cables stand at, and the nearest pose that is held, to go to.

    Args:
        snapshot: What is shown, not feasible.
        missing: What is missing; None where that is not the reason.
        nearest: The nearest pose; None where none is known.
        looking: Whether one is being looked for.
    """
    rows = _missing_rows(snapshot, missing) if missing is not None else _other_rows(snapshot)
    if nearest is not None:
        place = ", ".join(number(x, ".3f") for x in nearest.pose.position)
        button = f"<button {chosen_by(GO, '')}>Go there</button>"
        level = ", the platform level" if nearest.turned else ""
        rows.append(("Held nearest", f"{distance_of(nearest)} away at {place} m{level}. {button}"))
    elif looking:
        rows.append(("Held nearest", "looked for …"))
    elif snapshot.status not in (PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED):
        rows.append(("Held nearest", "nowhere within the robot, turned like this or level"))
    return block('<dl class="missing">' + "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in rows) + "</dl>")


def distance_of(nearest: NearestHeld) -> str:
    """How far it is."""
    return n(nearest.distance, ".3g", "m")


def missing_label(missing: Missing, unit: ForceUnit) -> str:
    """What is written at the arrow."""
    text = f"{unit.written(float(np.linalg.norm(missing.force)))} missing"
    return text + (f", and {_moment(missing)}" if _turns(missing) else "")


def _missing_rows(snapshot: Snapshot, missing: Missing) -> list[tuple[str, str]]:
    unit = force_unit(snapshot.robot)
    parts = ", ".join(unit.bare(part) for part in missing.force)
    size = unit.written(float(np.linalg.norm(missing.force)))
    rows = [("Missing force", f"{size}: x, y, z {parts} {unit.name}")]
    if _turns(missing):
        turning = ", ".join(number(part, ".4g") for part in missing.moment)
        rows = [
            ("Missing force", f"{size}, which alone would not do: x, y, z {parts} {unit.name}"),
            ("and moment", f"{_moment(missing)}: {turning} N m about x, y, z through the center of mass"),
        ]
    for lower in (True, False):
        cables = [str(each.cable) for each in missing.limits if each.lower is lower]
        if cables:
            rows.append(
                (f"At {'lower' if lower else 'upper'} limit", f"cable{'s'[: len(cables) - 1]} {', '.join(cables)}")
            )
    return rows


def _other_rows(snapshot: Snapshot) -> list[tuple[str, str]]:
    """Where no force is missing, or none that is known."""
    status = snapshot.status
    if status in (PoseStatus.NOT_COVERED, PoseStatus.UNBOUNDED) and snapshot.plan is not None:
        other = OTHERWISE if status is PoseStatus.NOT_COVERED else "MinimumNorm"
        here = escape(method_name(snapshot.plan.tension))
        return [("Shared by", f"{here}, which has no answer. <button {chosen_by(SHARING, other)}>{other}</button>")]
    if status is PoseStatus.SINGULAR:
        try:
            return [("No cable resists", escape(unresisted_motion(snapshot.robot, snapshot.pose).text))]
        except SaglineError:
            return []
    return []


def _turns(missing: Missing) -> bool:
    return bool(np.linalg.norm(missing.moment) > TURNS_LITTLE * np.linalg.norm(missing.force))


def _moment(missing: Missing) -> str:
    return n(float(np.linalg.norm(missing.moment)), ".4g", "N m")
