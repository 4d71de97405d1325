import numpy as np
import pytest

from sagline.errors import InvalidValueError
from sagline.robot import checks

Z = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("text", ["", "cogiro", "größer 2", "名" * 100, "a-b_c.d/..", "👩\u200d🔬"])
def test_names(text: str) -> None:
    assert checks.name(text) == text


@pytest.mark.parametrize("text", ["a" * 101, "a\nb", "a\tb", "\x1b[31m", "a\0", "\ud800", "\u202egnp", 5, None, b"a"])
def test_what_is_no_name(text: object) -> None:
    with pytest.raises(
        InvalidValueError, match=r"name is .*; allowed: one line of printable text, at most 100"
    ) as caught:
        checks.name(text)
    assert len(str(caught.value)) < 300


def test_texts_have_lines_but_no_control_characters() -> None:
    assert checks.text("two\n\tlines" * 1000, "notes") == "two\n\tlines" * 1000
    for text in ("\x1b]0;x\x07", "a\rb", "\ud800", 5):
        with pytest.raises(InvalidValueError, match="notes is"):
            checks.text(text, "notes")


@pytest.mark.parametrize(
    ("moments", "pattern", "normal", "good"),
    [
        ((1.0, 1.0, 2.0), "3R3T", None, True),  # a thin plate
        ((0.333, 0.333, 0.667), "3R3T", None, True),  # one printed with three digits
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
def test_which_inertia_a_platform_can_have(
    moments: tuple[float, float, float], pattern: str, normal: np.ndarray | None, good: bool
) -> None:
    # turned about the normal, which a planar platform may be, and anyhow where it turns about every axis
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    for matrix in (np.diag(moments), turn @ np.diag(moments) @ turn.T):
        if good:
            np.testing.assert_array_equal(checks.inertia(matrix, pattern, normal), matrix)
        else:
            with pytest.raises(InvalidValueError, match="inertia is a matrix with"):
                checks.inertia(matrix, pattern, normal)
