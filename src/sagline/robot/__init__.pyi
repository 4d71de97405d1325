"""Public names of `sagline.robot`."""

from .catalogue import robot_names as robot_names
from .equilibrium import Equilibrium as Equilibrium
from .inertia import without_cables as without_cables
from .pose import Pose as Pose
from .pose import PoseBox as PoseBox
from .robot import Robot as Robot
from .winch import Winch as Winch
from .winch_drives import WinchDrive as WinchDrive
from .winch_drives import winch_drive as winch_drive
from .winch_drives import winch_drive_names as winch_drive_names
