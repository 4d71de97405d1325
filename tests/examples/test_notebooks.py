"""The notebooks run from the first to the last cell, give the numbers in their texts, and have no stored outputs."""

import ast
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.tiers import extended

pytestmark = extended
ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
WIDTH = 80  # columns of a line of code


def cells(file: Path, kind: str) -> list[dict[str, Any]]:
    content = json.loads(file.read_text(encoding="utf-8"))
    return [cell for cell in content["cells"] if cell["cell_type"] == kind]


def run(name: str) -> tuple[dict[str, Any], list[Any]]:
    """Names after the last cell of code, and the outputs of the cells: the value of the last line, as in Jupyter."""
    names: dict[str, Any] = {"__name__": "__main__"}
    shown = []
    for number, cell in enumerate(cells(FOLDER / f"{name}.ipynb", "code")):
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, f"{name}, cell {number}", "exec"), names)
        if isinstance(last, ast.Expr):
            shown.append(eval(compile(ast.Expression(last.value), f"{name}, cell {number}", "eval"), names))
    return names, [thing for thing in shown if thing is not None]


def html(thing: Any) -> str:
    text = thing._repr_html_()
    assert isinstance(text, str)
    return text


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for file in (ROOT / "examples").glob("winches*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())


def test_there_are_three() -> None:
    assert [file.stem for file in NOTEBOOKS] == ["article", "calibrate", "design"]


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_they_are_stored_without_outputs(file: Path) -> None:
    content = json.loads(file.read_text(encoding="utf-8"))
    assert (content["nbformat"], content["nbformat_minor"]) == (4, 5)
    names = [cell["id"] for cell in content["cells"]]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[\w-]{1,64}", name) for name in names)
    for cell in cells(file, "code"):
        assert (cell["outputs"], cell["execution_count"]) == ([], None)
        assert max(len(line.rstrip("\n")) for line in cell["source"]) <= WIDTH
    assert cells(file, "markdown")[0]["source"][0].startswith("# ")


def test_the_article() -> None:
    names, shown = run("article")
    assert [type(thing).__name__ for thing in shown] == ["Robot", "Path", "Plan", "Sheet", "Confirmation"]
    assert names["largest"]["Empirical"] == pytest.approx(1.66, abs=0.02)  # mm, as in the report
    assert names["largest"]["Catenary"] < 1e-6
    assert names["fit"].model.k_p == pytest.approx(9.81**2 / 24.0, rel=0.05)  # constant of shallow cables
    for thing in (shown[0], shown[2], shown[4]):
        assert "<svg" in html(thing)
    assert "all 1,201 poses" in html(shown[2])


def test_a_design() -> None:
    names, shown = run("design")
    assert [type(thing).__name__ for thing in shown] == ["Robot", "Workspace", "Sheet", "Robot", "Sheet"]
    assert "test box" in html(shown[0])
    assert names["after"] > names["before"] + 0.02
    assert Path("robot.pdf").read_bytes().startswith(b"%PDF")
    assert "limited by" in html(shown[1])


def test_a_calibration() -> None:
    names, shown = run("calibrate")
    assert [type(thing).__name__ for thing in shown] == ["Robot", "Calibration", "Sheet", "Robot"]
    found = names["found"]
    assert abs(found.chi_squared - found.degrees_of_freedom) < 4.0 * np.sqrt(2.0 * found.degrees_of_freedom)
    assert names["errors"]["calibrated"] < 0.6 * names["errors"]["drawing"]
    assert "<svg" in html(found)
    np.testing.assert_allclose(sl.load_robot("calibrated.yaml").frame_anchors, found.robot.frame_anchors, atol=1e-6)
