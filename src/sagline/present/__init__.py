"""Presentation of results: summaries for each type of result, and HTML pages of findings."""
