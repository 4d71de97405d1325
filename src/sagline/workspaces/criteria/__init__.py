"""What a pose has to meet to count as one where the robot can work, one criterion a file."""
