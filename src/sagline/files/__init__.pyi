"""Public names of `sagline.files`."""

from .c_source import export_c as export_c
from .c_source import export_scl as export_scl
from .calibration_file import load_calibration as load_calibration
from .caspr import load_caspr as load_caspr
from .execution_file import load_execution as load_execution
from .gcode_file import ProgramPart as ProgramPart
from .gcode_file import gcode_parts as gcode_parts
from .gcode_file import load_gcode as load_gcode
from .log_file import load_log as load_log
from .mesh_file import load_mesh as load_mesh
from .mjcf import dump_mjcf as dump_mjcf
from .path_file import load_path as load_path
from .plan_file import load_plan as load_plan
from .plan_file import save_plan as save_plan
from .robot_file import dump_robot as dump_robot
from .robot_file import load_robot as load_robot
from .robot_file import load_scene as load_scene
from .robot_xml import Imported as Imported
from .simulation_file import load_simulation as load_simulation
from .table import load_measurements as load_measurements
from .wirex import load_wirex as load_wirex
from .workspace_file import load_workspace as load_workspace
