"""Cable-driven parallel robots whose cables sag."""
