"""Faults of the cables and their load cells."""

from __future__ import annotations

from operator import eq
from typing import Final

import numpy as np

from sagline.control.evidence import PLANNED_SHARE, SLACK_SHARE, Cycle, Evidence, Fault, Reaction
from sagline.control.link import Mode
from sagline.control.null_space import SIGMAS, largest
from sagline.core.arrays import Array

NEAR: Final = 0.9  # the motion stops if the tension is above this share of the upper limit for some samples
NEAR_SAMPLES, SLACK_SAMPLES = 5, 3
SUDDEN: Final = 0.5  # least tension of a cable one sample before it breaks, as a share of the planned tension


class _OverTension(Fault, name="over-tension", reaction=Reaction.STOPPING, within="10 to 50 ms"):
    """Cable whose tension is too large."""

    rule = f"T_A above its upper limit in one sample, or above {NEAR:g} of this limit in {NEAR_SAMPLES} samples"

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._near = NEAR * seen.limit
        self._least = float(self._near.min())

    def found(self, cycle: Cycle) -> str | None:
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
            f"cable {cable} has {tension[cable]:.4g} N; allowed: up to {self._near[cable]:.0f} N, "
            f"{seen.limit[cable]:.0f} N for an instant. Check what blocks the cable, then let it out by a jog."
        )


class _CableBroken(Fault, name="cable broken", reaction=Reaction.EMERGENCY, within="30 ms", homing=True, lasting=True):
    """Broken cable. The tensions of the other cables change at the same time."""

    rule = (
        f"slack in one sample, with more than {SUDDEN:g} of its planned tension one sample before; the deviations of "
        f"the other cables from the plan change by > {SIGMAS:g} sigma of their noise"
    )

    def found(self, cycle: Cycle) -> str | None:
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
            f"cable {cable} is broken: {cycle.sample.tension[cable]:.4g} N after {seen.before_low[cable]:.4g} N; "
            f"others have changed by up to {furthest:.4g} N. Drums are locked: support the platform before it moves."
        )


class _Slack(Fault, name="slack", reaction=Reaction.STOPPING, within="30 ms"):
    """Cable that is slack, although the plan requires it to be taut."""

    rule = (
        f"T_A < {SLACK_SHARE:g} of its lower limit ({SIGMAS:g} sigma if the limit is 0) in {SLACK_SAMPLES} samples; "
        f"the planned tension is at least {PLANNED_SHARE:g} of the limit, and the motor does not pull (2 x {SIGMAS:g} "
        "sigma if the limit is a chord tension, because this differs from T_A)"
    )

    def found(self, cycle: Cycle) -> str | None:
        seen = self.seen
        if not seen.any_low:
            return None
        slack = (seen.low >= SLACK_SAMPLES) & seen.believed & ~seen.broken
        if not slack.any():
            return None
        cable = int(np.argmax(slack))
        return (
            f"cable {cable} is slack: it has {cycle.sample.tension[cable]:.4g} N; planned: "
            f"{cycle.tension[cable]:.4g} N. Check that it is on its pulley and drum, then acknowledge."
        )


STUCK_SAMPLES: Final = 50
ODD_TIME: Final = 0.35  # duration of a contradiction between cell and plan [s]; ramps and oscillations are shorter
DISPROVED: Final = 0.5  # a full-scale reading is wrong if the motor holds less than this share of full scale
_STEP: Final = "The tension loop is off. Check cell, plug and amplifier when the platform is at rest, then acknowledge."


class _CellLost(Fault, name="cell lost", reaction=Reaction.STOPPING, within="1 sample", lasting=True):
    """Load cell without a reading during a motion, so that the tension of its cable is not monitored."""

    rule = "a reading that is not a number, in a motion; the PLC then does not wind in this cable"

    def found(self, cycle: Cycle) -> str | None:
        seen = self.seen
        command = cycle.command
        if seen.plain or command is None or command.mode != Mode.FOLLOW or not command.rate.any():
            return None
        lost = ~np.isfinite(cycle.sample.tension) & np.isfinite(cycle.tension) & seen.believed
        if not lost.any():
            return None
        seen.ignore_cells(lost)
        cell = int(np.argmax(lost))
        return (
            f"the load cell of cable {cell} gives no reading; planned: {cycle.tension[cell]:.4g} N. The PLC does not "
            "wind in this cable. Check cell, plug and amplifier, then acknowledge."
        )


