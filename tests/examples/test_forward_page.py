"""The code of docs/forward.md runs block by block."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tools.pages.snippets import blocks

PAGE = Path(__file__).parents[2] / "docs" / "forward.md"


def test_the_code_prints_the_output_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in blocks(PAGE.read_text(encoding="utf-8")):
        if block.kind == "python":
            exec(compile(block.text, str(PAGE), "exec"), names)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("solved: ")
    assert lines[1] == "[ 1.  -0.5  2. ]"
    assert names["step"].status == sl.ForwardStatus.SOLVED
    assert len(names["all_of_them"]) >= 2
    assert -0.01 < names["drop"][2] < -1e-4
    np.testing.assert_allclose(names["measured"].pose.position, (1.0, -0.5, 2.0), atol=1e-9)
    assert sl.forward(names["camera"], [21.0, 24.0, 29.5, 27.0]).status == sl.ForwardStatus.SOLVED


def test_every_status_is_on_the_page() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert [status.name for status in sl.ForwardStatus if f"| {status.name} |" not in text] == []
