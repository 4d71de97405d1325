"""What servers change for the whole process, and take back."""

import logging
import warnings

from sagline.viewer.server import LOUD, started, stop


def test_after_the_last_server_logging_and_warnings_are_as_before() -> None:
    def state() -> tuple[object, ...]:
        return (*warnings.filters, *(logging.getLogger(name).level for name in LOUD))

    before = state()
    first, second = started(port=0), started(port=0)
    assert state() != before
    stop(first)
    assert state() != before  # the second is still running
    stop(second)
    assert state() == before