class _CellDead(Fault, name="cell zero or saturated", reaction=Reaction.DEGRADED, within="30 ms", lasting=True):
    """Load cell with an impossible reading."""

    rule = (
        f"no reading at rest, a reading below -{SIGMAS:g} sigma, at full scale while the motor holds less than "
        f"{DISPROVED:g} of it, or slack in {SLACK_SAMPLES} samples while the motor pulls"
    )

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._least, self._most = -SIGMAS * seen.sigma, float(seen.full_scale.min())

    def found(self, cycle: Cycle) -> str | None:
        seen, tension = self.seen, cycle.sample.tension
        if seen.plain and seen.least >= self._least and seen.most < self._most and not seen.any_low:
            return None
        pull = seen.pull(cycle)
        dead = ~((tension >= self._least) & np.isfinite(tension))
        dead |= (tension >= seen.full_scale) & (pull < DISPROVED * seen.full_scale)
        dead |= (seen.low >= SLACK_SAMPLES) & seen.pulling(cycle)
        dead &= seen.believed
        if not dead.any():
            return None
        seen.ignore_cells(dead)
        cell = int(np.argmax(dead))
        holds = f" while its motor holds {pull[cell]:.4g} N" if np.isfinite(pull[cell]) else ""
        reads = f"reads {tension[cell]:.4g} N" if np.isfinite(tension[cell]) else "gives no reading"
        planned = f"; planned: {cycle.tension[cell]:.4g} N" if np.isfinite(cycle.tension[cell]) else ""
        return f"cell {cell} {reads}{holds}{planned}. {_STEP}"


class _CellStuck(Fault, name="cell stuck", reaction=Reaction.DEGRADED, within="0.5 s", lasting=True):
    """Load cell with a constant reading."""

    rule = f"the same reading in {STUCK_SAMPLES} samples in motion"

    def found(self, cycle: Cycle) -> str | None:
        seen = self.seen
        if cycle.before is None:
            return None
        tension, before = cycle.sample.tension, cycle.before.tension
        if not any(map(eq, tension.tolist(), before.tolist())):
            self._for.fill(0)
            return None
        if not cycle.moving:
            return None
        same = tension == before
        self._for = np.where(same, self._for + seen.fresh, 0)
        stuck = (self._for >= STUCK_SAMPLES - 1) & seen.believed  # number of samples that repeat the first sample
        if not stuck.any():
            return None
        seen.ignore_cells(stuck)
        cell = int(np.argmax(stuck))
        reading = cycle.sample.tension[cell]
        return f"cell {cell} has read {reading:.4g} N in {STUCK_SAMPLES} samples of a motion. {_STEP}"


class _CellOff(Fault, name="cell wrong", reaction=Reaction.DEGRADED, within="0.5 s", lasting=True):
    """Load cell that contradicts the force balance of the platform."""

    rule = f"for {ODD_TIME:g} s the largest parity of the cells is > {SIGMAS:g} sigma, independent of the load"

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._samples = round(ODD_TIME / seen.period)
        self._side = np.zeros(len(seen.group_of))  # sign of each error above the limit in the previous cycle, or 0
        self._quiet = True

    def found(self, cycle: Cycle) -> str | None:
        seen = self.seen
        error = self._error(cycle)  # while one cell is wrong, the others cannot be compared
        limit = SIGMAS * seen.sigma
        if error is None or not largest(error) > limit:
            if not self._quiet:
                self._for.fill(0)
                self._side.fill(0.0)
                self._quiet = True
            return None
        # an oscillation of the platform changes its sign within ODD_TIME; the filter is fast enough to show this
        side = np.sign(error) * (np.abs(error) > limit)
        self._for = np.where(side != 0.0, np.where(side == self._side, self._for + 1, 1), 0)
        self._side = side
        self._quiet = False
        cell = int(np.argmax(np.abs(error)))
        if self._for[cell] < self._samples:
            return None
        seen.ignore_cells(np.arange(error.size) == cell)
        visible = float(cycle.gains.parity[cell, cell]) if cycle.gains is not None else 1.0
        return (
            f"cell {cell} differs by about {error[cell] / visible:.0f} N from the force balance of the platform; "
            f"allowed: {limit / visible:.0f} N. "
            f"It reads {cycle.sample.tension[cell]:.4g} N, planned: {cycle.tension[cell]:.4g} N. {_STEP}"
        )

    def _error(self, cycle: Cycle) -> Array | None:
        """Error of each cell from the parity matrix [N], (m,); None without a parity matrix."""
        seen = self.seen
        if cycle.gains is None or not seen.compared or seen.any_low or not all(seen.believed.tolist()):
            return None
        error: Array = cycle.gains.parity.dot(seen.quick)
        return error


# in the order of evaluation: a lost or dead cell must be found before its cable counts as slack
CABLE_FAULTS: Final = (_CellLost, _CellDead, _CellStuck, _CellOff, _OverTension, _CableBroken, _Slack)
