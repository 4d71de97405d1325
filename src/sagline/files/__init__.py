"""Files that people and other programs read and write."""
