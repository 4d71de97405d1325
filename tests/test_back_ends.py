"""Back ends of the kernels: the compiled library, its calls from Python, and the choice between back ends."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sagline as sl
from sagline.core.arrays import Array
from sagline.kernels import library
from sagline.kernels.calibration.observe import starting_lengths
from sagline.kernels.dynamics.progress import read_cells
from sagline.kernels.dynamics.rigid_body import platform_state
from sagline.kernels.forward.forward import forward_poses
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.jit import backend, bound
from sagline.kernels.library import FILES, FOLDER, Library, LibraryError
from tests.translate.recorded import recorded

POSITION = """
import sagline as sl
robot = sl.load_robot("cogiro")
plan = sl.inverse(robot, sl.Pose.from_euler([0.2, -0.4, 2.4], 0.1, 0.0, 0.2))
print(sl.backend(), [each.hex() for each in plan.unstrained_length])
"""


def run(chosen: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """One pose in a new process with a back end."""
    environment = {**os.environ, "SAGLINE_BACKEND": chosen, **variables}
    return subprocess.run([sys.executable, "-c", POSITION], capture_output=True, text=True, env=environment)


def cells(count: int = 4) -> tuple[Array, ...]:
    """Arguments of `read_cells`: tensions, gains, biases, deviations and ranges, noise, and an array for readings."""
    numbers = np.random.default_rng(3).uniform(1.0, 2.0, (6, count))
    return 10.0 * numbers[0], np.concatenate((numbers[1:4], 1e4 * numbers[4:5])), numbers[5], np.zeros(count)


def test_the_tests_run_the_compiled_library() -> None:
    """Otherwise all other tests of this run used another back end; `python -m tools.build` prints the reason."""
    assert backend() == "c"
    assert sl.backend() == "c"


def test_every_back_end_gives_the_same_lengths() -> None:
    lengths = {name: run(name).stdout.split(maxsplit=1) for name in ("c", "python")}
    assert [name for name, _ in lengths.values()] == list(lengths)
    assert lengths["c"][1] == lengths["python"][1]


def test_the_library_needs_no_home() -> None:
    done = run("c", HOME="/nonexistent", XDG_CACHE_HOME="/nonexistent")
    assert (done.stdout.split(maxsplit=1)[0], done.stderr) == ("c", "")


def test_an_unknown_back_end_is_refused_in_one_line() -> None:
    done = run("fortran")
    assert done.returncode != 0
    last = done.stderr.splitlines()[-1]
    assert all(word in last for word in ("SAGLINE_BACKEND", "'fortran'", "numba"))


@pytest.mark.skipif(len(list(FOLDER.glob("kernels*"))) < 2, reason="only gcc and clang on x86-64 make two builds")
def test_both_builds_give_the_same_numbers() -> None:
    robot = sl.load_robot("ipanema-3-pulleys")
    with recorded() as calls:
        plan = sl.inverse(robot, sl.Pose.from_euler([0.1, 0.2, 1.0], 0.05, 0.0, 0.1))
        sl.forward(robot, plan.unstrained_length)
    builds = [Library(FOLDER / name) for name in FILES]
    functions = {name: inspect.unwrap(each) for name, each in (("inverse", inverse_poses), ("forward", forward_poses))}
    compared = 0
    for call in calls:
        for name, function in functions.items():
            if call.symbol.startswith(f"sagline_{name}_poses"):
                results = [copied(call.before) for _ in builds]
                for build, arguments in zip(builds, results, strict=True):
                    cast("Any", build.entry(function.__name__, function.__module__))(*arguments)
                assert repr(results[0]) == repr(results[1])
                compared += 1
    assert compared >= 2


def copied(value: Any) -> Any:
    """A copy of arrays in tuples."""
    return tuple(map(copied, value)) if isinstance(value, tuple) else value.copy() if hasattr(value, "copy") else value


BAD: dict[str, Callable[[Array], Any]] = {
    "single precision": lambda array: array.astype(np.float32),
    "integers": lambda array: array.astype(np.int64),
    "big endian": lambda array: array.astype(">f8"),
    "not contiguous": lambda array: np.repeat(array, 2)[::2],
    "two axes": lambda array: array[None],
    "no axis": lambda array: np.array(1.0),
    "a list": lambda array: array.tolist(),
    "None": lambda array: None,
    "a text": lambda array: "1.0",
}


@given(place=st.integers(0, 3), kind=st.sampled_from(sorted(BAD)))
def test_arguments_of_other_types_are_refused_before_anything_is_written(place: int, kind: str) -> None:
    arguments: list[Any] = list(cells())
    arguments[place] = BAD[kind](arguments[place])
    for call in (lambda: read_cells(*arguments), lambda: bound(read_cells, *arguments)):
        with pytest.raises(TypeError, match="read_cells"):
            call()
    assert not any(np.any(each) for k, each in enumerate(arguments[3:], 3) if k != place)


def test_too_few_arguments_are_refused() -> None:
    with pytest.raises(TypeError, match="read_cells"):
        read_cells(*cells()[:-1])


def test_arrays_with_an_explicit_native_byte_order_are_accepted() -> None:
    """Unpickled data contains such arrays, for example in a sweep."""
    expected = cells()
    stated = [each.astype(each.dtype.newbyteorder(sys.byteorder)) for each in cells()]
    assert stated[0].data.format != expected[0].data.format
    read_cells(*expected)
    read_cells(*stated)
    assert np.any(stated[3])
    for one, other in zip(stated, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_bound_entry_sees_new_values_of_its_arrays() -> None:
    arguments = cells()
    call = bound(read_cells, *arguments)
    arguments[0][:] = np.random.default_rng(4).uniform(20.0, 30.0, 4)
    call()
    expected = cells()
    expected[0][:] = arguments[0]
    read_cells(*expected)
    assert np.any(arguments[3])
    for one, other in zip(arguments, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def arguments_of_inverse() -> list[Any]:
    """Arguments of `inverse_poses` for one pose; the last two are its first index and the index after it."""
    with recorded() as calls:
        robot = sl.load_robot("cogiro")
        sl.inverse(robot, sl.Pose.from_euler([0.2, -0.4, 2.4], 0.0, 0.0, 0.0))
    call = next(each for each in calls if each.symbol.startswith("sagline_inverse_poses"))
    return list(copied(call.before))


def test_a_bound_entry_takes_new_numbers() -> None:
    arguments = arguments_of_inverse()
    results = arguments[10][0]
    results[:] = 0.0
    call = bound(inverse_poses, *arguments, numbers=2)
    references = sys.getrefcount(None)
    assert [call(0, 0) for _ in range(1000)] == [None] * 1000
    assert abs(sys.getrefcount(None) - references) < 500
    assert not results.any()
    call(np.int64(0), True)
    assert results.all()
    for bad in ((0,), (0, 1, 1), ("0", 1), (0.5, 1), (None, 1)):
        with pytest.raises(TypeError, match="inverse_poses"):
            call(*bad)


def test_too_little_memory_is_an_error() -> None:
    arguments = arguments_of_inverse()
    arguments[7] = (np.empty(10), arguments[7][1])
    for call in (cast("Any", inverse_poses), lambda *given: bound(inverse_poses, *given)()):
        with pytest.raises(ValueError, match="inverse_poses"):
            call(*arguments)


def test_an_entry_has_the_name_and_docstring_of_its_source() -> None:
    assert starting_lengths.__name__ == "starting_lengths"
    assert "lengths" in str(starting_lengths.__doc__)
    assert list(inspect.signature(platform_state).parameters) == list(
        inspect.signature(inspect.unwrap(platform_state)).parameters
    )


def test_other_threads_run_during_a_kernel() -> None:
    arguments, count = cells(2_000_000), 0
    worker = threading.Thread(target=lambda: [read_cells(*arguments) for _ in range(50)])
    worker.start()
    while worker.is_alive():
        count += 1
        time.sleep(0.0005)
    assert count > 10


@pytest.mark.parametrize("content", [b"", b"no library", b"\x7fELF" + bytes(500)])
def test_an_invalid_library_file_is_not_loaded(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILES[0]).write_bytes(content)
    with pytest.raises(LibraryError, match=FILES[0]):
        Library.load(tmp_path)


def test_a_missing_library_is_named(tmp_path: Path) -> None:
    with pytest.raises(LibraryError, match=FILES[0]):
        Library.load(tmp_path)


def test_a_library_of_other_sources_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "digest_of_kernels", lambda: "0123456789abcdef")
    with pytest.raises(LibraryError) as caught:
        Library.load()
    assert caught.value.stale
