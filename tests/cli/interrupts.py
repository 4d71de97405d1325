"""Processes that hear signals, whoever runs the tests."""

import signal


def heard() -> None:
    """What a child does before it starts: a shell that runs the tests in the background tells it to ignore Ctrl-C."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
