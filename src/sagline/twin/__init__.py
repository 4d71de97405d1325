"""The machine behind the link: the robot as it is, its drives, PLCs and network."""
