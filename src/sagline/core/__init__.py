"""Arrays, arguments, errors, numbers and results: the base that every other folder uses."""
