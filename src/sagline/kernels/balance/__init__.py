"""The platform on its cables: geometry, structure matrix, needed wrench."""
