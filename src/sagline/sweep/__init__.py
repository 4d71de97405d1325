"""Robots by poses by loads on as many processes as there are, kept on disk from the first minute."""
