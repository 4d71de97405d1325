"""Which of the tensions that balance the platform."""
