"""Presentation of results: a summary of each type, and HTML pages of findings."""
