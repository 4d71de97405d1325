"""sagline: cable-driven parallel robots whose cables sag. This page is the whole public surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sagline.cables.cable import Cable
from sagline.cables.catenary import Catenary
from sagline.cables.elastic import Elastic
from sagline.cables.empirical import Empirical
from sagline.cables.model import CableModel
from sagline.cables.parabolic import Parabolic
from sagline.cables.state import CableState
from sagline.cables.status import CableStatus
from sagline.cables.straight import Straight
from sagline.errors import CableGeometryError, FileError, InvalidValueError, SaglineError
from sagline.kinematics.forward import forward
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.kinematics.forward_status import ForwardStatus
from sagline.kinematics.inverse import inverse
from sagline.kinematics.inverse_solver import InverseSolver, InverseStep
from sagline.kinematics.plan import Gap, Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.path import Path
from sagline.motion.planar import article_path
from sagline.motion.quintic import quintic_path
from sagline.motion.sampled import path_from_samples
from sagline.robot.catalogue import robot_names
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.balance import ArticleBalance, article_balance, structure_matrix
from sagline.statics.wrench import inertial_wrench
from sagline.tension.closest import Closest
from sagline.tension.method import TensionMethod
from sagline.tension.minimum_norm import MinimumNorm
