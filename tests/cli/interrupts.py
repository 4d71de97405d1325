"""Processes that hear Ctrl-C, whoever runs the tests."""

import signal


def heard() -> None:
    """What a child does before it starts: a shell that runs the tests in the background tells it to ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
