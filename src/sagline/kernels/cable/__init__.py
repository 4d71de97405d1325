"""One cable, and all cables of one pose each by itself."""
