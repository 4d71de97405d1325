"""Plausible mistakes, one file a folder of the source, and which tests catch them: `make mutants`."""
