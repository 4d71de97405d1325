"""The HTML report on the article: what it says beside what was computed."""
