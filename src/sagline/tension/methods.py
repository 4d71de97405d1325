"""All ways of sharing the load, by name."""

from __future__ import annotations

from sagline.tension.analytic_center import AnalyticCenter
from sagline.tension.centroid import Centroid
from sagline.tension.closed_form import ClosedForm
from sagline.tension.closest import Closest
from sagline.tension.improved_closed_form import ImprovedClosedForm
from sagline.tension.lowest_maximum import LowestMaximum
from sagline.tension.lowest_sum import LowestSum
from sagline.tension.method import TensionMethod
from sagline.tension.minimum_norm import MinimumNorm
from sagline.tension.p_norm import PNorm
from sagline.tension.polygon_walk import PolygonWalk
from sagline.tension.puncture import Puncture
from sagline.tension.quadratic_program import QuadraticProgram

METHODS: dict[str, type[TensionMethod]] = {
    method.__name__: method
    for method in (
        Closest,
        MinimumNorm,
        QuadraticProgram,
        LowestSum,
        LowestMaximum,
        PNorm,
        Centroid,
        AnalyticCenter,
        ClosedForm,
        ImprovedClosedForm,
        Puncture,
        PolygonWalk,
    )
}
