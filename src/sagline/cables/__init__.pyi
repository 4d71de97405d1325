"""Public names of `sagline.cables`."""

from .cable import Cable as Cable
from .cable import Creep as Creep
from .model import CableModel as CableModel
from .model import CableState as CableState
from .model import CableStatus as CableStatus
from .solver import CableSolver as CableSolver

# The only list of the cable models, from the simplest to the exact one. Command line, viewer and files read it.
# isort: off
from .models import Straight as Straight
from .models import Elastic as Elastic
from .models import Empirical as Empirical
from .models import Parabolic as Parabolic
from .models import Catenary as Catenary
# isort: on
