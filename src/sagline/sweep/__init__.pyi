"""Public names of `sagline.sweep`."""

from .request import QUANTITIES as QUANTITIES
from .request import Request as Request
from .request import load_sweep as load_sweep
from .result import Sweep as Sweep
from .result import load as load
from .running import run as run
from .work import Counts as Counts
