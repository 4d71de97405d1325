"""Public names of `sagline.core`."""

from ..kernels.jit import backend as backend
from .errors import CableGeometryError as CableGeometryError
from .errors import FileError as FileError
from .errors import InvalidValueError as InvalidValueError
from .errors import SaglineError as SaglineError
from .errors import SaglineWarning as SaglineWarning
