from pathlib import Path

import pytest

import sagline as sl
from tests.refusal import refused


def written(folder: Path, text: str) -> Path:
    file = folder / "cable.csv"
    file.write_text(text)
    return file


def test_columns_in_any_order_with_their_units(tmp_path: Path) -> None:
    text = "tension [kN],rise [mm],span,length\n0.3,-1500,8,8.1\n\n0.25,200,7.5,7.4\n"
    found = sl.load_measurements(written(tmp_path, text))
    assert found.tension.tolist() == pytest.approx([300.0, 250.0])
    assert found.rise.tolist() == pytest.approx([-1.5, 0.2])
    assert found.span.tolist() == [8.0, 7.5]
    assert found.unstrained_length.tolist() == [8.1, 7.4]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ("columns", "no columns; allowed: span, rise, length, tension")),
        ("span,rise,length\n1,2,3\n", ("line 1", "missing column tension; found: span, rise, length")),
        ("span,rise,length,force\n", ("line 1", "unknown column 'force'")),
        ("span,rise,length,tension,span\n", ("line 1", "column span is given twice")),
        ("span [kg],rise,length,tension\n", ("line 1", "the unit of span is [kg]")),
        ("span,rise,length,tension\n1,0,1\n", ("line 2", "3 columns")),
        ("span,rise,length,tension\n1,0,1,x\n", ("line 2", "tension is x", "a number")),
        ("span,rise,length,tension\n1,nan,1,5\n", ("line 2", "rise is nan m", "a finite number")),
        ("span,rise,length,tension\n1,0,1,5\n0,1,1,5\n", ("line 3", "span is 0 m", "> 0 m")),
    ],
)
def test_errors_are_reported_with_their_line(tmp_path: Path, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=sl.FileError):
        sl.load_measurements(written(tmp_path, text))
