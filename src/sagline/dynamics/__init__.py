"""How the robot vibrates and moves: cables with mass, motion in time, paths that leave no vibration."""
