"""Single cables, and all cables of one pose, solved independently."""
