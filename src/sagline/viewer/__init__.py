"""Viewer: a robot in the browser whose sagging cables follow the dragged platform."""
