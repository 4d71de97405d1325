"""A robot or a run as one HTML page that needs no server, no network and no installation."""
