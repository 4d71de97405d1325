"""Public names of `sagline.twin`."""

from .injected import KINDS as KINDS
from .injected import Injected as Injected
from .injected import fault as fault
from .link import Report as Report
from .machine import Machine as Machine
from .server import SCAN as SCAN
from .server import Server as Server
