"""Tension loop: correction of tension errors by changes of length that do not move the platform."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from sagline.control.extrema import finite, largest
from sagline.control.link import PERIOD
from sagline.control.null_space import NullSpace
from sagline.core.arguments import instance, whole_number
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import NumberFields, rule

MOST_CABLES: Final = 10**6
MOST_GAIN: Final = 0.1  # largest gain per cycle; a loop with a delay of five cycles is unstable above 0.17


@dataclass(frozen=True, slots=True)
class TensionSettings(NumberFields):
    """Settings of the tension loop. The defaults give stability margins of 24 dB and 62° for a delay of 5 cycles.

    Attributes:
        filter_time: Time constant of the input filter [s], > 0.
        gain: Share of the error that is corrected in each cycle, >= 0, at most 0.1; 0 switches the loop off.
        act_above: The loop begins to act if the largest tension error in the null space exceeds this value [N].
        rest_below: The loop stops acting if the largest tension error is below this value [N], >= 0, less than
            `act_above`.
        largest: Limit of the correction of a length [m], > 0.

    Raises:
        InvalidValueError: If a value is out of its range.
    """

    filter_time: float = field(default=0.5, metadata=rule("s", above=0.0))
    gain: float = field(default=0.01, metadata=rule(low=0.0))
    act_above: float = field(default=3.0, metadata=rule("N", above=0.0))
    rest_below: float = field(default=0.5, metadata=rule("N", low=0.0))
    largest: float = field(default=5e-3, metadata=rule("m", above=0.0))

    def __post_init__(self) -> None:
        """Check the values."""
        super(TensionSettings, self).__post_init__()
        if self.gain > MOST_GAIN:
            step = "Give 0.01; with a larger value, friction in the drives causes oscillations."
            raise InvalidValueError("gain", f"{self.gain:g}", f"0 to {MOST_GAIN:g}", step)
        if self.rest_below >= self.act_above:
            allowed = f"less than act_above, {self.act_above:g} N"
            raise InvalidValueError("rest_below", f"{self.rest_below:g} N", allowed, "Lower rest_below.")


class TensionLoop:
    """Correction of lengths that reduces the tension errors.

    The correction is kept for a session, because the errors of the lengths remain. In each cycle, f <- f + h/(tau + h)
    (T - T_plan - f). While the loop acts, delta <- delta - k N_L G f. See docs/model.md, section 12.

    Attributes:
        settings: Gain, filter and limits.
        acting: True while the loop acts.
    """

    def __init__(self, cable_count: int, settings: TensionSettings | None = None, period: float = PERIOD) -> None:
        """Begin without correction.

        Args:
            cable_count: Number of cables m.
            settings: Settings of the loop.
            period: Period of a cycle [s], > 0.

        Raises:
            InvalidValueError: If an argument has the wrong type or is out of its range.
        """
        m = whole_number(cable_count, "cable_count", 1, MOST_CABLES)
        self.settings = TensionSettings() if settings is None else instance(settings, TensionSettings, "settings")
        cycle = number(period, "period", "s", above=0.0)
        self._share = np.full(m, cycle / (self.settings.filter_time + cycle))  # an array is faster than a number
        self._row: NullSpace | None = None
        self._filtered, self._correction = np.zeros(m), np.zeros(m)
        self._error, self._change = np.empty(m), np.empty(m)
        self.acting = False

    @property
    def correction(self) -> Array:
        """Correction of the lengths of the plan [m], shape (m,)."""
        return self._correction.copy()

    @property
    def error(self) -> float:
        """Largest filtered tension error in the null space [N]; 0 before the first step."""
        return 0.0 if self._row is None else float(np.abs(self._row.visible @ self._filtered).max())

    def step(self, tension: Array, planned: Array, row: NullSpace, *, frozen: bool = False) -> Array:
        """Correction for the next cycle.

        Args:
            tension: T_A, tension measured by the load cells [N], shape (m,).
            planned: Planned tension at the same time [N], shape (m,).
            row: Matrices of the tension loop at this time of the plan.
            frozen: True if the tensions are old or doubtful. Tensions then have no effect, and the correction is
                adapted only to the pose.

        Returns:
            Correction of the lengths of the plan [m], shape (m,), an array owned by the caller.
        """
        if row is not self._row:  # a correction in the null space of one pose would move the platform at the next pose
            if self._row is not None:
                np.matmul(row.projection, self._correction, out=self._change)
                self._correction[:] = self._change
            self._row = row
        np.subtract(tension, planned, out=self._error)
        if not frozen and finite(self._error):  # a NaN would remain in the filter forever
            self._learn(row)
        return self._correction.copy()

    def _learn(self, row: NullSpace) -> None:
        """Filter the error, and change the correction if the error is large."""
        settings, change = self.settings, self._change
        self._error -= self._filtered
        self._error *= self._share
        self._filtered += self._error
        row.visible.dot(self._filtered, change)
        self.acting = bool(largest(change) > (settings.rest_below if self.acting else settings.act_above))
        if not self.acting:
            return
        row.correction.dot(self._filtered, change)
        change *= settings.gain
        self._correction -= change
        if (most := largest(self._correction)) > settings.largest:  # a fault rule reports a correction at its limit
            self._correction *= settings.largest / most  # a separate limit for each length would move the platform
