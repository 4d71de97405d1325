"""Cables with elongation and sag: material, five cable models and cable states."""
