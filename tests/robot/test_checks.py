import numpy as np
import pytest

from sagline import InvalidValueError
from sagline.robot import checks
from tests.refusal import refused

Z = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("moments", "pattern", "normal", "good"),
    [
        ((1.0, 1.0, 2.0), "3R3T", None, True),  # a thin plate
        ((0.333, 0.333, 0.667), "3R3T", None, True),  # a value printed with three digits
        ((1.0, 1.0, 2.1), "3R3T", None, False),
        ((1.0, -1e-6, 1.0), "3R3T", None, False),
        ((1.0, -0.1, 1.0), "3R3T", None, False),
        ((0.0, 0.0, 0.1), "1R2T", Z, True),
        ((5.0, 5.0, 0.0), "1R2T", Z, False),
        ((-1.0, 0.0, 0.1), "1R2T", Z, False),
        ((0.0, 0.0, 0.0), "2T", Z, True),
        ((0.0, 0.0, 0.3), "3T", None, True),
        ((0.0, 0.0, -0.3), "3T", None, False),
    ],
)
def test_possible_inertias(
    moments: tuple[float, float, float], pattern: str, normal: np.ndarray | None, good: bool
) -> None:
    # rotated about the normal, which is free for a planar platform, and any rotation for a spatial one
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    for matrix in (np.diag(moments), turn @ np.diag(moments) @ turn.T):
        if good:
            np.testing.assert_array_equal(checks.inertia(matrix, pattern, normal), matrix)
        else:
            with refused("inertia", kind=InvalidValueError):
                checks.inertia(matrix, pattern, normal)
