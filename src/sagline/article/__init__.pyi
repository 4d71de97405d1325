"""Public names of `sagline.article`."""

from .identify import EmpiricalFit as EmpiricalFit
from .identify import identify_empirical as identify_empirical
from .identify_cable import CableFit as CableFit
from .identify_cable import identify_cable as identify_cable
