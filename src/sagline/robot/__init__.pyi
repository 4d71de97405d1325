"""Public names of `sagline.robot`."""

from .catalogue import WinchDrive as WinchDrive
from .catalogue import robot_names as robot_names
from .catalogue import winch_drive as winch_drive
from .catalogue import winch_drive_names as winch_drive_names
from .equilibrium import Equilibrium as Equilibrium
from .pose import Pose as Pose
from .pose import PoseBox as PoseBox
from .robot import Robot as Robot
from .robot import without_cables as without_cables
from .winch import Winch as Winch
