"""All cable models, by name."""

from __future__ import annotations

from sagline.cables.catenary import Catenary
from sagline.cables.elastic import Elastic
from sagline.cables.empirical import Empirical
from sagline.cables.model import CableModel
from sagline.cables.parabolic import Parabolic
from sagline.cables.straight import Straight

MODELS: dict[str, type[CableModel]] = {
    model.__name__: model  # coarse to exact
    for model in (
        Straight,
        Elastic,
        Empirical,
        Parabolic,
        Catenary,
    )
}
