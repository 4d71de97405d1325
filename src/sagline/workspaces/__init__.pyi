"""Public names of `sagline.workspaces`."""

from .criteria import Clearance as Clearance
from .criteria import InFrame as InFrame
from .criteria import LeastFrequency as LeastFrequency
from .criteria import LeastMargin as LeastMargin
from .criteria import LeastStiffness as LeastStiffness
from .criteria import MaximumSag as MaximumSag
from .criteria import PositionError as PositionError
from .criterion import Criterion as Criterion
from .margin import Margin as Margin
from .margin import MarginStatus as MarginStatus
from .margin import margin as margin
from .proof import Proof as Proof
from .proof import ProofVerdict as ProofVerdict
from .proof import prove as prove
from .region import Orientations as Orientations
from .region import Tilts as Tilts
from .surface import Components as Components
from .surface import Surface as Surface
from .workspace import Workspace as Workspace
from .workspace import workspace as workspace
from .wrench_sets import Accelerations as Accelerations
from .wrench_sets import WrenchBox as WrenchBox
from .wrench_sets import WrenchEllipsoid as WrenchEllipsoid
from .wrench_sets import WrenchPolytope as WrenchPolytope
from .wrench_sets import WrenchSet as WrenchSet
