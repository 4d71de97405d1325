"""Better robots: what may change, what is wanted, and who searches."""
