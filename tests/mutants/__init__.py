"""Deliberate mistakes, one file per folder of the source, with the tests that detect them: `make mutants`."""
