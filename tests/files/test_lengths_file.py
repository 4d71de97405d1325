from pathlib import Path

import pytest

from sagline.errors import FileError
from sagline.files.lengths_file import load_lengths
from sagline.files.measurements import load_measurements


def written(folder: Path, text: str) -> Path:
    file = folder / "lengths.csv"
    file.write_text(text)
    return file


def test_lengths_that_look_like_millimeters_are_told(tmp_path: Path) -> None:
    file = written(tmp_path, "L0,L1\n5.25,4.5\n5285,4500\n")
    with pytest.raises(FileError) as caught:
        load_lengths(file, 2, 18.2)
    assert "line 3: L0 is 5285 m; allowed: lengths like the robot's 18.2 m; if these are millimeters" in str(
        caught.value
    )
    assert "call the column L0 [mm]" in str(caught.value)


def test_who_names_the_unit_means_it(tmp_path: Path) -> None:
    found = load_lengths(written(tmp_path, "L0 [mm],L1 [m]\n5285,1900\n"), 2, 18.2)
    assert found.unstrained_length.tolist() == [[5.285, 1900.0]]
    # a hoist: one meter wide and ninety deep
    assert load_lengths(written(tmp_path, "L0,L1\n90,90\n"), 2, 1.0).unstrained_length.tolist() == [[90.0, 90.0]]
    assert load_lengths(written(tmp_path, "L0,L1\n5285,4500\n"), 2).unstrained_length[0, 0] == 5285.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("span,rise,length,tension\n10,-2,10400,100\n", "length is 10400 m; allowed: lengths like the distance of the"),
        ("span,rise,length,tension\n10000,-2,10.4,100\n", r"span is 10000 m; .* call the column span \[mm\]"),
        ("span,rise,length,tension\n10,2000,10.4,100\n", r"rise is 2000 m; .* call the column rise \[mm\]"),
    ],
)
def test_measurements_in_two_units_are_told(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        load_measurements(written(tmp_path, text))
