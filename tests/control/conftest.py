"""What every test of the controller leaves behind."""

import gc
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def _garbage_is_collected() -> Iterator[None]:
    """A test that leaves a platform on its way leaves no other without garbage collection."""
    yield
    gc.unfreeze()
    gc.enable()
