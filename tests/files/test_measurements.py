from pathlib import Path

import pytest

import sagline as sl


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
    ("text", "message"),
    [
        ("", "no columns"),
        ("span,rise,length\n1,2,3\n", "missing column tension"),
        ("span,rise,length,force\n", "column 'force'"),
        ("span,rise,length,tension,span\n", "column span is there twice"),
        ("span [kg],rise,length,tension\n", "unit of span"),
        ("span,rise,length,tension\n1,0,1\n", "line 2: 3 columns"),
        ("span,rise,length,tension\n1,0,1,x\n", "line 2: tension is x; allowed: a number"),
        ("span,rise,length,tension\n1,nan,1,5\n", "line 2: rise is nan m; allowed: a finite number"),
        ("span,rise,length,tension\n1,0,1,5\n0,1,1,5\n", "line 3: span is 0 m; allowed: > 0 m"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(sl.FileError, match=message):
        sl.load_measurements(written(tmp_path, text))
