"""Public names of `sagline.cables`."""

from .cable import Cable as Cable
from .cable import Creep as Creep
from .model import CableModel as CableModel
from .model import CableState as CableState
from .model import CableStatus as CableStatus
from .models import Catenary as Catenary
from .models import Elastic as Elastic
from .models import Empirical as Empirical
from .models import Parabolic as Parabolic
from .models import Straight as Straight
