"""The controller of a cable robot: states, loops, faults, and the link to a machine."""
