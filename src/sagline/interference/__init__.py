"""What comes too near to what: cables as they hang, the platform, and what stands around."""
