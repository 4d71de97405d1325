"""sagline: cable-driven parallel robots whose cables sag. This page is the whole public surface."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sagline import control, plc, plot, sweep, twin
    from sagline.article.identify import EmpiricalFit, identify_empirical
    from sagline.article.identify_cable import CableFit, identify_cable
    from sagline.cables.cable import Cable
    from sagline.cables.catenary import Catenary
    from sagline.cables.creep import Creep
    from sagline.cables.elastic import Elastic
    from sagline.cables.empirical import Empirical
    from sagline.cables.model import CableModel, CableState
    from sagline.cables.parabolic import Parabolic
    from sagline.cables.status import CableStatus
    from sagline.cables.straight import Straight
    from sagline.calibration.calibrate import calibrate
    from sagline.calibration.chosen_poses import CalibrationPoses
    from sagline.calibration.log import WinchLog
    from sagline.calibration.pose_error import PoseError
    from sagline.calibration.poses import calibration_poses
    from sagline.calibration.result import Calibration
    from sagline.calibration.sensors import Sensors
    from sagline.calibration.status import CalibrationStatus, Omission
    from sagline.calibration.unknowns import Unknown
    from sagline.dynamics.cable_dynamics import dynamic_stiffness
    from sagline.dynamics.damping import Damping
    from sagline.dynamics.drives import SecondOrder
    from sagline.dynamics.events import Brake, Break, Drop, PickUp, Stall
    from sagline.dynamics.fastest import fastest
    from sagline.dynamics.frequency_map import FrequencyMap, frequency_map
    from sagline.dynamics.frequency_slopes import FrequencySlopes, frequency_slopes
    from sagline.dynamics.linearized import Linearized, linearized
    from sagline.dynamics.response import FrequencyResponse, frequency_response
    from sagline.dynamics.shaped import shaped
    from sagline.dynamics.shapers import EI, ZV, ZVD, Shaper
    from sagline.dynamics.simulate import simulate
    from sagline.dynamics.simulation import EnergyBalance, Occurrence, Simulation
    from sagline.dynamics.simulator import Reading, Simulator
    from sagline.dynamics.to_shape import to_shape
    from sagline.dynamics.vibrating import vibration
    from sagline.dynamics.vibration import Vibration
    from sagline.dynamics.vibration_status import VibrationStatus
    from sagline.errors import CableGeometryError, FileError, InvalidValueError, SaglineError, SaglineWarning
    from sagline.files.c_source import export_c
    from sagline.files.calibration_file import load_calibration
    from sagline.files.caspr import load_caspr
    from sagline.files.execution_file import load_execution
    from sagline.files.imported import Imported
    from sagline.files.log_file import load_log
    from sagline.files.measurements import load_measurements
    from sagline.files.mesh_file import load_mesh
    from sagline.files.mjcf import dump_mjcf
    from sagline.files.path_file import load_path
    from sagline.files.plan_file import load_plan, save_plan
    from sagline.files.plc_source import export_scl
    from sagline.files.robot_file import dump_robot, load_robot
    from sagline.files.scene_file import load_scene
    from sagline.files.simulation_file import load_simulation
    from sagline.files.wirex import load_wirex
    from sagline.files.workspace_file import load_workspace
    from sagline.interference.clearance import Clearances, clearance
    from sagline.interference.frame import frame_beams
    from sagline.interference.mesh import Mesh
    from sagline.interference.obstacles import Box, Capsule, Sphere
    from sagline.kinematics.confirm import Confirmation, confirm
    from sagline.kinematics.encoder import encoder_counts, lengths_from_counts
    from sagline.kinematics.equilibria import Equilibria, equilibria
    from sagline.kinematics.forward import forward
    from sagline.kinematics.forward_solution import ForwardSolution
    from sagline.kinematics.forward_solver import ForwardSolver, ForwardStep
    from sagline.kinematics.forward_status import ForwardStatus
    from sagline.kinematics.home import home
    from sagline.kinematics.inverse import inverse
    from sagline.kinematics.inverse_solver import InverseSolver, InverseStep
    from sagline.kinematics.measured import MeasuredTension
    from sagline.kinematics.plan import Gap, Plan
    from sagline.kinematics.polygon import tension_polygon
    from sagline.kinematics.status import PoseStatus
    from sagline.kinematics.winch_rates import WinchRates, winch_rates
    from sagline.motion.path import Path
    from sagline.motion.planar import article_path
    from sagline.motion.rest_to_rest import quintic_path, septic_path
    from sagline.motion.sampled import path_from_samples
    from sagline.optimization.design import design
    from sagline.optimization.file import load_design
    from sagline.optimization.free_anchors import FreeAnchors
    from sagline.optimization.free_cable import CableChoice, FreeCable
    from sagline.optimization.free_limit import FreeLimit
    from sagline.optimization.front import Front
    from sagline.optimization.goals import Goal
    from sagline.optimization.moving import MovingAnchors, moving_anchors
    from sagline.optimization.robust import AnchorErrors
    from sagline.robot.catalogue import robot_names
    from sagline.robot.equilibrium import Equilibrium
    from sagline.robot.pose import Pose
    from sagline.robot.pose_box import PoseBox
    from sagline.robot.robot import Robot
    from sagline.robot.winch import Winch
    from sagline.robot.winch_drives import WinchDrive, winch_drive, winch_drive_names
    from sagline.statics.balance import ArticleBalance, article_balance, structure_matrix
    from sagline.statics.stiffness import Modes, Stiffness, modes, stiffness
    from sagline.statics.wrench import inertial_wrench
    from sagline.sweep.file import load_sweep
    from sagline.tension.analytic_center import AnalyticCenter
    from sagline.tension.broken import without_cables
    from sagline.tension.centroid import Centroid
    from sagline.tension.closed_form import ClosedForm
    from sagline.tension.closest import Closest
    from sagline.tension.improved_closed_form import ImprovedClosedForm
    from sagline.tension.lowest_maximum import LowestMaximum
    from sagline.tension.lowest_sum import LowestSum
    from sagline.tension.margin import capacity_margin, limit_margin
    from sagline.tension.method import TensionMethod
    from sagline.tension.minimum_norm import MinimumNorm
    from sagline.tension.p_norm import PNorm
    from sagline.tension.polygon import Side, TensionPolygon
    from sagline.tension.polygon_walk import PolygonWalk
    from sagline.tension.puncture import Puncture
    from sagline.tension.quadratic_program import QuadraticProgram
    from sagline.tension.singular import unresisted_motion
    from sagline.workspaces.components import Components
    from sagline.workspaces.criteria.clearance import Clearance
    from sagline.workspaces.criteria.criterion import Criterion
    from sagline.workspaces.criteria.frame import InFrame
    from sagline.workspaces.criteria.frequency import LeastFrequency
    from sagline.workspaces.criteria.margin import LeastMargin
    from sagline.workspaces.criteria.position_error import PositionError
    from sagline.workspaces.criteria.sag import MaximumSag
    from sagline.workspaces.criteria.stiffness import LeastStiffness
    from sagline.workspaces.margin import Margin, margin
    from sagline.workspaces.margin_status import MarginStatus
    from sagline.workspaces.orientations import Orientations, Tilts
    from sagline.workspaces.proof import Proof, prove
    from sagline.workspaces.proof_verdict import ProofVerdict
    from sagline.workspaces.space import Workspace
    from sagline.workspaces.surface import Surface
    from sagline.workspaces.workspace import workspace
    from sagline.workspaces.wrench_sets import Accelerations, WrenchBox, WrenchEllipsoid, WrenchPolytope, WrenchSet

__version__: str

__all__ = [
    "EI",
    "ZV",
    "ZVD",
    "Accelerations",
    "AnalyticCenter",
    "AnchorErrors",
    "ArticleBalance",
    "Box",
    "Brake",
    "Break",
    "Cable",
    "CableChoice",
    "CableFit",
    "CableGeometryError",
    "CableModel",
    "CableState",
    "CableStatus",
    "Calibration",
    "CalibrationPoses",
    "CalibrationStatus",
    "Capsule",
    "Catenary",
    "Centroid",
    "Clearance",
    "Clearances",
    "ClosedForm",
    "Closest",
    "Components",
    "Confirmation",
    "Creep",
    "Criterion",
    "Damping",
    "Drop",
    "Elastic",
    "Empirical",
    "EmpiricalFit",
    "EnergyBalance",
    "Equilibria",
    "Equilibrium",
    "FileError",
    "ForwardSolution",
    "ForwardSolver",
    "ForwardStatus",
    "ForwardStep",
    "FreeAnchors",
    "FreeCable",
    "FreeLimit",
    "FrequencyMap",
    "FrequencyResponse",
    "FrequencySlopes",
    "Front",
    "Gap",
    "Goal",
    "Imported",
    "ImprovedClosedForm",
    "InFrame",
    "InvalidValueError",
    "InverseSolver",
    "InverseStep",
    "LeastFrequency",
    "LeastMargin",
    "LeastStiffness",
    "Linearized",
    "LowestMaximum",
    "LowestSum",
    "Margin",
    "MarginStatus",
    "MaximumSag",
    "MeasuredTension",
    "Mesh",
    "MinimumNorm",
    "Modes",
    "MovingAnchors",
    "Occurrence",
    "Omission",
    "Orientations",
    "PNorm",
    "Parabolic",
    "Path",
    "PickUp",
    "Plan",
    "PolygonWalk",
    "Pose",
    "PoseBox",
    "PoseError",
    "PoseStatus",
    "PositionError",
    "Proof",
    "ProofVerdict",
    "Puncture",
    "QuadraticProgram",
    "Reading",
    "Robot",
    "SaglineError",
    "SaglineWarning",
    "SecondOrder",
    "Sensors",
    "Shaper",
    "Side",
    "Simulation",
    "Simulator",
    "Sphere",
    "Stall",
    "Stiffness",
    "Straight",
    "Surface",
    "TensionMethod",
    "TensionPolygon",
    "Tilts",
    "Unknown",
    "Vibration",
    "VibrationStatus",
    "Winch",
    "WinchDrive",
    "WinchLog",
    "WinchRates",
    "Workspace",
    "WrenchBox",
    "WrenchEllipsoid",
    "WrenchPolytope",
    "WrenchSet",
    "__version__",
    "article_balance",
    "article_path",
    "calibrate",
    "calibration_poses",
    "capacity_margin",
    "clearance",
    "confirm",
    "control",
    "design",
    "dump_mjcf",
    "dump_robot",
    "dynamic_stiffness",
    "encoder_counts",
    "equilibria",
    "export_c",
    "export_scl",
    "fastest",
    "forward",
    "frame_beams",
    "frequency_map",
    "frequency_response",
    "frequency_slopes",
    "home",
    "identify_cable",
    "identify_empirical",
    "inertial_wrench",
    "inverse",
    "lengths_from_counts",
    "limit_margin",
    "linearized",
    "load_calibration",
    "load_caspr",
    "load_design",
    "load_execution",
    "load_log",
    "load_measurements",
    "load_mesh",
    "load_path",
    "load_plan",
    "load_robot",
    "load_scene",
    "load_simulation",
    "load_sweep",
    "load_wirex",
    "load_workspace",
    "margin",
    "modes",
    "moving_anchors",
    "path_from_samples",
    "plc",
    "plot",
    "prove",
    "quintic_path",
    "robot_names",
    "save_plan",
    "septic_path",
    "shaped",
    "simulate",
    "stiffness",
    "structure_matrix",
    "sweep",
    "tension_polygon",
    "to_shape",
    "twin",
    "unresisted_motion",
    "vibration",
    "winch_drive",
    "winch_drive_names",
    "winch_rates",
    "without_cables",
    "workspace",
]

# Everything loads on first use: the command hears Ctrl-C before it loads anything, and only what it needs.
_HOMES = {
    "Accelerations": "sagline.workspaces.wrench_sets",
    "AnalyticCenter": "sagline.tension.analytic_center",
    "AnchorErrors": "sagline.optimization.robust",
    "ArticleBalance": "sagline.statics.balance",
    "Box": "sagline.interference.obstacles",
    "Brake": "sagline.dynamics.events",
    "Break": "sagline.dynamics.events",
    "Cable": "sagline.cables.cable",
    "CableChoice": "sagline.optimization.free_cable",
    "CableFit": "sagline.article.identify_cable",
    "CableGeometryError": "sagline.errors",
    "CableModel": "sagline.cables.model",
    "CableState": "sagline.cables.model",
    "CableStatus": "sagline.cables.status",
    "Calibration": "sagline.calibration.result",
    "CalibrationPoses": "sagline.calibration.chosen_poses",
    "CalibrationStatus": "sagline.calibration.status",
    "Capsule": "sagline.interference.obstacles",
    "Catenary": "sagline.cables.catenary",
    "Centroid": "sagline.tension.centroid",
    "Clearance": "sagline.workspaces.criteria.clearance",
    "Clearances": "sagline.interference.clearance",
    "ClosedForm": "sagline.tension.closed_form",
    "Closest": "sagline.tension.closest",
    "Components": "sagline.workspaces.components",
    "Confirmation": "sagline.kinematics.confirm",
    "Creep": "sagline.cables.creep",
    "Criterion": "sagline.workspaces.criteria.criterion",
    "Damping": "sagline.dynamics.damping",
    "Drop": "sagline.dynamics.events",
    "EI": "sagline.dynamics.shapers",
    "Elastic": "sagline.cables.elastic",
    "Empirical": "sagline.cables.empirical",
    "EmpiricalFit": "sagline.article.identify",
    "EnergyBalance": "sagline.dynamics.simulation",
    "Equilibria": "sagline.kinematics.equilibria",
    "Equilibrium": "sagline.robot.equilibrium",
    "FileError": "sagline.errors",
    "ForwardSolution": "sagline.kinematics.forward_solution",
    "ForwardSolver": "sagline.kinematics.forward_solver",
    "ForwardStatus": "sagline.kinematics.forward_status",
    "ForwardStep": "sagline.kinematics.forward_solver",
    "FreeAnchors": "sagline.optimization.free_anchors",
    "FreeCable": "sagline.optimization.free_cable",
    "FreeLimit": "sagline.optimization.free_limit",
    "FrequencyMap": "sagline.dynamics.frequency_map",
    "FrequencyResponse": "sagline.dynamics.response",
    "FrequencySlopes": "sagline.dynamics.frequency_slopes",
    "Front": "sagline.optimization.front",
    "Gap": "sagline.kinematics.plan",
    "Goal": "sagline.optimization.goals",
    "Imported": "sagline.files.imported",
    "ImprovedClosedForm": "sagline.tension.improved_closed_form",
    "InFrame": "sagline.workspaces.criteria.frame",
    "InvalidValueError": "sagline.errors",
    "InverseSolver": "sagline.kinematics.inverse_solver",
    "InverseStep": "sagline.kinematics.inverse_solver",
    "LeastFrequency": "sagline.workspaces.criteria.frequency",
    "LeastMargin": "sagline.workspaces.criteria.margin",
    "LeastStiffness": "sagline.workspaces.criteria.stiffness",
    "Linearized": "sagline.dynamics.linearized",
    "LowestMaximum": "sagline.tension.lowest_maximum",
    "LowestSum": "sagline.tension.lowest_sum",
    "Margin": "sagline.workspaces.margin",
    "MarginStatus": "sagline.workspaces.margin_status",
    "MaximumSag": "sagline.workspaces.criteria.sag",
    "MeasuredTension": "sagline.kinematics.measured",
    "Mesh": "sagline.interference.mesh",
    "MinimumNorm": "sagline.tension.minimum_norm",
    "Modes": "sagline.statics.stiffness",
    "MovingAnchors": "sagline.optimization.moving",
    "Occurrence": "sagline.dynamics.simulation",
    "Omission": "sagline.calibration.status",
    "Orientations": "sagline.workspaces.orientations",
    "PNorm": "sagline.tension.p_norm",
    "Parabolic": "sagline.cables.parabolic",
    "Path": "sagline.motion.path",
    "PickUp": "sagline.dynamics.events",
    "Plan": "sagline.kinematics.plan",
    "PolygonWalk": "sagline.tension.polygon_walk",
    "Pose": "sagline.robot.pose",
    "PoseBox": "sagline.robot.pose_box",
    "PoseError": "sagline.calibration.pose_error",
    "PoseStatus": "sagline.kinematics.status",
    "PositionError": "sagline.workspaces.criteria.position_error",
    "Proof": "sagline.workspaces.proof",
    "ProofVerdict": "sagline.workspaces.proof_verdict",
    "Puncture": "sagline.tension.puncture",
    "QuadraticProgram": "sagline.tension.quadratic_program",
    "Reading": "sagline.dynamics.simulator",
    "Robot": "sagline.robot.robot",
    "SaglineError": "sagline.errors",
    "SaglineWarning": "sagline.errors",
    "SecondOrder": "sagline.dynamics.drives",
    "Sensors": "sagline.calibration.sensors",
    "Shaper": "sagline.dynamics.shapers",
    "Side": "sagline.tension.polygon",
    "Simulation": "sagline.dynamics.simulation",
    "Simulator": "sagline.dynamics.simulator",
    "Sphere": "sagline.interference.obstacles",
    "Stall": "sagline.dynamics.events",
    "Stiffness": "sagline.statics.stiffness",
    "Straight": "sagline.cables.straight",
    "Surface": "sagline.workspaces.surface",
    "TensionMethod": "sagline.tension.method",
    "TensionPolygon": "sagline.tension.polygon",
    "Tilts": "sagline.workspaces.orientations",
    "Unknown": "sagline.calibration.unknowns",
    "Vibration": "sagline.dynamics.vibration",
    "VibrationStatus": "sagline.dynamics.vibration_status",
    "Winch": "sagline.robot.winch",
    "WinchDrive": "sagline.robot.winch_drives",
    "WinchLog": "sagline.calibration.log",
    "WinchRates": "sagline.kinematics.winch_rates",
    "Workspace": "sagline.workspaces.space",
    "WrenchBox": "sagline.workspaces.wrench_sets",
    "WrenchEllipsoid": "sagline.workspaces.wrench_sets",
    "WrenchPolytope": "sagline.workspaces.wrench_sets",
    "WrenchSet": "sagline.workspaces.wrench_sets",
    "ZV": "sagline.dynamics.shapers",
    "ZVD": "sagline.dynamics.shapers",
    "article_balance": "sagline.statics.balance",
    "article_path": "sagline.motion.planar",
    "calibrate": "sagline.calibration.calibrate",
    "calibration_poses": "sagline.calibration.poses",
    "capacity_margin": "sagline.tension.margin",
    "clearance": "sagline.interference.clearance",
    "confirm": "sagline.kinematics.confirm",
    "control": "sagline.control",
    "design": "sagline.optimization.design",
    "dump_mjcf": "sagline.files.mjcf",
    "dump_robot": "sagline.files.robot_file",
    "dynamic_stiffness": "sagline.dynamics.cable_dynamics",
    "encoder_counts": "sagline.kinematics.encoder",
    "equilibria": "sagline.kinematics.equilibria",
    "export_c": "sagline.files.c_source",
    "export_scl": "sagline.files.plc_source",
    "fastest": "sagline.dynamics.fastest",
    "forward": "sagline.kinematics.forward",
    "frame_beams": "sagline.interference.frame",
    "frequency_map": "sagline.dynamics.frequency_map",
    "frequency_response": "sagline.dynamics.response",
    "frequency_slopes": "sagline.dynamics.frequency_slopes",
    "home": "sagline.kinematics.home",
    "identify_cable": "sagline.article.identify_cable",
    "identify_empirical": "sagline.article.identify",
    "inertial_wrench": "sagline.statics.wrench",
    "inverse": "sagline.kinematics.inverse",
    "lengths_from_counts": "sagline.kinematics.encoder",
    "limit_margin": "sagline.tension.margin",
    "linearized": "sagline.dynamics.linearized",
    "load_calibration": "sagline.files.calibration_file",
    "load_caspr": "sagline.files.caspr",
    "load_design": "sagline.optimization.file",
    "load_execution": "sagline.files.execution_file",
    "load_log": "sagline.files.log_file",
    "load_measurements": "sagline.files.measurements",
    "load_mesh": "sagline.files.mesh_file",
    "load_path": "sagline.files.path_file",
    "load_plan": "sagline.files.plan_file",
    "load_robot": "sagline.files.robot_file",
    "load_scene": "sagline.files.scene_file",
    "load_simulation": "sagline.files.simulation_file",
    "load_sweep": "sagline.sweep.file",
    "load_wirex": "sagline.files.wirex",
    "load_workspace": "sagline.files.workspace_file",
    "margin": "sagline.workspaces.margin",
    "modes": "sagline.statics.stiffness",
    "moving_anchors": "sagline.optimization.moving",
    "path_from_samples": "sagline.motion.sampled",
    "plc": "sagline.plc",
    "plot": "sagline.plot",
    "prove": "sagline.workspaces.proof",
    "quintic_path": "sagline.motion.rest_to_rest",
    "robot_names": "sagline.robot.catalogue",
    "save_plan": "sagline.files.plan_file",
    "septic_path": "sagline.motion.rest_to_rest",
    "shaped": "sagline.dynamics.shaped",
    "simulate": "sagline.dynamics.simulate",
    "stiffness": "sagline.statics.stiffness",
    "structure_matrix": "sagline.statics.balance",
    "sweep": "sagline.sweep",
    "tension_polygon": "sagline.kinematics.polygon",
    "to_shape": "sagline.dynamics.to_shape",
    "twin": "sagline.twin",
    "unresisted_motion": "sagline.tension.singular",
    "vibration": "sagline.dynamics.vibrating",
    "winch_drive": "sagline.robot.winch_drives",
    "winch_drive_names": "sagline.robot.winch_drives",
    "winch_rates": "sagline.kinematics.winch_rates",
    "without_cables": "sagline.tension.broken",
    "workspace": "sagline.workspaces.workspace",
}


def __getattr__(name: str) -> Any:
    """Load a name the first time it is asked for, and keep it."""
    if name == "__version__":
        return import_module("importlib.metadata").version("sagline")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module(_HOMES[name])
    value = module if module.__name__ == f"{__name__}.{name}" else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
