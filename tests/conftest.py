"""What kernels several workers need is compiled once, before they start, on two cores, and loaded by each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

from sagline.cli.cold_start import cold, compile_all
from sagline.cli.entries import ENTRIES


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_setupnodes(config: pytest.Config, specs: Any) -> None:
    """Compile before there are workers; what does not compile is for the tests to tell."""
    if waiting := cold(tuple(ENTRIES)):
        config.get_terminal_writer().line(f"compiling {', '.join(waiting)} ...")
    with suppress(Exception):
        compile_all(waiting, lambda stage: None)
        for entry in ENTRIES.values():  # loads it, or compiles it where what is on disk is of older times
            entry.compile()


@pytest.fixture(scope="session", autouse=True)
def no_entry_is_compiled_by_a_test(request: pytest.FixtureRequest) -> Iterator[None]:
    """No test of a worker finds an entry in a version that `ENTRIES` does not list, of which no command would tell.

    Mostly an argument is not read-only that is elsewhere, and every user would wait for what is the same twice.
    """
    yield
    if hasattr(request.config, "workerinput"):
        functions: list[Any] = [entry.function for entry in ENTRIES.values()]
        assert {each.__qualname__: list(each.stats.cache_misses) for each in functions if each.stats.cache_misses} == {}
