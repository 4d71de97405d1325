"""Features of the viewer, one a file."""
