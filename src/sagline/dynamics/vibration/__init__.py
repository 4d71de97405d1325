"""Modes, dynamic stiffness and frequency response of robots whose cables have mass."""
