"""The planar path on which everything is compared with the article."""

from __future__ import annotations

from sagline.motion.path import Path
from sagline.motion.rest_to_rest import quintic_path

HEIGHT = 1.5  # m, as in the article
STOPS = ((0.0, 0.0), (5.0, 3.5), (-5.0, 3.5), (-5.0, -3.5), (5.0, -3.5), (5.0, 3.5), (0.0, 0.0))  # x, y [m]
DURATIONS = (9.0, 11.0, 10.0, 11.0, 10.0, 9.0)  # s


def article_path(rate: float = 100.0) -> Path:
    """The article's planar motion: at z = 1.5 m, without rotation, from rest to rest.

    The article gives the height and the zero angles, but no further numbers (its Figure 18); the rest is our choice.
    From the center to the corner (+5, +3.5) m, counter-clockwise around the rectangle of x = +-5 m, y = +-3.5 m, back
    to the center; 60 s in all, with a peak acceleration of 0.48 m/s^2 and a peak speed of 1.70 m/s.

    Args:
        rate: Samples per second [1/s], > 0; 100 gives 6,001 poses.

    Returns:
        Path of 60 s.

    Raises:
        InvalidValueError: If the rate is not positive.

    Source:
        Gia Luan & Truong Thinh, Appl. Sci. 2020, 10(15), 5318, section 7.
    """
    return quintic_path([(x, y, HEIGHT) for x, y in STOPS], durations=DURATIONS, rate=rate)
