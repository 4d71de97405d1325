"""Tension distribution: one of the tensions that balance the platform."""
