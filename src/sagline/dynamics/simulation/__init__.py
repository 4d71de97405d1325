"""Simulation of the motion of a robot."""
