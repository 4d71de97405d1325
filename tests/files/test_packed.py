"""Compressed columns are decoded exactly for any content."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sagline.files.packed import pack, round_decimals, unpack

FLOATS = st.floats(width=64)  # NaN with any payload, infinities, both zeros, subnormals


def same(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> bool:
    return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    hnp.arrays(np.float64, hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=9), elements=FLOATS),
    hnp.arrays(np.int64, hnp.array_shapes(max_dims=2, max_side=9)),
    st.integers(0, 15),
)
def test_all_floats_and_integers_are_decoded_exactly(real: Any, whole: Any, decimals: int) -> None:
    columns = {"real": real, "whole": whole, "rounded": round_decimals(np.nan_to_num(real, posinf=9.0, neginf=-9.0), 2)}
    found = unpack(pack(columns, {"real": decimals, "rounded": decimals}))
    assert list(found) == list(columns)
    assert all(same(found[name], columns[name]) for name in columns)


@pytest.mark.parametrize("kind", [np.int8, np.bool_])
def test_codes_and_flags_keep_their_type(kind: Any) -> None:
    column = np.arange(-3, 4).astype(kind)
    assert same(unpack(pack({"a": column}))["a"], column)


def test_gaps_among_decimals_are_kept_and_small() -> None:
    column = round_decimals(np.linspace(0.0, 1.0, 1000), 3)
    column[[3, 40, 500]] = np.nan, np.inf, -np.inf
    packed = pack({"a": column}, {"a": 3})
    assert same(unpack(packed)["a"], column)
    assert len(packed) < 300  # of 8,000


def test_smooth_columns_take_a_fraction_of_their_bytes() -> None:
    time = np.linspace(0.0, 10.0, 2000)
    column = np.sin(time)[:, None] * np.arange(1.0, 9.0)
    assert len(pack({"a": column})) < 0.25 * column.nbytes  # zstandard alone: 0.9
    noise = round_decimals(np.random.default_rng(0).normal(size=(2000, 8)), 2)
    entropy = np.log2(100.0 * np.sqrt(2.0 * np.pi * math.e)) / 8.0  # bytes per number of such noise
    assert len(pack({"a": noise}, {"a": 2})) < 1.15 * entropy * noise.size


def test_rounded_numbers_are_those_of_their_decimal_digits() -> None:
    values = np.random.default_rng(1).uniform(-5000.0, 5000.0, 2000)
    for decimals in (0, 2, 7):
        written = [float(f"{value:.{decimals}f}") + 0.0 for value in values]
        assert np.array_equal(round_decimals(values, decimals), written)
    assert not np.signbit(round_decimals(np.array([-1e-9, -0.0]), 3)).any()


def test_numbers_without_short_decimals_are_unchanged() -> None:
    values = np.array([1e300, -1e17, np.inf, -np.inf, np.nan])
    assert same(round_decimals(values, 8), values)
    assert same(unpack(pack({"a": values}, {"a": 8}))["a"], values)


def test_other_types_are_refused() -> None:
    good = pack({"a": np.arange(5.0)})
    for bad in (b"", b"abc", good[:-3], good + good[:4]):
        with pytest.raises((ValueError, OverflowError)):
            unpack(bad)
    with pytest.raises(TypeError, match="float32"):
        pack({"a": np.arange(5, dtype=np.float32)})


def test_invalid_headers_are_refused() -> None:
    from zstandard import compress

    for head in (
        b'[["a","float64",[3],-1,9]]', b'[["a","object",[3],-1,0]]', b'[["a","float64",[-3],-1,0]]',
        b'[["a","float64",[3],16,0]]', b'[["a","float64",[900000],-1,0]]', b"[]", b'[["a"]]', b'{"a":1}', b"7",
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"packed|column|head"):
            unpack(compress(len(head).to_bytes(4, "little") + head + bytes(24)))
