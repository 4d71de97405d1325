"""The article's studies, computed again: one module per study, with pure functions of numbers."""
