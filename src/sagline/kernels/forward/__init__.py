"""Forward kinematics: poses from lengths."""
