"""The article's studies, recomputed: one module per study, pure functions of numbers."""
