"""The documentation as plain Markdown: `python -m tools.pages` runs what the pages of docs show, into build/pages."""
