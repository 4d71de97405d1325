"""The example of docs/contributing/c-kernels.md is the output of the translator."""

from __future__ import annotations

import re
from pathlib import Path
from types import FunctionType

from tools.translate.program import translate
from tools.translate.types import ArrayType, Element, Scalar

PAGE = Path(__file__).parents[2] / "docs" / "contributing" / "c-kernels.md"
HEAD = """import math
Array = list
kernel = lambda each: each


"""
F1 = ArrayType(Element.FLOAT, 1)


def test_the_example_of_the_page_is_the_output_of_the_translator(tmp_path: Path) -> None:
    page = PAGE.read_text(encoding="utf-8")
    (source,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    function, prototype = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    file = tmp_path / "example.py"
    file.write_text(HEAD + source, encoding="utf-8")
    space: dict[str, object] = {"__name__": "example"}
    exec(compile(HEAD + source, str(file), "exec"), space)
    kernel = space["weighted_mean"]
    assert isinstance(kernel, FunctionType)
    text = translate([(kernel, (F1, F1, Scalar.INT), "sagline_example")])
    for part in (function, prototype):  # long lines are broken on the page
        assert " ".join(part.split()) in " ".join(text.split())
