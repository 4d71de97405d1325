"""Forward and inverse kinematics for JAX: functions for `jit`, `vmap` and `grad`, with exact derivatives.

The functions call the compiled kernels through the foreign function interface of XLA. The derivatives are those of the
implicit function theorem; docs/howto/jax.md. A pose without a solution has NaN in all results and derivatives.
"""

from sagline.jax.functions import Forward as Forward
from sagline.jax.functions import HasPose as HasPose
from sagline.jax.functions import Inverse as Inverse
from sagline.jax.functions import forward as forward
from sagline.jax.functions import inverse as inverse
