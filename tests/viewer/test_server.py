"""Changes of servers to the whole process, and their end."""

import logging
import warnings

from sagline.viewer.server import LOUD, start_server, stop_server
from tests.viewer.client import await_that
from tests.viewer.test_linking import a_page, asking, view


def test_the_last_server_restores_logging_and_warnings() -> None:
    def state() -> tuple[object, ...]:
        return (*warnings.filters, *(logging.getLogger(name).level for name in LOUD))

    before = state()
    first, second = start_server(port=0), start_server(port=0)
    assert state() != before
    stop_server(first)
    assert state() != before  # the second is still running
    stop_server(second)
    assert state() == before


def test_no_warning_is_printed_for_a_vertical_platform() -> None:
    with a_page() as page, asking(page) as here:
        assert "refused" not in here.ask("pose", "0,0,2.6,20,90,0")
        await_that(lambda: abs(view(page).snapshot.pose.matrix[2, 0]) > 0.999)
        assert here.link().endswith("pose=0,0,2.6,20,90,0")
