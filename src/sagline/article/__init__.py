"""The article's studies, redone from nothing: one study a module, pure functions from numbers to numbers."""
