"""Colors of cables and tensions, and the unit of forces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite, log, log10
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array
from sagline.robot.robot import Robot

Color = tuple[int, int, int]  # red, green and blue, 0 to 255

# Most robots have up to eight cables. The first eight colors differ for all kinds of color vision. Each color is
# visible on a white and on a dark background.
CABLES: Final[tuple[Color, ...]] = (
    (17, 118, 142), (217, 167, 10), (98, 93, 240), (130, 190, 106), (238, 149, 166), (154, 169, 240),
    (130, 99, 81), (104, 114, 21), (70, 96, 210), (210, 100, 56), (44, 170, 110), (176, 80, 176),
    (80, 140, 150), (196, 146, 96), (124, 164, 30), (160, 60, 80),
)  # fmt: skip
NONE: Final[Color] = (150, 155, 162)  # color without a limiting cable


def cables_text(cables: Iterable[int]) -> str:
    """Numbers of cables, "cables 1, 2"."""
    numbers = [str(cable) for cable in cables]
    return f"cable{'s' if len(numbers) > 1 else ''} {', '.join(numbers)}"


def cable_color(cable: int) -> Color:
    """The color of a cable."""
    return NONE if cable < 0 else CABLES[cable % len(CABLES)]


Colors = NDArray[np.uint8]

# The scale goes from blue over red to ochre. Each step has a contrast of 3 : 1 on the white and on the dark background,
# so that all steps have a similar lightness. Color-blind users can also distinguish blue and yellow.
_STEPS = np.array(
    [[62, 96, 232], [170, 74, 194], [200, 74, 166], [214, 80, 126], [216, 98, 78], [206, 128, 20]], dtype=np.float64
)
GRAY = np.array([130, 136, 144], dtype=np.uint8)  # color of a cable without a tension
_SPREAD = 100.0  # ratio of highest to lowest tension for a robot without a lower limit
_NARROWEST = 1.001  # ratio of highest to lowest tension below which all cables of a pose have one color
_PER_WEIGHT = 4.0  # ratio of highest tension to platform weight for a robot without an upper limit


@dataclass(frozen=True, slots=True)
class TensionScale:
    """Tensions on a logarithmic scale, because a robot's limits often differ by a factor of a hundred."""

    low: float  # tension at the blue end [N], > 0
    high: float  # tension at the yellow end [N], > low

    @classmethod
    def of(cls, robot: Robot) -> TensionScale:
        """The scale between the limits of a robot; missing limits are estimated from its weight."""
        weight = robot.mass * max(robot.gravity, 1.0)
        top, bottom = float(robot.tension_max.max()), float(robot.tension_min.min())
        high = top if isfinite(top) and top > 0.0 else max(_PER_WEIGHT * weight, 10.0 * bottom)
        low = bottom if bottom > 0.0 else high / _SPREAD
        return cls(low, high) if low < high else cls(0.5 * low, 2.0 * high)

    @classmethod
    def of_pose(cls, tension: Array, otherwise: TensionScale) -> TensionScale:
        """The scale between the smallest and largest tension of a pose (m,). If no tension is positive, `otherwise`."""
        known = tension[np.isfinite(tension) & (tension > 0.0)]
        if not known.size:
            return otherwise
        low, high = float(known.min()), float(known.max())
        return cls(low, high) if high > _NARROWEST * low else cls(low / _NARROWEST, high * _NARROWEST)

    def fraction(self, tension: Array) -> Array:
        """Positions of tensions on the scale, 0 to 1, clipped at its ends."""
        low, high = log(self.low), log(self.high)
        return np.asarray((np.log(np.clip(tension, self.low, self.high)) - low) / (high - low))

    def colors(self, tension: Array) -> Colors:
        """Color of each tension, shape (..., 3); gray for NaN."""
        known = np.isfinite(tension)
        place = self.fraction(np.where(known, tension, self.low)) * (len(_STEPS) - 1)
        mixed = np.stack([np.interp(place, np.arange(len(_STEPS)), part) for part in _STEPS.T], axis=-1)
        return np.where(known[..., None], np.rint(mixed).astype(np.uint8), GRAY)

    def bar(self, count: int) -> Colors:
        """Colors of equal steps along the scale, shape (count, 3)."""
        return self.colors(self.low * (self.high / self.low) ** np.linspace(0.0, 1.0, count))

    def linear_colors(self, tension: Array) -> Colors:
        """The same colors without the sRGB curve, which viser's client applies to the colors of line ends."""
        return linear(self.colors(tension))

    def ticks(self) -> tuple[float, ...]:
        """Round tensions within the scale: 1, 2 and 5 times powers of ten."""
        decades = range(int(log10(self.low)) - 1, int(log10(self.high)) + 2)
        found = tuple(step * 10.0**decade for decade in decades for step in (1, 2, 5))
        return tuple(tick for tick in found if self.low <= tick <= self.high)


KILO_FROM = 1e5  # smallest force that is written in kilonewtons [N]


class ForceUnit(NamedTuple):
    """Unit in which the forces of a robot are written."""

    name: str  # "N" or "kN"
    newtons: float  # size of the unit [N]
    form: str  # format specification, with the decimals

    @property
    def decimals(self) -> int:
        """Number of decimals."""
        return int(self.form[1])

    @classmethod
    def of(cls, robot: Robot) -> ForceUnit:
        """Unit of the forces of a robot; its highest tension determines the unit, which is the same at all poses."""
        return cls.up_to(TensionScale.of(robot).high)

    @classmethod
    def up_to(cls, highest: float) -> ForceUnit:
        """The unit for forces up to a highest force [N]."""
        return cls("N", 1.0, ".1f") if highest < KILO_FROM else cls("kN", 1e3, ".2f")

    def bare(self, force: float) -> str:
        """A force [N] without the unit."""
        return number_text(force / self.newtons, self.form)

    def written(self, force: float) -> str:
        """A force [N] with the unit."""
        return f"{self.bare(force)} {self.name}"

    def span(self, forces: Array) -> str:
        """Lowest and highest of the known `forces` [N], with the unit."""
        return f"{self.bare(np.nanmin(forces))} to {self.written(np.nanmax(forces))}"


def number_text(value: float, form: str) -> str:
    """Text of `value`, or a dash if it is not finite. A number that is rounded to zero does not have a sign."""
    return f"{value:z{form}}" if isfinite(value) else "–"


def linear(colors: Colors) -> Colors:
    """Colors before the sRGB curve, in the form for line ends in viser's client."""
    share = colors / 255.0
    undone = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * undone).astype(np.uint8)
