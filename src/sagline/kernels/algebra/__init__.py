"""Small dense algebra, independent of cables."""
