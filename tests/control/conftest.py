"""State of the process after every test of the controller."""

import gc
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def _garbage_is_collected() -> Iterator[None]:
    """A test that ends during a motion does not leave garbage collection off for others."""
    yield
    gc.unfreeze()
    gc.enable()
