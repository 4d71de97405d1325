"""Printout of a calibration: verdict first, significant digits only, at most 80 columns."""

import re
from dataclasses import replace

import numpy as np
import pytest

import sagline as sl
from sagline.calibration.findings import CrossValidation, Direction, Outlier
from sagline.calibration.summary import (
    _faulty_sensors,
    _row_ranges,
    anchor_covariance,
    calibration_text,
    relative_covariance,
)
from sagline.core.arrays import Array
from tests.calibration.made_up import MOTIONS, STEP, made_up, motions, parameters
from tests.calibration.synthetic import log_of, true_robot
from tests.refusal import refused

POWERS = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
NUMBER = r"[−+]?[\d,]+(?:\.\d+)?"
PAIR = re.compile(rf"({NUMBER})\u00a0±\u00a0({NUMBER})(?:\u00a0(\S+))?")


@pytest.fixture(scope="module")
def found() -> sl.Calibration:
    return made_up(count=20)


def read(text: str) -> float:
    return float(text.replace("−", "-").replace(",", ""))


def factor(shown: str, unit: str) -> float:
    """Ratio of the printed unit to the given unit."""
    if shown == unit:
        return 1.0
    if unit.startswith("kg"):
        return POWERS[shown.removesuffix(unit[1:])] / 1e3
    return POWERS[shown.removesuffix(unit)]


def check_pair(text: str, value: float, error: float, unit: str) -> None:
    """A printed pair is the value and its error, both rounded to the second digit of the error."""
    match = PAIR.search(text)
    assert match is not None, text
    shown, own, symbol = match.groups()
    size = factor(symbol or "", unit)
    decimals = len(own.partition(".")[2])
    assert len(shown.partition(".")[2]) == decimals
    digits = own.replace(".", "").lstrip("0")
    assert len(digits) == 2 or (decimals == 0 and len(digits) >= 2), text
    half = 0.5001 * 10.0**-decimals * size if decimals else 0.051 * error
    assert read(shown) * size == pytest.approx(value, abs=half)
    assert read(own) * size == pytest.approx(error, abs=half)


def test_every_number_of_the_table_is_an_estimate(found: sl.Calibration) -> None:
    head, *lines = found.table().splitlines()
    assert head.split()[:3] == ["number", "found", "before"]
    assert len(lines) == len(found.parameters.labels)
    for k, (line, label) in enumerate(zip(lines, found.parameters.labels, strict=True)):
        assert line.split(" ")[0] == label
        unit, value, error = found.parameters.units[k], found.values[k], found.standard_error[k]
        now, _, before = line.partition("  ")[2].strip().partition("  ")
        check_pair(now, value, error, unit)
        check_pair(before, found.parameters.prior[k], found.parameters.prior_deviation[k], unit)
        moved = (value - found.parameters.prior[k]) / found.parameters.prior_deviation[k]
        assert read(line.split()[-1]) == pytest.approx(moved, abs=0.00501)


def test_the_lines_have_every_value_with_its_unit(found: sl.Calibration) -> None:
    text = str(found)
    rows = re.findall(r"^ {4} +(\d)  (.+)$", text, re.MULTILINE)
    assert [int(cable) for cable, _ in rows] == list(range(8))
    assert "frame_anchors [m]" in text
    for cable, row in rows:
        for axis, pair in enumerate(PAIR.finditer(row)):
            k = found.parameters.where[axis, int(cable)]
            check_pair(f"{pair[0]}\u00a0m", found.values[k], found.standard_error[k], "m")
    for label, unit in (("mass", "kg"), ("axial_stiffness", "N")):
        line = next(line for line in text.splitlines() if line.strip().startswith(label))
        check_pair(line, *found.value_of(label), unit)
    zeros = text.partition("length_zero")[2].partition("axial_stiffness")[0]
    for cable in range(8):
        zero = re.search(rf"\b{cable}: ({PAIR.pattern})", zeros)
        assert zero is not None
        check_pair(zero[1], *found.value_of(f"length_zero[{cable}]"), "m")


