"""Inverse kinematics: tensions and lengths from poses."""
