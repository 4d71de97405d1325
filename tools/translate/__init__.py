"""Translator of the kernels, a typed subset of Python, to C99. docs/contributing/c-kernels.md has the rules."""