def test_the_verdict_names_the_numbers_of_used_and_excluded_rows(found: sl.Calibration) -> None:
    first, *rest = str(found).splitlines()
    assert re.findall(r"\b\d+\b(?!-)|cogiro|winches.csv|\d+-\d+-\d+", first) == [
        "37", "cogiro", "20", "winches.csv", "2026-11-22"
    ]  # fmt: skip
    text = "\n".join(rest)
    assert re.search(r"^ *Rows: 20 .*23\b.*\b3\b", text, re.MULTILINE)
    for reason, rows in ((sl.Omission.MOVING, "rows 20, 22"), (sl.Omission.SLACK, "row 21")):
        assert f"{reason.text}: {rows}" in text
    assert "row 4, cable 3" in text
    assert "20\u00a0mm" in text
    assert "(40 deviations)" in text
    x, y, z = found.poses.position[4]
    assert f"at\u00a0({x:.2f},\u00a0{y:.2f},\u00a0{z:.2f})\u00a0m".replace("-", "−") in text
    assert re.search(r"position: 1\.4\smm\b.*\b46\.3\smm\b", text)
    assert re.search(r"load cells: 6\.1\sN\b.*\b212\sN\b", text)
    open_ways = f"{MOTIONS[0]}, y, z; {MOTIONS[3]}: {STEP.split(',')[0]}"
    assert open_ways in " ".join(text.split())
    assert repr(found) == f"<Calibration: {first}>"


@pytest.mark.parametrize(
    ("status", "word"), [(sl.CalibrationStatus.DOUBTFUL, "DOUBTFUL"), (sl.CalibrationStatus.NOT_CONVERGED, "Not conv")]
)
def test_a_doubtful_result_begins_with_its_verdict(
    found: sl.Calibration, status: sl.CalibrationStatus, word: str
) -> None:
    text = str(replace(found, status=status, chi_squared=4321.0))
    assert text.startswith(word)
    assert "4,321" in " ".join(text.splitlines()[:3])
    assert status.text.partition(": ")[2] in " ".join(text.split()) or word != "DOUBTFUL"


def calibrations(count: int, found: sl.Calibration) -> list[sl.Calibration]:
    """One calibration with fields replaced by other possible values."""
    random = np.random.default_rng(3)
    some = []
    for _ in range(count):
        rows = np.sort(random.choice(10**6, int(random.integers(1, 400)), replace=False))
        outliers = tuple(
            Outlier(int(row), None if row % 3 == 0 else int(row % 8), quantity, float(size), float(abs(size) * 1e3))
            for row, quantity, size in zip(
                rows, random.choice(["length", "load cell", "position", "rotation"], len(rows)),
                10.0 ** random.uniform(-6.0, 6.0, len(rows)), strict=False,
            )
        )  # fmt: skip
        directions = tuple(
            Direction(" with ".join(random.choice(found.parameters.labels, 3)), found.values, float(known), step)
            for known, step in zip(random.uniform(0.0, 1.0, 5), ["measure it"] * 2 + ["a " * 99] * 3, strict=True)
        )
        # errors multiplied by a millionth to a million, a few of them infinite
        scale = 10.0 ** random.uniform(-6.0, 6.0, len(found.values))
        covariance = found.covariance * np.outer(scale, scale)
        for k in random.choice(len(found.values), 3):
            covariance[k] = covariance[:, k] = 0.0
            covariance[k, k] = np.inf
        position, tension = random.choice([np.nan, 1e-6, 3.0], 2)
        some.append(
            replace(
                found,
                outliers=outliers[: int(random.integers(0, 40))],
                cannot_tell_apart=directions,
                covariance=covariance,
                left_out=dict.fromkeys(sl.Omission, rows),
                log="a/long/way/" * 9,
                cross_validation=CrossValidation(5, tension, position, tension, position),
                degrees_of_freedom=int(random.integers(0, 10**6)),
                status=sl.CalibrationStatus(int(random.integers(0, 3))),
            )
        )
    return some


