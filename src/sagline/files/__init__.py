"""Files for users and other programs."""
