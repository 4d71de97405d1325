"""Inverse kinematics (from a motion to tensions and lengths) and forward kinematics (back again)."""
