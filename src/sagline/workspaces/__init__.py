"""Workspaces: wrench sets, margins, criteria, boundaries, and proofs for boxes of poses."""
