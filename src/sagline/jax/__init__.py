"""Forward and inverse kinematics for JAX: functions for `jit`, `vmap` and `grad`, with exact derivatives.

The functions call the compiled kernels through the foreign function interface of XLA. The derivatives are those of the
implicit function theorem; docs/howto/jax.md. A pose without a solution has NaN in all results and derivatives.
"""

from sagline.jax.functions import forward as forward
from sagline.jax.functions import inverse as inverse
from sagline.kinematics.differentiable import Forward as Forward
from sagline.kinematics.differentiable import HasPose as HasPose
from sagline.kinematics.differentiable import Inverse as Inverse
