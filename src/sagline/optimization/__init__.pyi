"""Public names of `sagline.optimization`."""

from .candidates import AnchorErrors as AnchorErrors
from .design import Front as Front
from .design import design as design
from .file import load_design as load_design
from .free import CableChoice as CableChoice
from .free import FreeCable as FreeCable
from .free import FreeLimit as FreeLimit
from .free_anchors import FreeAnchors as FreeAnchors
from .rating import MovingAnchors as MovingAnchors
from .rating import moving_anchors as moving_anchors
from .request import Goal as Goal
