"""The prototype's home and ten stops, and what else the tests of control share."""

from __future__ import annotations

from functools import cache

import numpy as np

import sagline as sl
from sagline.article.table2 import table2
from sagline.article.ten_poses import HOME

PROTOTYPE = sl.load_robot("article-prototype")


@cache
def stops() -> sl.Plan:
    """The prototype at rest at home and at the ten poses of the article."""
    places = np.vstack((HOME, table2().desired))
    return sl.inverse(PROTOTYPE, sl.Pose(places, np.broadcast_to(np.eye(3), (len(places), 3, 3))))
