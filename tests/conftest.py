"""Rules for all tests: the first tier stays fast.

See `tests.tiers` for the two tiers.
"""

from __future__ import annotations

import os
import random
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final, cast

import pytest
from hypothesis import settings, strategies
from numba.core import event
from typer.main import get_command

from tests.effort import slowness
from tests.tiers import FILE_LIMIT, TEST_LIMIT

# numba compiles the single kernels that the tests in these folders call; the others run the compiled library
INNER: Final = re.compile(r"(^|/)tests/(kernels|translate)(/|$)")
PATHS: Final = [each.partition("::")[0] for each in sys.argv[1:] if "tests/" in each and not each.startswith("-")]
if PATHS and all(map(INNER.search, PATHS)):
    os.environ.setdefault("SAGLINE_BACKEND", "numba")
ALL_EXTENDED: Final = re.compile(r"^pytestmark = (extended|\[extended\b)", re.MULTILINE)
EXAMPLES: Final = 40  # examples of a property in the first tier
ROOT: Final = Path(__file__).parents[1]
CPU: Final = "cpu"  # property of a report: processor time of the test [s], compilation excluded


def only_first_tier(config: pytest.Config) -> bool:
    """True if only tests of the first tier run."""
    return "not extended" in str(config.getoption("markexpr"))


def pytest_configure(config: pytest.Config) -> None:
    """Set the number of examples of hypothesis in the first tier (`make soak` has its own); create a missing module."""
    settings.register_profile("first tier", max_examples=EXAMPLES)
    if only_first_tier(config):
        settings.load_profile("first tier")
    if not hasattr(config, "workerinput"):
        from tools.translate import portable, wasm  # imports kernels after the choice of the back end above

        if not (ROOT / wasm.MODULE).is_file():
            wasm.build(ROOT)
        if portable.is_stale(ROOT):
            portable.build(ROOT)


@pytest.fixture(scope="session", autouse=True)
def libraries_are_loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Load large libraries before the first test, so that their import does not count for a test."""
    for name in ("pint", "scipy.optimize", "scipy.spatial", "skimage.measure", "trimesh"):
        import_module(name)
    import xarray
    from matplotlib.figure import Figure

    xarray.Dataset({"x": ("row", [1.0])}, {"row": [0.0]}).to_netcdf(
        tmp_path_factory.mktemp("load") / "x.nc", engine="h5netcdf"
    )
    strategies.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn")).validate()  # tables of unicode
    Figure().savefig(tmp_path_factory.mktemp("load") / "x.png")


@pytest.fixture(scope="session", autouse=True)
def command_built_once() -> Iterator[None]:
    """Keep the command that `CliRunner` would build for every command line, which takes 40 ms."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("typer.testing._get_command", cache(get_command))
        yield


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not import a file whose tests all belong to the second tier when only the first runs."""
    if only_first_tier(config) and collection_path.name.startswith("test_") and collection_path.suffix == ".py":
        return True if ALL_EXTENDED.search(collection_path.read_text(encoding="utf-8")) else None
    return None


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add options for the order and the limits of time."""
    parser.addoption("--no-limits", action="store_true", help="do not limit the processor time of the first tier")
    parser.addoption(
        "--random-order", type=int, metavar="SEED", help="shuffle all tests; the same seed, the same order"
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Update snapshots only with the tests that compare them; shuffle the tests on request."""
    if config.getoption("update_snapshots", default=False):
        items[:] = [item for item in items if "snapshot" in getattr(item, "fixturenames", ())]
    if (seed := config.getoption("--random-order")) is not None:
        random.Random(seed).shuffle(items)


class _Compilation(event.Listener):
    """Number of kernels compiled so far in this process."""

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    def on_start(self, event: Any) -> None:
        self.count += 1

    def on_end(self, event: Any) -> None:
        """Count the start of a compilation only."""


_compilation: Final = _Compilation()
cast("Any", event).register("numba:compile", _compilation)


def processor_time() -> float:
    """Processor time of this process and its finished children [s]."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Measure a test of the first tier; the test fails if it takes too long with compiled kernels."""
    if not only_first_tier(item.config):
        return (yield)
    start, before = processor_time(), _compilation.count
    result = yield
    used = processor_time() - start
    if _compilation.count == before:
        item.user_properties.append((CPU, used))
        if used > TEST_LIMIT and not item.config.getoption("--no-limits") and used > TEST_LIMIT * slowness():
            pytest.fail(f"{used:.1f} s of processor time; a test of the first tier may use {TEST_LIMIT:g} s")
    return result


_used_by_file: Final[dict[str, float]] = defaultdict(float)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the processor time of the tests of each file."""
    if report.when == "call":
        _used_by_file[report.nodeid.partition("::")[0]] += sum(
            float(str(used)) for name, used in report.user_properties if name == CPU
        )


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail the run if the tests of a file took too long in total."""
    unlimited = session.config.getoption("--no-limits") or not only_first_tier(session.config)
    if unlimited or hasattr(session.config, "workerinput"):
        return
    slow = {file: used for file, used in _used_by_file.items() if used > FILE_LIMIT}
    slow = slow and {file: used for file, used in slow.items() if used > FILE_LIMIT * slowness()}
    for file, used in slow.items():
        line = f"{file}: {used:.1f} s of processor time; a file may use {FILE_LIMIT:g} s in the first tier"
        session.config.get_terminal_writer().line(line, red=True)
    if slow and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
