"""Cables that stretch and sag: their material, five models of them, and their states."""
