"""Extrema of short arrays agree with numpy, with and without NaN."""

from __future__ import annotations

import numpy as np
import pytest

from sagline.control.null_space import extrema, finite, largest

ODD = (np.nan, np.inf, -np.inf)


@pytest.mark.parametrize("count", [1, 4, 8])
def test_extrema_agree_with_numpy(count: int) -> None:
    random = np.random.default_rng(count)
    for _ in range(200):
        values = random.normal(0.0, 100.0, count)
        odd = random.random(count) < random.choice([0.0, 0.3])
        values[odd] = random.choice(ODD, int(odd.sum()))
        np.testing.assert_array_equal(extrema(values), (values.min(), values.max()))
        np.testing.assert_array_equal(largest(values), np.abs(values).max())
        assert finite(values) == bool(np.isfinite(values).all())


def test_infinities_of_both_signs_are_the_extrema() -> None:
    values = np.array([1.0, np.inf, -np.inf, 2.0])
    assert extrema(values) == (-np.inf, np.inf)
    assert largest(values) == np.inf
    assert not finite(values)


def test_the_order_of_values_is_kept() -> None:
    values = np.array([3.0, -7.0, 5.0])
    assert extrema(values) == (-7.0, 5.0)
    assert values.tolist() == [3.0, -7.0, 5.0]
