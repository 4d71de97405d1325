"""Trajectories along paths: shaped and time-optimal motion."""
