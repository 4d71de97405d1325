"""Design optimization: design variables, goals, optimizers and results."""
