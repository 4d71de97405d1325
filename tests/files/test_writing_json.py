import json
from pathlib import Path
from unicodedata import category

import numpy as np
import pytest

from sagline.files.writing import json_text

GIVEN = {
    "lengths": np.array([[1.0, np.nan], [-np.inf, 2.5e-300]]),
    "count": np.int64(3),
    "flag": np.bool_(True),
    "file": Path("out") / "φ.nc",
    1: (float("inf"), 0.1, None, "text"),
}
MEANT = {
    "lengths": [[1.0, None], [None, 2.5e-300]],
    "count": 3,
    "flag": True,
    "file": "out/φ.nc",
    "1": [None, 0.1, None, "text"],
}


def test_finite_numbers_are_numbers_and_others_null() -> None:
    text = json_text(GIVEN)
    assert json.loads(text, parse_constant=lambda name: pytest.fail(name)) == MEANT
    assert "φ" in text


def test_values_without_json_form_are_refused() -> None:
    with pytest.raises(TypeError, match="serializable"):
        json_text({"what": object()})


def test_texts_are_safe_for_terminals_and_loaded_exactly() -> None:
    texts = [
        chr(code) for code in (*range(0xA1), *range(0x2000, 0x2100), *range(0xD7F0, 0xE000), 0xFEFF, 0x1F600, 0xE0001)
    ]
    text = json_text(dict(zip(texts, texts, strict=True)))
    assert all(c == "\n" or c.isprintable() or category(c) == "Zs" for c in text.encode().decode())
    assert json.loads(text) == dict(zip(texts, texts, strict=True))
