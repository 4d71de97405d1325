"""Balance of the platform: structure matrix, the wrench it needs, and the inertial wrench of a motion."""