def test_a_narrow_terminal_shows_the_same_words_in_shorter_lines(found: sl.Calibration) -> None:
    for one in calibrations(10, found):
        narrow = calibration_text(one, 60)
        assert [line for line in narrow.splitlines() if len(line) > 60] == []
        (head, values), (own_head, own_values) = (text.split("Values ±") for text in (narrow, str(one)))
        assert "".join(head.split()) == "".join(own_head.split())
        assert "".join(values.split("Outliers")[1].split()) == "".join(own_values.split("Outliers")[1].split())
        if "cable  " in values:
            assert PAIR.findall(values) == PAIR.findall(own_values)


@pytest.mark.parametrize("count", [20, pytest.param(1000, marks=pytest.mark.soak)])
def test_the_text_has_80_columns_and_is_complete(found: sl.Calibration, count: int) -> None:
    for one in calibrations(count, found):
        text = str(one)
        assert [line for line in text.splitlines() if len(line) > 80] == []
        assert "nan" not in text
        assert "inf" not in re.findall(r"[a-z]+", text)
        for reason in sl.Omission:
            assert " ".join(reason.text.split()[:4]) in " ".join(text.split())
        for outlier in one.outliers[:12]:
            assert f"row {outlier.row}" in text
        if len(one.outliers) > 12:
            assert f"and {len(one.outliers) - 12} more" in text
        error = one.standard_error
        told = [label for label, size in zip(one.parameters.labels, error, strict=True) if not np.isfinite(size)]
        lines = {line.split(" ")[0]: line for line in one.table().splitlines()}
        assert all("± unknown" in lines[label] for label in told)
        assert 1 <= len(told) <= 3


def test_consecutive_rows_are_printed_as_a_range() -> None:
    assert _row_ranges([3]) == "row 3"
    assert _row_ranges([3, 17, 18, 19, 40]) == "rows 3, 17 to 19, 40"
    assert _row_ranges(range(0, 2000, 2)).endswith("14 and 992 more")


def test_a_correlation_has_ones_and_the_signs_of_the_covariance(found: sl.Calibration) -> None:
    np.testing.assert_array_equal(np.diagonal(found.correlation), 1.0)
    scaled = found.correlation * found.standard_error * found.standard_error[:, None]
    np.testing.assert_allclose(scaled, found.covariance, rtol=1e-9, atol=1e-18)
    unknown = np.array(found.covariance)
    unknown[3, 3] = np.inf
    beside = np.array(replace(found, covariance=unknown).correlation)
    assert beside[3, 3] == 1.0
    assert np.isnan(np.delete(beside[3], 3)).all()
    assert np.isfinite(np.delete(np.delete(beside, 3, 0), 3, 1)).all()


def test_an_unknown_label_is_refused(found: sl.Calibration) -> None:
    k = found.parameters.labels.index("frame_anchors[3].y")
    assert found.value_of("frame_anchors[3].y") == (found.values[k], np.sqrt(found.covariance[k, k]))
    with refused("label", "'frame_anchor[3].y'", kind=sl.InvalidValueError):
        found.value_of("frame_anchor[3].y")


def rigid(points: Array, random: np.random.Generator, *, upright: bool) -> Array:
    """Covariance of common motions of all points."""
    ways = [np.tile(axis, len(points)) for axis in np.eye(3)]
    ways += [np.cross(axis, points).ravel() for axis in (np.eye(3)[2:] if upright else np.eye(3))]
    root = np.stack(ways, axis=1) @ random.standard_normal((len(ways), len(ways)))
    return (root @ root.T).reshape(len(points), 3, len(points), 3)


