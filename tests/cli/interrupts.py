"""Child processes that react to signals in every environment of the tests."""

import signal


def heard() -> None:
    """Set the default action of Ctrl-C in a child: a shell ignores it in programs in the background."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
