"""Faults of the cables: too tight, slack, broken."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.control.evidence import PLANNED_SHARE, SLACK_SHARE, Cycle, Evidence
from sagline.control.fault import Fault, Reaction
from sagline.control.null_space import SIGMAS

NEAR: Final = 0.9  # of the upper limit; a plan that goes beyond would stop here
NEAR_SAMPLES, SLACK_SAMPLES = 5, 3
SUDDEN: Final = 0.5  # of the planned tension: what a cable had that broke, one sample before it was slack


class OverTension(Fault):
    """A cable pulls too hard."""

    name = "over-tension"
    rule = f"T_A above its upper limit in 1 sample, or above {NEAR:g} of it in {NEAR_SAMPLES}"
    reaction = Reaction.STOPPING
    within = "10 to 50 ms"

    def __init__(self, seen: Evidence) -> None:
        """Begin with no cable tight."""
        super().__init__(seen)
        self._near = NEAR * seen.limit
        self._least, self._for = float(self._near.min()), np.zeros(seen.limit.size, dtype=np.int64)

    def found(self, cycle: Cycle) -> str | None:
        """The tightest, by its limit."""
        seen, tension = self.seen, self.seen.tension
        if not seen.most > self._least:
            self._for.fill(0)
            return None
        near = (tension > self._near) & seen.believed
        self._for = np.where(near, self._for + seen.fresh, 0)
        over = ((tension > seen.limit) & seen.believed) | (self._for >= NEAR_SAMPLES)
        if not over.any():
            return None
        cables = np.flatnonzero(over)
        cable = int(cables[np.argmax(tension[cables] / seen.limit[cables])])
        return (
            f"cable {cable} pulls {tension[cable]:.4g} N; allowed: up to {self._near[cable]:.0f} N, "
            f"{seen.limit[cable]:.0f} N for an instant. See what it hangs on, then jog it out."
        )


class CableBroken(Fault):
    """A cable is gone: with the others the platform can be held nowhere near."""

    name = "cable broken"
    rule = (
        f"slack from one sample to the next after more than {SUDDEN:g} of its planned tension, and the others leave "
        f"what they were off the plan by > {SIGMAS:g} sigma of their noise"
    )
    reaction = Reaction.EMERGENCY
    within = "30 ms"
    homing = True
    lasting = True

    def found(self, cycle: Cycle) -> str | None:
        """The first cable that is newly found broken."""
        seen = self.seen
        if not (seen.any_low and seen.compared):
            return None
        sudden = (seen.low >= SLACK_SAMPLES) & seen.believed & (seen.before_low > SUDDEN * cycle.tension)
        new = sudden & ~seen.broken
        if not new.any():
            return None
        left = np.abs(seen.tension - cycle.tension - seen.steady)
        others = seen.believed & (seen.low == 0)
        furthest = float(left[others].max(initial=0.0))
        if furthest <= SIGMAS * seen.noise:
            return None
        seen.broken |= new
        cable = int(np.argmax(new))
        return (
            f"cable {cable} is broken: {cycle.sample.tension[cable]:.4g} N after {seen.before_low[cable]:.4g} N, "
            f"others have changed by up to {furthest:.4g} N. Drums are locked: prop the platform up before it moves."
        )


class Slack(Fault):
    """A cable hangs that the plan wants taut."""

    name = "slack"
    rule = (
        f"T_A < {SLACK_SHARE:g} of its lower limit ({SIGMAS:g} sigma where that is 0) in {SLACK_SAMPLES} samples where "
        f"the plan has {PLANNED_SHARE:g} of it or more (the limit may be one along the chord, which T_A is not; "
        f"{2 * SIGMAS:g} sigma), and its motor does not pull either"
    )
    reaction = Reaction.STOPPING
    within = "30 ms"

    def found(self, cycle: Cycle) -> str | None:
        """The first slack cable."""
        seen = self.seen
        if not seen.any_low:
            return None
        slack = (seen.low >= SLACK_SAMPLES) & seen.believed & ~seen.broken
        if not slack.any():
            return None
        cable = int(np.argmax(slack))
        return (
            f"cable {cable} is slack: it pulls {cycle.sample.tension[cable]:.4g} N where the plan has "
            f"{cycle.tension[cable]:.4g} N. See whether it has left its pulley or drum, then acknowledge."
        )
