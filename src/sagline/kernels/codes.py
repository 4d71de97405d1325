"""Integer codes by which kernels name cable models and say how a calculation ended."""

from __future__ import annotations

# Cable models (docs/model.md, section 3).
STRAIGHT = 0
ELASTIC = 1
EMPIRICAL = 2
PARABOLIC = 3
CATENARY = 4

# How the calculation of one cable ended.
CABLE_SOLVED = 0
CABLE_SLACK = 1  # carries no chord tension
CABLE_NO_TENSION = 2  # the straight model knows no tension for a length
CABLE_BELOW_VALIDITY = 3  # the empirical model's lowest point lies inside the span
CABLE_TOO_SLACK = 4  # half its weight exceeds RANGE chord tensions: no practical answer
CABLE_NOT_CONVERGED = 5

# Ways of sharing the load among redundant cables.
MINIMUM_NORM = 0
CLOSEST = 1

# The variable in which the load is shared.
CHORD_TENSION = 0
HORIZONTAL_TENSION = 1

# The quantity that a robot's tension limits name.
LIMITS_OF_CHORD = 0
LIMITS_OF_FRAME_END = 1

# How the calculation of one pose ended.
POSE_SOLVED = 0
POSE_INFEASIBLE = 1  # no tensions within the limits balance the wrench
POSE_SINGULAR = 2  # the structure matrix has lost rank
POSE_TOO_SLACK = 3  # a cable's chord tension is too small for its weight
POSE_NOT_CONVERGED = 4
POSE_NO_CHORD = 5  # both ends of a cable coincide
