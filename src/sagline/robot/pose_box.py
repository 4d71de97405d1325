"""A box of poses in which a robot can work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, checked, number
from sagline.core.errors import InvalidValueError


@dataclass(frozen=True, slots=True, eq=False)
class PoseBox:
    """Positions of the platform origin in a box, tilted about any axis by up to an angle.

    Attributes:
        low: Lowest position of the platform origin [m], shape (3,).
        high: Highest position of the platform origin [m], shape (3,), not below low.
        tilt: Largest angle of rotation [rad], 0 to pi.
    """

    low: Array
    high: Array
    tilt: float

    def __init__(self, low: ArrayLike, high: ArrayLike, tilt: float = 0.0) -> None:
        """Check the three.

        Args:
            low: Lowest position [m], shape (3,).
            high: Highest position [m], shape (3,).
            tilt: Largest angle of rotation [rad], 0 to pi.

        Raises:
            InvalidValueError: If a number is not finite, a corner has not three numbers, high is below low, or the tilt
                is more than half a turn.
        """
        low = checked(low, "test_box: low", "m", shape=(3,))
        high = checked(high, "test_box: high", "m", shape=(3,))
        for item, corner in (("test_box: low", low), ("test_box: high", high)):
            if corner.ndim != 1:
                raise InvalidValueError(item, f"of shape {corner.shape}", "shape (3,)", "Give one x, y, z.")
        if (low > high).any():
            axis = int(np.argmax(low > high))
            raise InvalidValueError(
                f"test_box: high[{axis}]", f"{high[axis]:g} m", f">= low, {low[axis]:g} m", "Exchange low and high."
            )
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)
        angle = number(tilt, "test_box: tilt", "rad", low=0.0)
        if angle > np.pi:
            value, step = f"{angle:.6g} rad", "Give it in radians: no rotation turns by more than half a turn."
            raise InvalidValueError("test_box: tilt", value, "0 to pi rad", step)
        object.__setattr__(self, "tilt", angle)

    def __reduce__(self) -> tuple[type[PoseBox], tuple[Array, Array, float]]:
        """Pickle through the constructor."""
        return PoseBox, (self.low, self.high, self.tilt)
