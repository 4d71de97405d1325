"""Public names of `sagline.statics`."""

from .balance import ArticleBalance as ArticleBalance
from .balance import article_balance as article_balance
from .balance import inertial_wrench as inertial_wrench
from .balance import structure_matrix as structure_matrix
from .stiffness import Modes as Modes
from .stiffness import Stiffness as Stiffness
from .stiffness import modes as modes
from .stiffness import stiffness as stiffness
