import json
from pathlib import Path

import numpy as np
import pytest

from sagline.errors import FileError
from sagline.files.json_text import json_text, save_json

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


def test_numbers_are_numbers_and_what_is_not_finite_is_null(tmp_path: Path) -> None:
    text = json_text(GIVEN)
    assert json.loads(text, parse_constant=lambda name: pytest.fail(name)) == MEANT
    assert "φ" in text
    save_json(GIVEN, tmp_path / "run.json")
    assert (tmp_path / "run.json").read_text(encoding="utf-8") == text + "\n"


def test_what_json_cannot_hold_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="not JSON serializable"):
        save_json({"what": object()}, tmp_path / "run.json")
    with pytest.raises(FileError, match="Create the folder"):
        save_json({}, tmp_path / "missing" / "run.json")
    assert list(tmp_path.iterdir()) == []
