"""Viewer: a robot in the browser, whose sagging cables follow the platform while it is dragged."""
