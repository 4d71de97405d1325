"""Public names: groups and the names of common tasks, which `dir` lists; names of `import *` are valid, too."""

from . import article as article
from . import cables as cables
from . import calibration as calibration
from . import control as control
from . import core as core
from . import dynamics as dynamics
from . import files as files
from . import fmu as fmu
from . import interference as interference
from . import kinematics as kinematics
from . import linuxcnc as linuxcnc
from . import motion as motion
from . import mujoco as mujoco
from . import optimization as optimization
from . import plc as plc
from . import plot as plot
from . import robot as robot
from . import statics as statics
from . import sweep as sweep
from . import tension as tension
from . import twin as twin
from . import workspaces as workspaces
from .article import *
from .cables import *
from .cables import Cable as Cable
from .cables import Catenary as Catenary
from .cables import Elastic as Elastic
from .cables import Empirical as Empirical
from .cables import Parabolic as Parabolic
from .cables import Straight as Straight
from .calibration import *
from .calibration import Calibration as Calibration
from .calibration import calibrate as calibrate
from .core import *
from .core import SaglineError as SaglineError
from .core.version import __version__ as __version__
from .dynamics import *
from .dynamics import Break as Break
from .dynamics import Simulation as Simulation
from .dynamics import simulate as simulate
from .dynamics import vibration as vibration
from .files import *
from .files import dump_robot as dump_robot
from .files import load_gcode as load_gcode
from .files import load_log as load_log
from .files import load_path as load_path
from .files import load_plan as load_plan
from .files import load_robot as load_robot
from .fmu import *
from .interference import *
from .kinematics import *
from .kinematics import Confirmation as Confirmation
from .kinematics import ForwardSolution as ForwardSolution
from .kinematics import Plan as Plan
from .kinematics import PoseStatus as PoseStatus
from .kinematics import confirm as confirm
from .kinematics import forward as forward
from .kinematics import inverse as inverse
from .linuxcnc import *
from .motion import *
from .motion import Path as Path
from .motion import quintic_path as quintic_path
from .optimization import *
from .optimization import design as design
from .robot import *
from .robot import Equilibrium as Equilibrium
from .robot import Pose as Pose
from .robot import PoseBox as PoseBox
from .robot import Robot as Robot
from .robot import Winch as Winch
from .robot import robot_names as robot_names
from .statics import *
from .statics import modes as modes
from .statics import stiffness as stiffness
from .sweep import load_sweep as load_sweep
from .tension import *
from .tension import Centroid as Centroid
from .tension import MinimumNorm as MinimumNorm
from .workspaces import *
from .workspaces import Workspace as Workspace
from .workspaces import WrenchBox as WrenchBox
from .workspaces import margin as margin
from .workspaces import workspace as workspace

__all__: list[str]