@pytest.mark.parametrize(("which", "freedoms"), [("frame_anchors", 4), ("platform_anchors", 6)])
def test_common_motions_of_anchors_are_removed(which: str, freedoms: int) -> None:
    random = np.random.default_rng(1)
    points = random.uniform(-5.0, 5.0, (8, 3))
    plain = (4e-6 * np.eye(24)).reshape(8, 3, 8, 3)
    left = relative_covariance(points, plain, which)  # type: ignore[arg-type]
    assert np.trace(left.reshape(24, 24)) == pytest.approx(4e-6 * (24 - freedoms))
    moved = plain + rigid(points, random, upright=which == "frame_anchors")
    np.testing.assert_allclose(relative_covariance(points, moved, which), left, atol=1e-13)  # type: ignore[arg-type]
    tilted = plain + 1e-6 * rigid(points, random, upright=False)
    same = np.allclose(relative_covariance(points, tilted, which), left, atol=1e-9)  # type: ignore[arg-type]
    assert same == (which == "platform_anchors")


def test_relative_errors_are_those_without_the_gauge(found: sl.Calibration) -> None:
    whole = anchor_covariance(found.parameters, found.covariance, "frame_anchors")
    assert whole is not None
    np.testing.assert_array_equal(whole[3, 1, 5, 2], found.covariance[3 * 3 + 1, 5 * 3 + 2])
    own = relative_covariance(found.before.frame_anchors, whole, "frame_anchors").reshape(24, 24)
    unseen = motions(found.parameters, found.before)[:24]
    assert np.abs(own @ unseen).max() < 1e-12 * np.abs(whole).max()
    size = np.sqrt(np.trace(own) / 24.0)
    assert 1e-3 < size < 4e-3 < found.standard_error[0]
    told = re.search(r"one another\s±\s([\d.]+)\smm", str(found))
    assert told is not None
    assert float(told[1]) == pytest.approx(1e3 * size, rel=0.03)
    assert anchor_covariance(parameters(found.before, ("mass",)), np.eye(1), "frame_anchors") is None


def test_reduced_weights_are_printed_only_if_present(found: sl.Calibration) -> None:
    odd = replace(found, outliers=(Outlier(int(found.rows[3]), 2, "length", 0.02, 12.0),))
    odd_alone = replace(odd, weights=np.ones(len(found.rows)))
    less = replace(odd, weights=np.where(np.arange(len(found.rows)) == 3, 0.1, 1.0))
    heads = [re.search(r"^ *Outliers, 1(.*):$", str(one), re.MULTILINE) for one in (less, odd_alone)]
    assert [head and "less" in head[1] for head in heads] == [True, False]


def test_a_load_cell_with_many_outliers_is_named() -> None:
    robot = sl.load_robot("cogiro")
    log = log_of(true_robot(robot, {"mass": 0.03}, 4), 60, 4).log
    cells = np.array(log.load_cells)
    cells[::4, 3] *= 1.4
    cells[7, 5] += 300.0
    found = sl.calibrate(robot, log.replace(load_cells=cells), ("mass",), folds=0)
    (name, own), *others = _faulty_sensors(found).items()
    assert name == ("load cell", 3)
    assert not others
    assert {one.row for one in own} <= set(range(0, 60, 4))
    listed = re.findall(r"^  - (.*)", str(found), re.M)
    assert [int(number) for number in re.findall(r"\d+", listed[0])[:3]] == [3, len(own), 60]
    assert (7, 5) in {(one.row, one.cable) for one in found.outliers if one not in own}
    assert len(listed) == 1 + len(found.outliers) - len(own)


def test_the_gain_of_a_load_cell_that_is_far_from_its_prior_is_named() -> None:
    robot = sl.load_robot("cogiro")
    truth = true_robot(robot, {"mass": 0.03}, 3)
    log = log_of(truth, 40, 3).log
    found = sl.calibrate(robot, log.replace(load_cells=log.load_cells * np.where(np.arange(8) == 3, 0.7, 1.0)), folds=0)
    listed = re.findall(r"^  - (.*)", str(found).partition("Values")[0], re.M)
    assert len(listed) == 1
    assert listed[0].startswith("load_cell_gain[3]: 0.")
    gain, error = found.value_of("load_cell_gain[3]")
    assert abs(gain - 0.7) < 3.0 * error
    assert "Far" not in str(sl.calibrate(robot, log, folds=0))
