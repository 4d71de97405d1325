"""Presentation of results: a summary for each type of result, and HTML pages of findings."""
