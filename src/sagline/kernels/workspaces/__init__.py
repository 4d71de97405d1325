"""Margins for sets of loads, and proofs for boxes of poses."""
