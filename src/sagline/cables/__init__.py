"""Cables that stretch and sag: their material, five models of them, and the states they hang in."""
