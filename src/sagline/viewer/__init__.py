"""The viewer: a robot in the browser, its cables hanging as they hang, following the platform that one drags."""
