"""How the article's two constants depend on the tensions that are sampled, and which tensions give its values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from sagline.article.intercept import intercept_studies
from sagline.article.sag_constant import sag_study
from sagline.article.sampling import GRAVITY, Sampling, article_sampling
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError

PUBLISHED_K_H = 4.845  # m/s^2, in magnitude: Gia Luan & Truong Thinh 2020, section 4.2.2
PUBLISHED_K_P = 4.385  # m^2/s^4: section 5.2.4
SHALLOW_K_H = GRAVITY / 2.0
SHALLOW_K_P = GRAVITY**2 / 24.0
LOWEST, HIGHEST = (20.0, 400.0), (500.0, 200_000.0)  # N: where the range of the article is looked for


class Constants(NamedTuple):
    """What the regressions give for one range of tensions.

    Attributes:
        lowest: Lowest sampled T_x [N].
        highest: Highest sampled T_x [N].
        k_h_platform: k_h at the platform end [m/s^2].
        k_h_frame: k_h at the frame end [m/s^2], negative.
        k_p: [m^2/s^4].
    """

    lowest: float
    highest: float
    k_h_platform: float
    k_h_frame: float
    k_p: float


@dataclass(frozen=True, slots=True, eq=False)
class ConstantsStudy:
    """The constants over the range of tensions.

    Attributes:
        sampling: The cables; only their tensions change.
        over_lowest: From each lowest tension to the same highest one.
        over_highest: From the same lowest tension to each highest one.
        scaled: Both ends of the article's range multiplied by 1, 2, 4, ...: the limit of taut cables.
        published: The range in which the frame end gives the published |k_h|, and k_p comes out as published.
    """

    sampling: Sampling
    over_lowest: tuple[Constants, ...]
    over_highest: tuple[Constants, ...]
    scaled: tuple[Constants, ...]
    published: Constants


def constants(sampling: Sampling) -> Constants:
    """Both constants by the article's regressions.

    Args:
        sampling: The cables.

    Returns:
        The constants, and between which tensions.
    """
    platform, frame = intercept_studies(sampling)
    tensions = sampling.tensions
    return Constants(float(tensions.min()), float(tensions.max()), platform.k_h, frame.k_h, sag_study(sampling).k_p)


def constants_study(sampling: Sampling, lowest: Array, highest: Array, factors: Array) -> ConstantsStudy:
    """The constants for many ranges of tensions, and the range of the published ones.

    Args:
        sampling: The cables; only their tensions are changed.
        lowest: Lower ends of the range [N], shape (k,).
        highest: Upper ends of the range [N], shape (l,).
        factors: By which the published range is scaled, shape (f,).

    Returns:
        The study.
    """
    found = published_range(sampling)
    return ConstantsStudy(
        sampling=sampling,
        over_lowest=tuple(constants(sampling.between(low, found.highest)) for low in lowest),
        over_highest=tuple(constants(sampling.between(found.lowest, high)) for high in highest),
        scaled=tuple(constants(sampling.between(f * found.lowest, f * found.highest)) for f in factors),
        published=found,
    )


@cache
def published_sampling() -> Sampling:
    """The article's sampling as we choose it, with the tensions that give its constants.

    Returns:
        The sampling; found once, then kept.
    """
    sampling = article_sampling()
    found = published_range(sampling)
    return sampling.between(found.lowest, found.highest)


def published_range(sampling: Sampling) -> Constants:
    """The range of tensions that gives both published constants: k_h = -4.845 at the frame end and k_p = 4.385.

    Two ends of the range for two constants: k_p falls with the lower end, |k_h| rises with the upper one.

    Args:
        sampling: The cables; only their tensions are changed.

    Returns:
        The constants, and between which tensions.

    Raises:
        InvalidValueError: If there is none for these cables between LOWEST and HIGHEST.
    """
    from scipy.optimize import brentq

    def best_lowest(highest: float) -> float:
        def excess(lowest: float) -> float:
            return sag_study(sampling.between(lowest, highest)).k_p - PUBLISHED_K_P

        return float(brentq(excess, *LOWEST, xtol=1e-6))

    def missing(log_highest: float) -> float:
        highest = float(np.exp(log_highest))
        _, frame = intercept_studies(sampling.between(best_lowest(highest), highest))
        return frame.k_h + PUBLISHED_K_H

    try:
        highest = float(np.exp(brentq(missing, *np.log(HIGHEST), xtol=1e-8)))
    except ValueError:  # no change of sign between the ends of the search
        raise InvalidValueError(
            "the sampled cables",
            "such that no range of tensions gives the published constants",
            f"lowest tensions in {LOWEST} N, highest in {HIGHEST} N",
            "Sample chords and densities as the article did.",
        ) from None
    return constants(sampling.between(best_lowest(highest), highest))
