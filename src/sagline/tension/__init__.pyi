"""Public names of `sagline.tension`."""

from .margin import capacity_margin as capacity_margin
from .margin import limit_margin as limit_margin
from .margin import unresisted_motion as unresisted_motion
from .method import TensionMethod as TensionMethod
from .polygon import Side as Side
from .polygon import TensionPolygon as TensionPolygon

# The only list of the tension distribution methods, in the order of the command line and of the viewer.
# isort: off
from .methods import Closest as Closest
from .methods import MinimumNorm as MinimumNorm
from .methods import QuadraticProgram as QuadraticProgram
from .methods import LowestSum as LowestSum
from .methods import LowestMaximum as LowestMaximum
from .methods import PNorm as PNorm
from .methods import Centroid as Centroid
from .methods import AnalyticCenter as AnalyticCenter
from .methods import ClosedForm as ClosedForm
from .methods import ImprovedClosedForm as ImprovedClosedForm
from .methods import Puncture as Puncture
from .methods import PolygonWalk as PolygonWalk
# isort: on
