"""Inverse kinematics (motion to tensions and lengths) and forward kinematics (lengths to poses)."""
