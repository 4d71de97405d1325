"""From poses to tensions and lengths."""
