"""Public names of `sagline.interference`."""

from .clearance import Clearances as Clearances
from .clearance import clearance as clearance
from .obstacles import Box as Box
from .obstacles import Capsule as Capsule
from .obstacles import Mesh as Mesh
from .obstacles import Sphere as Sphere
from .obstacles import frame_beams as frame_beams
