"""Public names of `sagline.kinematics`."""

from .bending import BendingCycles as BendingCycles
from .bending import bending_cycles as bending_cycles
from .confirm import Confirmation as Confirmation
from .confirm import confirm as confirm
from .equilibria import Equilibria as Equilibria
from .equilibria import equilibria as equilibria
from .forward import MeasuredTension as MeasuredTension
from .forward import forward as forward
from .forward_rows import ForwardSolution as ForwardSolution
from .forward_solver import ForwardSolver as ForwardSolver
from .forward_solver import ForwardStep as ForwardStep
from .frame_forces import FrameForces as FrameForces
from .home import home as home
from .inverse import inverse as inverse
from .inverse_solver import InverseSolver as InverseSolver
from .inverse_solver import InverseStep as InverseStep
from .plan import Gap as Gap
from .plan import Plan as Plan
from .polygon import tension_polygon as tension_polygon
from .status import ForwardStatus as ForwardStatus
from .status import PoseStatus as PoseStatus
from .uncertainty import Uncertainty as Uncertainty
from .winches import WinchRates as WinchRates
from .winches import encoder_counts as encoder_counts
from .winches import lengths_from_counts as lengths_from_counts
from .winches import winch_rates as winch_rates
