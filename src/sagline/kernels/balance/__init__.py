"""Force balance of the platform: geometry, structure matrix, needed wrench."""
