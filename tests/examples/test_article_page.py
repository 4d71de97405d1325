"""The code of docs/article.md runs block by block."""

import re
from pathlib import Path
from typing import Any

import pytest

from tools.pages.snippets import blocks

PAGE = Path(__file__).parents[2] / "docs" / "article.md"


def test_the_code_prints_the_output_on_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, Any] = {}
    for block in blocks(PAGE.read_text(encoding="utf-8")):
        if block.kind == "python":
            exec(compile(block.text, str(PAGE), "exec"), names)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "k_h = 4.878, k_p = 4.009"
    assert re.findall(r"[\d.]+ N", lines[1]) == ["100 N", "2.9 N"]
    assert lines[2].startswith("linear_density = 0.067 ± 0.05")
    assert lines[3].startswith("axial_stiffness = 4.4e+04 ± ")
    assert lines[4].partition(" is ") == ("linear_density", " is ", "not determined")
    assert names["plan"].feasible.all()
