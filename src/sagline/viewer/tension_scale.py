"""Colors of cables and tensions, and the unit of forces."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, log, log10
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array
from sagline.robot.robot import Robot

Color = tuple[int, int, int]  # red, green and blue, 0 to 255

# The most different hues first, each visible on white and on dark: most robots have up to eight cables.
CABLES: Final[tuple[Color, ...]] = (
    (14, 147, 132), (232, 160, 32), (122, 92, 196), (94, 156, 60), (206, 84, 128), (24, 135, 196),
    (158, 104, 66), (150, 146, 20), (70, 96, 210), (210, 100, 56), (44, 170, 110), (176, 80, 176),
    (80, 140, 150), (196, 146, 96), (124, 164, 30), (160, 60, 80),
)  # fmt: skip
NONE: Final[Color] = (150, 155, 162)  # where no cable limits


def cable_color(cable: int) -> Color:
    """The color of a cable."""
    return NONE if cable < 0 else CABLES[cable % len(CABLES)]


Colors = NDArray[np.uint8]

# From blue over red to ochre. Each step has a contrast of 3 : 1 on the white and on the dark background, so their
# lightness is similar; blue and yellow are also distinct for color-blind users.
_STEPS = np.array(
    [[62, 96, 232], [170, 74, 194], [200, 74, 166], [214, 80, 126], [216, 98, 78], [206, 128, 20]], dtype=np.float64
)
GRAY = np.array([130, 136, 144], dtype=np.uint8)  # of a cable without a tension
_SPREAD = 100.0  # highest over lowest tension where the robot has no lower limit
_PER_WEIGHT = 4.0  # highest tension over the platform's weight where the robot has no upper limit


@dataclass(frozen=True, slots=True)
class TensionScale:
    """Tensions on a logarithmic scale: a robot's limits are often two decades apart."""

    low: float  # tension at the blue end [N], > 0
    high: float  # tension at the yellow end [N], > low

    @classmethod
    def of(cls, robot: Robot) -> TensionScale:
        """The scale between the limits of a robot; where it has none, between guesses from its weight."""
        weight = robot.mass * max(robot.gravity, 1.0)
        top, bottom = float(robot.tension_max.max()), float(robot.tension_min.min())
        high = top if isfinite(top) and top > 0.0 else max(_PER_WEIGHT * weight, 10.0 * bottom)
        low = bottom if bottom > 0.0 else high / _SPREAD
        return cls(low, high) if low < high else cls(0.5 * low, 2.0 * high)

    def fraction(self, tension: Array) -> Array:
        """Fractions of the scale at which tensions lie, 0 to 1, clipped beyond its ends."""
        inside = np.clip(tension, self.low, self.high)
        return np.asarray((np.log(inside) - log(self.low)) / (log(self.high) - log(self.low)))

    def colors(self, tension: Array) -> Colors:
        """Color of each tension, shape (..., 3); gray for NaN."""
        known = np.isfinite(tension)
        place = self.fraction(np.where(known, tension, self.low)) * (len(_STEPS) - 1)
        first = np.minimum(place.astype(np.intp), len(_STEPS) - 2)
        rest = (place - first)[..., None]
        mixed = (1.0 - rest) * _STEPS[first] + rest * _STEPS[first + 1]
        return np.where(known[..., None], np.rint(mixed).astype(np.uint8), GRAY)

    def linear_colors(self, tension: Array) -> Colors:
        """The same colors with the sRGB curve undone: viser's client applies it to the colors of line ends."""
        return linear(self.colors(tension))

    def ticks(self) -> tuple[float, ...]:
        """Round tensions within the scale: 1, 2 and 5 times powers of ten."""
        decades = range(int(log10(self.low)) - 1, int(log10(self.high)) + 2)
        found = tuple(step * 10.0**decade for decade in decades for step in (1, 2, 5))
        return tuple(tick for tick in found if self.low <= tick <= self.high)


_NONE = "–"
KILO_FROM = 1e5  # N: forces from here on are written in kilonewtons


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
    def up_to(cls, highest: float) -> ForceUnit:
        """The unit for forces up to a highest one [N]."""
        return cls("N", 1.0, ".1f") if highest < KILO_FROM else cls("kN", 1e3, ".2f")

    def bare(self, force: float) -> str:
        """A force [N] without the unit."""
        return number_text(force / self.newtons, self.form)

    def written(self, force: float) -> str:
        """A force [N] with the unit."""
        return f"{self.bare(force)} {self.name}"


def number_text(value: float, form: str) -> str:
    """A number, or a dash for one that is not finite; what rounds to zero has no sign."""
    if not isfinite(value):
        return _NONE
    text = f"{value:{form}}"
    return text if float(text.replace(",", "")) != 0.0 else text.removeprefix("-")


def force_unit(robot: Robot) -> ForceUnit:
    """Unit of the forces of a robot, by its highest tension, the same at all poses."""
    return ForceUnit.up_to(TensionScale.of(robot).high)


def linear(colors: Colors) -> Colors:
    """Colors with the sRGB curve undone, as viser's client needs those of line ends."""
    share = colors / 255.0
    undone = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * undone).astype(np.uint8)
