"""The prototype, its home position and the ten positions of Table 2 of the article, with a plan of all of them."""

from __future__ import annotations

from functools import cache

import numpy as np

import sagline as sl
from sagline.article.ten_poses import HOME, Table2

TEN_POSES = Table2().desired  # m, shape (10, 3)
PROTOTYPE = sl.load_robot("article-prototype")


__all__ = ["HOME", "PROTOTYPE", "TEN_POSES", "stops"]


@cache
def stops() -> sl.Plan:
    """The prototype at rest at home and at the ten poses of the article."""
    places = np.vstack((HOME, TEN_POSES))
    return sl.inverse(PROTOTYPE, sl.Pose(places, np.broadcast_to(np.eye(3), (len(places), 3, 3))))
