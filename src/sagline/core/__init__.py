"""Arrays, arguments, errors, numbers and results: what every other folder builds on."""
