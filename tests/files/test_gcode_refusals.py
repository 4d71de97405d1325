"""Programs in G-code that are refused: each in one line, with the number of the line."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from tests.files.programs import OFFSETS, Writer, written
from tests.refusal import refused
from tests.tiers import wide

HEAD = "G21 G90\nG0 X0 Y0 Z0\nG1 X10 F600\n"

# a line after `HEAD`: the beginning of the value in the message, the allowed values
WRONG = {
    "G41 D1": ("G41 is not supported", "G0-G4, G17"),
    "G43 H1": ("G43 is not supported", "G0-G4, G17"),
    "G81 X1 Y1 Z-1 R1": ("G81 is not supported", "G0-G4, G17"),
    "G95": ("G95 is not supported", ""),
    "G2.5 X1": ("G2.5 is not supported", ""),
    "G5 X1 Y1": ("G5 is not supported", ""),
    "G10 L2 P1 X0": ("G10 is not supported", ""),
    "G1 X1 A90": ("the word A90 is not supported", "G, M, X, Y, Z"),
    "G1 U1": ("the word U1 is not supported", ""),
    "M98 P1000": ("M98 is a call of a subprogram", "the lines of the subprogram"),
    "O100 SUB": ("O100 SUB is a subroutine", "the lines of the subroutine"),
    "O100": ("the word O100 is not supported", "G, M, X"),
    "O<FIRST> CALL": ("O<FIRST> CALL is a subroutine", "the lines"),
    "#1=5": ("#1=5 is a parameter", "numbers"),
    "G1 X#1": ("X#1 is a parameter", "numbers"),
    "G1 X[1+2]": ("X[1+2] is a parameter", "numbers"),
    "G1 X1 (open": ("a comment without its other parenthesis", "(comment)"),
    "G1 X1) Y": ("a comment without its other parenthesis", "(comment)"),
    "G1 X": ("'X' is not a word of G-code", "a letter and a number"),
    "G1 X1,5": ("',5' is not a word of G-code", "a letter and a number"),
    "G1 X1 000": ("'000' is not a word of G-code", "a letter and a number"),
    "G1 X1e3": ("the word E3 is not supported", "G, M, X, Y, Z, I, J, K, R, F, P, S, T, N, and E for printers"),
    "G1 X--5": ("'X--5' is not a word of G-code", ""),
    "G1 X１": ("'X１' is not a word of G-code", ""),  # a full-width digit
    "hello": ("'HELLO' is not a word of G-code", ""),
    "G1 X1 X2": ("X is given twice", "once"),
    "G0 G1 X1": ("G0 and G1 exclude each other", "one of them"),
    "G20 G21": ("G20 and G21 exclude each other", "one of them"),
    "G17 G18": ("G17 and G18 exclude each other", "one of them"),
    "G4 X1": ("X beside G4", "P"),
    "G4": ("G4 without its time", "P in s"),
    "G4 P-1": ("the time of G4 is -1 s", "0 to 1e+06 s"),
    "G92": ("G92 without X, Y or Z", "at least one"),
    "G92 G1 X1": ("G92 beside G1", "one of them"),
    "G1 X1 F0": ("F is 0", "1e-09 to 1e+09"),
    "G1 X1 F-5": ("F is -5", "1e-09 to 1e+09"),
    "G93 G1 X1": ("G1 without a feed", "F on each line with G93"),
    "G94 G93 X1": ("G94 and G93 exclude", ""),
    "G80 X1": ("X without a motion", "after G0, G1, G2 or G3"),
    "G53": ("G53 without X, Y or Z", "a G0 or G1"),
    "G53 G2 X1 I5": ("G53 with G2", "G0 or G1"),
    "G1 X1 I5": ("I beside G1", "X, Y and Z"),
    "G2 X20": ("G2 with neither", "I and J, or R"),
    "G3 X20 I5 R5": ("G3 with both", "I and J, or R"),
    "G2 X20 I5 K1": ("K beside G2 with G17", "I and J, or R"),
    "G18 G2 X20 J5": ("J beside G2 with G18", "K and I, or R"),
    "G90.1 G2 X20 I15": ("G2 without J with G90.1", "both coordinates"),
    "G2 X20 R4.9": ("R of G2 is 0.0049 m", "at least 0.005 m, half the chord"),
    "G2 X10 R5": ("G2 with R ends where it starts", "another end, or a full circle"),
    "G2 X20 I4": ("the radii at the ends of G2 are 0.004 m and 0.006 m", "a difference of 5e-06 m, or of 0.1 %"),
    "G2 I0 J0": ("the radii at the ends of G2 are 0 m and 0 m", ""),
    "G2 X20 I5 P0": ("P of an arc is 0", "a whole number from 1"),
    "G2 X20 I5 P1.5": ("P of an arc is 1.5", "a whole number from 1"),
    "G64 P-1": ("P of G64 is -1", ">= 0"),
    "G1 X1" + "0" * 400: ("X is inf m", "up to 1e+06 m"),
    "G1 X2000000000": ("X is 2e+06 m", "up to 1e+06 m"),
    "G28\nG1 X5": ("the position after the reference motion of line 4 is not known", "no motion"),
}


@pytest.mark.parametrize("line", WRONG)
def test_a_wrong_line_is_refused_with_its_number(tmp_path: Path, line: str) -> None:
    value, allowed = WRONG[line]
    with pytest.raises(sl.FileError) as caught:
        sl.load_gcode(written(tmp_path, HEAD + line + "\nG1 X50\n"))
    number = 4 + line.count("\n")
    error: Any = caught.value
    assert error.item == f"line {number}"
    assert error.value.removeprefix(f"line {number}: ").startswith(value)
    assert error.allowed.startswith(allowed)
    assert "\n" not in str(error)
    assert len(str(error)) < 300


@pytest.mark.parametrize(
    ("text", "line", "value"),
    [
        ("G1 X1\n", 1, "G1 without a feed"),
        ("X1\n", 1, "X without a motion"),
        ("M220 S50\nG1 X1 F100\n", 1, "M220 S50 changes the feed"),
        ("G21\nM98 P2\n", 2, "M98 is a call"),
    ],
)
def test_wrong_lines_of_printers(tmp_path: Path, text: str, line: int, value: str) -> None:
    text = "G91\n" + text
    with pytest.raises(sl.FileError) as caught:
        sl.load_gcode(written(tmp_path, text, "house.gcode"))
    assert caught.value.item == f"line {line + 1}"
    assert value.replace(" ", "") in caught.value.value.replace(" ", "")


@pytest.mark.parametrize("text", ["", "%\n%\nG0 X1\nX2\n", "(only a comment)\n", "G0 X1 Y1\n", "G4 P1\n"])
def test_a_program_without_a_motion_is_refused(tmp_path: Path, text: str) -> None:
    with refused(next_step="Check that this is the file you mean."):
        sl.load_gcode(written(tmp_path, text))


@pytest.mark.parametrize("seed", wide(range(30), 3))
def test_a_random_program_with_one_wrong_line_names_it(tmp_path: Path, seed: int) -> None:
    """A wrong line anywhere in a random program; each wrong line is wrong in every modal state."""
    rng = np.random.default_rng(seed)
    lines = Writer(seed).write(12).split("\n")
    k = int(rng.integers(3, len(lines) - 2))
    always = [line for line in WRONG if line.split()[0] in ("G41", "G43", "G81", "M98", "#1=5", "hello", "G4", "G92")]
    lines.insert(k, str(rng.choice(always)))
    with pytest.raises(sl.FileError) as caught:
        sl.load_gcode(written(tmp_path, "\n".join(lines)), offsets=OFFSETS)
    assert caught.value.item == f"line {k + 1}"


def test_wrong_settings() -> None:
    with refused("offsets", kind=sl.InvalidValueError):
        sl.load_gcode("a.ngc", offsets={"G60": (0, 0, 0)})
    with refused("offsets['G54']", "2e+06 m", "up to 1e+06 m", kind=sl.InvalidValueError):
        sl.load_gcode("a.ngc", offsets={"G54": (0, 2e6, 0)})
    with refused("offsets", "3", "a dictionary", kind=sl.InvalidValueError):
        sl.load_gcode("a.ngc", offsets=3)  # type: ignore[arg-type]
    with refused("rapid", "0 m/s", kind=sl.InvalidValueError):
        sl.load_gcode("a.ngc", rapid=0.0)
    with refused("dialect", "'fanuc'", "linuxcnc, marlin", kind=sl.InvalidValueError):
        sl.gcode_parts("a.ngc", dialect="fanuc")  # type: ignore[arg-type]
