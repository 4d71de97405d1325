"""Tension distribution: the choice of one set of tensions that balances the platform."""
