"""Entries that the modules above the kernels call."""

from .cable.batch import batch_from_length as batch_from_length
from .cable.batch import batch_from_tension as batch_from_tension
from .cable.batch import closures as closures
from .cable.batch import creep_strains as creep_strains
from .cable.batch import largest_sags as largest_sags
from .cable.batch import shape_points as shape_points
from .cable.swivel import exits_of_forces as exits_of_forces
from .forward.forward import fit_poses as fit_poses
from .forward.forward import forward_poses as forward_poses
from .forward.sensitivity import stabilities_of_poses as stabilities_of_poses
from .inverse.feasibility import decide_poses as decide_poses
from .inverse.poses import inverse_poses as inverse_poses
from .inverse.slanted import inverse_poses_of_slanted as inverse_poses_of_slanted
from .inverse.underconstrained import underconstrained_poses as underconstrained_poses
from .statics import structure_matrices as structure_matrices
