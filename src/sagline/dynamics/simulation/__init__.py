"""Motion of the robot in time."""
