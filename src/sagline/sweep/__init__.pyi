"""Public names of `sagline.sweep`."""

from .file import load_sweep as load_sweep
from .request import QUANTITIES as QUANTITIES
from .request import Request as Request
from .result import Sweep as Sweep
from .result import load as load
from .running import run as run
from .work import Counts as Counts
