"""How robots, plans and results look in Jupyter: the verdict in words, and a small figure."""
