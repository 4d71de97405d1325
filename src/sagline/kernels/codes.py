"""Integer codes for cable models, methods and results of kernels."""

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

# Tension distribution methods.
MINIMUM_NORM = 0
CLOSEST = 1
QUADRATIC_PROGRAM = 2  # up to here: the feasible point nearest to a target
LOWEST_SUM = 3
LOWEST_MAXIMUM = 4
P_NORM = 5
CENTROID = 6
ANALYTIC_CENTER = 7
CLOSED_FORM = 8
IMPROVED_CLOSED_FORM = 9
PUNCTURE = 10
POLYGON_WALK = 11

# The variable of the tension distribution.
CHORD_TENSION = 0
HORIZONTAL_TENSION = 1
FRAME_END_TENSION = 2

# The tension to which a robot's limits apply.
LIMITS_OF_CHORD = 0
LIMITS_OF_FRAME_END = 1

# How the calculation of one pose ended.
POSE_SOLVED = 0
POSE_INFEASIBLE = 1  # no tensions within the limits balance the wrench
POSE_SINGULAR = 2  # the structure matrix has lost rank
POSE_TOO_SLACK = 3  # a cable's chord tension is too small for its weight
POSE_NOT_CONVERGED = 4
POSE_NO_CHORD = 5  # both ends of a cable coincide
POSE_NOT_COVERED = 6  # feasible, but not by the chosen tension distribution method
POSE_UNBOUNDED = 7  # the feasible set has no end, and the chosen tension distribution method needs one
POSE_BORDERLINE = 8  # so near the border that neither tensions nor a proof were found

# How the forward calculation of one sample ended.
FORWARD_SOLVED = 0
FORWARD_LOOSE = 1  # stable, but fewer cables pull than the platform has freedoms
FORWARD_OVERSTRETCHED = 2  # a cable is stretched beyond all reason: the lengths are too short to meet
FORWARD_UNSTABLE = 3  # an equilibrium, but no minimum of the energy
FORWARD_SINGULAR = 4  # an equilibrium that some motion leaves without resistance
FORWARD_NOT_CONVERGED = 5
FORWARD_NO_LENGTHS = 6  # all lengths NaN: a pose without a plan
FORWARD_FITTED = 7  # straight cables: the pose whose lengths fit best

# Result of the bracket of a pose's margin.
MARGIN_FEASIBLE = 0
MARGIN_INFEASIBLE = 1
MARGIN_OPEN = 2
MARGIN_SINGULAR = 3  # the structure matrix has lost rank
MARGIN_NO_CHORD = 4
MARGIN_TOO_SLACK = 5  # a cable's largest chord tension is too small for its weight
