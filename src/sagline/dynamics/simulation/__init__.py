"""Simulation of the robot's motion in time."""
