"""Integer codes for cable models, methods and results of kernels."""

from __future__ import annotations

# Cable models (docs/model.md, section 3).
STRAIGHT = 0
ELASTIC = 1
EMPIRICAL = 2
PARABOLIC = 3
CATENARY = 4

# Status of the calculation of one cable.
CABLE_SOLVED = 0
CABLE_SLACK = 1  # slack: the cable has no chord tension
CABLE_NO_TENSION = 2  # the straight model does not determine a tension from a length
CABLE_BELOW_VALIDITY = 3  # the empirical model's lowest point lies inside the span
CABLE_TOO_SLACK = 4  # too slack for the model: half the weight exceeds RANGE times the chord tension
CABLE_NOT_CONVERGED = 5

# Tension distribution methods.
MINIMUM_NORM = 0
CLOSEST = 1
QUADRATIC_PROGRAM = 2  # methods with the codes 0 to 2 find the feasible point nearest to a target
LOWEST_SUM = 3
LOWEST_MAXIMUM = 4
P_NORM = 5
CENTROID = 6
ANALYTIC_CENTER = 7
CLOSED_FORM = 8
IMPROVED_CLOSED_FORM = 9
PUNCTURE = 10
POLYGON_WALK = 11
METHOD_COUNT = 12  # number of codes of methods

# The optimum of the polygon walk: least sum, least norm, centroid.
WALK_SUM = 0.0
WALK_NORM = 1.0
WALK_CENTROID = 2.0

# The variable of the tension distribution.
CHORD_TENSION = 0
HORIZONTAL_TENSION = 1
FRAME_END_TENSION = 2

# The tension to which a robot's limits apply.
LIMITS_OF_CHORD = 0
LIMITS_OF_FRAME_END = 1

# Given values of an underconstrained platform; 0, 1 and 2 are the coordinates of its origin.
YAW = 3
LEVEL = 4

# Status of the calculation of one pose.
POSE_SOLVED = 0
POSE_INFEASIBLE = 1  # no tensions within the limits balance the wrench
POSE_SINGULAR = 2  # the structure matrix has lost rank
POSE_TOO_SLACK = 3  # a cable has no catenary between its ends
POSE_NOT_CONVERGED = 4
POSE_NO_CHORD = 5  # both ends of a cable coincide
POSE_NOT_COVERED = 6  # feasible, but the chosen tension distribution method found no tensions within the limits
POSE_UNBOUNDED = 7  # the feasible set is unbounded, but the tension distribution method requires a bounded set
POSE_BORDERLINE = 8  # too close to the border of the feasible set: neither tensions nor a proof were found
POSE_UNSTABLE = 9  # solved, but the equilibrium is not stable
UNPROVED_STABILITY = 10  # solved, and `stabilities_of_poses` decides whether it is stable
POSE_NO_EQUILIBRIUM = 11  # fewer cables than degrees of freedom: no equilibrium with the given values was found

# Status of the forward calculation of one sample.
FORWARD_SOLVED = 0
FORWARD_LOOSE = 1  # stable, with fewer taut cables than degrees of freedom
FORWARD_OVERSTRETCHED = 2  # unrealistic strain: the cables are too short to hold the platform
FORWARD_UNSTABLE = 3  # an equilibrium that is not a minimum of the energy
FORWARD_SINGULAR = 4  # an equilibrium with an unconstrained motion
FORWARD_NOT_CONVERGED = 5
FORWARD_NO_LENGTHS = 6  # all lengths are NaN, because the pose has no plan
FORWARD_FITTED = 7  # straight cables: least-squares pose

# Result of the bracket of a pose's margin.
MARGIN_FEASIBLE = 0
MARGIN_INFEASIBLE = 1
MARGIN_OPEN = 2
MARGIN_SINGULAR = 3  # the structure matrix has lost rank
MARGIN_NO_CHORD = 4
MARGIN_TOO_SLACK = 5  # the limit of the sag excludes all chord tensions of a cable
