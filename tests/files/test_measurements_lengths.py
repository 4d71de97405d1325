from pathlib import Path

import pytest

from sagline import FileError, load_measurements
from sagline.files.table import load_readings
from tests.refusal import refused


def written(folder: Path, text: str) -> Path:
    file = folder / "lengths.csv"
    file.write_text(text)
    return file


def test_lengths_that_look_like_millimeters_are_reported(tmp_path: Path) -> None:
    file = written(tmp_path, "L0,L1\n5.25,4.5\n5285,4500\n")
    allowed = "lengths like the robot's 18.2 m; if these are millimeters, call the column length_0 [mm]"
    with refused("line 3", "length_0 is 5285 m", allowed, kind=FileError):
        load_readings(file, "length", 2, 18.2)


def test_an_explicit_unit_is_accepted(tmp_path: Path) -> None:
    found = load_readings(written(tmp_path, "L0 [mm],L1 [m]\n5285,1900\n"), "length", 2, 18.2)
    assert found[1].tolist() == [[5.285, 1900.0]]
    # a hoist: one meter wide and ninety meters high
    assert load_readings(written(tmp_path, "L0,L1\n90,90\n"), "length", 2, 1.0)[1].tolist() == [[90.0, 90.0]]
    assert load_readings(written(tmp_path, "L0,L1\n5285,4500\n"), "length", 2)[1][0, 0] == 5285.0


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            "span,rise,length,tension\n10,-2,10400,100\n",
            (
                "line 2",
                "length is 10400 m",
                "lengths like the distance of the ends; if these are millimeters, call the column length [mm]",
            ),
        ),
        ("span,rise,length,tension\n10000,-2,10.4,100\n", ("line 2", "span is 10000 m")),
        ("span,rise,length,tension\n10,2000,10.4,100\n", ("line 2", "rise is 2000 m")),
    ],
)
def test_measurements_in_two_units_are_reported(tmp_path: Path, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError):
        load_measurements(written(tmp_path, text))
