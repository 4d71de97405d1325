"""A robot, or a run of it, as one page that needs nothing else: no server, no network, nothing to install."""
