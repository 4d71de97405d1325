"""A robot or a run as one HTML page, without server, network and installation."""
