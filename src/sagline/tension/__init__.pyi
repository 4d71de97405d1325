"""Public names of `sagline.tension`."""

from .margin import capacity_margin as capacity_margin
from .margin import limit_margin as limit_margin
from .margin import unresisted_motion as unresisted_motion
from .method import TensionMethod as TensionMethod
from .methods import AnalyticCenter as AnalyticCenter
from .methods import Centroid as Centroid
from .methods import ClosedForm as ClosedForm
from .methods import Closest as Closest
from .methods import ImprovedClosedForm as ImprovedClosedForm
from .methods import LowestMaximum as LowestMaximum
from .methods import LowestSum as LowestSum
from .methods import MinimumNorm as MinimumNorm
from .methods import PNorm as PNorm
from .methods import PolygonWalk as PolygonWalk
from .methods import Puncture as Puncture
from .methods import QuadraticProgram as QuadraticProgram
from .polygon import Side as Side
from .polygon import TensionPolygon as TensionPolygon
