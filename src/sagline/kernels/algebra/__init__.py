"""Small dense algebra: no word of cables in it."""
