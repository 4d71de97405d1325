from pathlib import Path as FilePath

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from syrupy.assertion import SnapshotAssertion

from sagline import FileError, load_path
from tests.files.wording import wording
from tests.refusal import refused

WAYPOINTS = """\
rate: 50 Hz
durations: [2 s, 500 ms, 1]
waypoints:
  - position: [0, 0, 1.5]
  - position: [2 m, 1500 mm, 150 cm]
    euler: {alpha: 20 deg, beta: -0.1, gamma: 300 mrad}
  - position: [2, 1.5, 1.5]
    quaternion: [0, 0, 0.6, 0.8]
  - position: [0, 1e-3, 1.5]
    euler: {gamma: 5e-1}
"""


def write(folder: FilePath, name: str, text: str) -> FilePath:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_waypoints_with_and_without_units(tmp_path: FilePath) -> None:
    path = load_path(write(tmp_path, "tour.yaml", WAYPOINTS))
    assert path.duration == 3.5
    assert len(path) == 176
    stops = np.array([0, 100, 125, 175])
    position = [(0.0, 0.0, 1.5), (2.0, 1.5, 1.5), (2.0, 1.5, 1.5), (0.0, 1e-3, 1.5)]
    np.testing.assert_allclose(path.pose.position[stops], position, rtol=1e-15, atol=1e-15)
    z, y, x = (Rotation.from_rotvec(np.eye(3)[k] * a) for k, a in ((2, np.pi / 9), (1, -0.1), (0, 0.3)))
    expected = [Rotation.identity(), z * y * x, Rotation.from_quat([0, 0, 0.6, 0.8]), Rotation.from_rotvec([0.5, 0, 0])]
    for k, rotation in zip(stops, expected, strict=True):
        assert (path.pose.rotation[int(k)] * rotation.inv()).magnitude() < 1e-14


def test_limits_with_units(tmp_path: FilePath) -> None:
    text = """\
speed: 2 km/hour
acceleration: 100 cm/s^2
angular_speed: 30 deg/s
angular_acceleration: 10
waypoints: [{position: [0, 0, 1]}, {position: [1, 0, 1], euler: {alpha: 3 deg}}, {position: [1, 0, 1]}]
"""
    path = load_path(str(write(tmp_path, "tour.yml", text)))
    by_speed, by_angular_speed = 15 / 8 * 1.0 / (2 / 3.6), 15 / 8 * 3.0 / 30.0
    by_angular_acceleration = np.sqrt(10 / np.sqrt(3) * np.radians(3.0) / 10.0)
    assert path.duration == pytest.approx(by_speed + max(by_angular_speed, by_angular_acceleration), rel=1e-12)
    assert path.time[1] == 0.01


def test_the_profile_is_quintic_unless_the_file_says_septic(tmp_path: FilePath) -> None:
    plain, named, smooth = (
        load_path(write(tmp_path, "tour.yaml", line + WAYPOINTS))
        for line in ("", "profile: quintic\n", "profile: septic\n")
    )
    np.testing.assert_array_equal(plain.twist, named.twist)
    middle = 50  # of the first segment: 15/8 and 35/16 of the mean speed
    np.testing.assert_allclose(smooth.twist[middle], 7 / 6 * plain.twist[middle], rtol=1e-12)
    assert plain.twist[middle].any()
    with refused("profile", "'cubic'", "'quintic' or 'septic'", kind=FileError):
        load_path(write(tmp_path, "tour.yaml", "profile: cubic\n" + WAYPOINTS))


@pytest.mark.parametrize(
    ("limits", "duration"),
    [
        # a distance of 1 m and a rotation of 0.3 rad: 15/8 distance/speed, sqrt(10/sqrt(3) distance/acceleration)
        ("speed: 50 cm/s\nangular_speed: 5 turn/s", 15 / 8 / 0.5),
        ("speed: 9 km/s\nangular_speed: 30 deg/s", 15 / 8 * 0.3 / np.radians(30.0)),
        ("acceleration: 80 cm/s^2\nangular_speed: 5 turn/s", np.sqrt(10 / np.sqrt(3) / 0.8)),
        ("speed: 9 km/s\nangular_acceleration: 40 deg/s^2", np.sqrt(10 / np.sqrt(3) * 0.3 / np.radians(40.0))),
        ("durations: 0.05 min", 3.0),
    ],
)
def test_every_limit_is_read_in_its_unit(tmp_path: FilePath, limits: str, duration: float) -> None:
    way = "waypoints: [{position: [0, 0, 1]}, {position: [1, 0, 1], euler: {alpha: 0.3}}]"
    path = load_path(write(tmp_path, "tour.yaml", f"rate: 30000 1/min\n{limits}\n{way}\n"))
    assert path.duration == pytest.approx(duration, rel=1e-12)
    assert path.time[1] == pytest.approx(1 / 500, rel=1e-12)


def test_a_quaternion_of_few_decimals(tmp_path: FilePath) -> None:
    text = "durations: 1\nwaypoints: [{position: [0, 0, 1]}, {position: [0, 0, 1], quaternion: [0.707, 0, 0, 0.707]}]"
    path = load_path(write(tmp_path, "tour.yaml", text))
    np.testing.assert_allclose(path.pose.rotation[100].as_rotvec(), [np.pi / 2, 0.0, 0.0], atol=1e-15)


CIRCLE = np.linspace(0.0, 2.0, 201)


def circle(header: str, columns: list[np.ndarray]) -> str:
    rows = (",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True))
    return header + "\n" + "\n".join(rows) + "\n"


def test_table_without_orientation(tmp_path: FilePath) -> None:
    columns = [CIRCLE, np.cos(CIRCLE), np.sin(CIRCLE), 0.5 * CIRCLE]
    path = load_path(write(tmp_path, "run.csv", circle("time,x,y,z", columns)))
    np.testing.assert_array_equal(path.time, CIRCLE)
    np.testing.assert_array_equal(path.pose.position, np.stack(columns[1:], axis=-1))
    np.testing.assert_allclose(path.twist[:, 0], -np.sin(CIRCLE), atol=1e-6)
    np.testing.assert_allclose(path.twist[:, 1], np.cos(CIRCLE), atol=1e-6)
    np.testing.assert_allclose(path.twist[:, 2:], np.tile([0.5, 0.0, 0.0, 0.0], (201, 1)), atol=1e-12)
    np.testing.assert_allclose(path.twist_rate[:, 0], -np.cos(CIRCLE), atol=2e-4)


def test_table_with_units_angles_and_columns_in_any_order(tmp_path: FilePath) -> None:
    header = "z [cm], alpha [deg],time [ms],beta,gamma [mrad],x [mm],y"
    zero = np.zeros_like(CIRCLE)
    columns: list[np.ndarray] = [100 * CIRCLE, 90 * CIRCLE, 1000 * CIRCLE, zero, zero + 500.0, 1000 * CIRCLE**2, zero]
    path = load_path(write(tmp_path, "run.csv", circle(header, columns)))
    np.testing.assert_allclose(path.time, CIRCLE, rtol=1e-15)
    np.testing.assert_allclose(path.pose.position, np.stack([CIRCLE**2, zero, CIRCLE], axis=-1), rtol=1e-14)
    # alpha is a rotation about z of the world, for any constant gamma
    np.testing.assert_allclose(path.twist[:, 3:], np.tile([0.0, 0.0, np.pi / 2], (201, 1)), atol=1e-6)
    first = Rotation.from_rotvec([0.5, 0.0, 0.0])
    assert (path.pose.rotation[0] * first.inv()).magnitude() < 1e-14
    np.testing.assert_allclose(path.twist_rate[:, 0], 2.0, atol=1e-8)


def test_table_with_quaternions_of_few_decimals(tmp_path: FilePath) -> None:
    half = 0.35 * CIRCLE
    zero = np.zeros_like(CIRCLE)
    columns: list[np.ndarray] = [
        CIRCLE,
        zero,
        zero,
        zero,
        np.round(np.sin(half), 4),
        zero,
        zero,
        np.round(np.cos(half), 4),
    ]
    path = load_path(write(tmp_path, "run.csv", circle("time,x,y,z,qx,qy,qz,qw", columns)))
    np.testing.assert_allclose(path.pose.rotation.as_rotvec()[:, 0], 0.7 * CIRCLE, atol=2e-4)
    np.testing.assert_allclose(np.linalg.norm(path.pose.quaternion, axis=1), 1.0, rtol=1e-15)


def test_table_as_a_spreadsheet_saves_it(tmp_path: FilePath) -> None:
    text = "\ufefftime,x,y,z\r\n0,1,2,3\r\n\r\n0.5,1,2,4\r\n,,,\r\n"
    file = tmp_path / "run.CSV"
    file.write_bytes(text.encode())
    path = load_path(file)
    np.testing.assert_array_equal(path.pose.position, [(1.0, 2.0, 3.0), (1.0, 2.0, 4.0)])
    np.testing.assert_allclose(path.twist[:, 2], 2.0, rtol=1e-15)


def test_a_truncated_number_in_the_last_row_is_refused(tmp_path: FilePath) -> None:
    with refused("line 3", "3 columns", "4, as in the header", kind=FileError):
        load_path(write(tmp_path, "run.csv", "time,x,y,z\n0,1,2,3\n0.5,1,2."))


HEAD = "durations: 1\nwaypoints:\n"
TWO = "  - position: [0, 0, 1]\n  - position: [1, 0, 1]\n"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("duration: 1\nwaypoints:\n" + TWO, ("duration", "an unknown key", None, "Did you mean durations?")),
        (HEAD + "  - positon: [0, 0, 1]\n", ("waypoints[0].positon", "an unknown key")),
        (
            HEAD + TWO + "    euler: {alfa: 1}\n",
            ("waypoints[1].euler.alfa", "an unknown key", "alpha, beta, gamma"),
        ),
        (HEAD + TWO + "    euler: [1, 2, 3]\n", ("waypoints[1].euler", "[1, 2, 3]")),
        (HEAD + "  - euler: {alpha: 1}\n", ("waypoints[0].position", "missing")),
        ("durations: 1\n", ("waypoints", "missing")),
        ("durations: 1\nwaypoints: 5\n", ("waypoints", "5")),
        (HEAD + TWO + "  - [1, 2, 3]\n", ("waypoints[2]", "[1, 2, 3]")),
        (HEAD + "  - position: [0, 0, 1]\n", ("waypoints", "of shape (1,)")),
        ("durations: 1\nwaypoints: []\n", ("waypoints", "of shape (0,)")),
        (HEAD + TWO + "  - position: [0, 1]\n", ("waypoints[2].position", "of shape (2,)")),
        (HEAD + TWO + "  - position: [[0, 1, 2]]\n", ("waypoints[2].position", "of shape (1, 3)")),
        (HEAD + TWO + "  - position: [0, 1, [2]]\n", ("waypoints[2].position", "[0.0, 1.0, [2.0]]")),
        (HEAD + TWO + "  - position: [0, 5 kg, 1]\n", ("waypoints[2].position[1]", "'5 kg'")),
        (HEAD + TWO + "  - position: [0, .nan, 1]\n", ("waypoints[2].position[1]", "nan")),
        (HEAD + TWO + "  - position: [0, .inf, 1]\n", ("waypoints[2].position[1]", "inf m")),
        (HEAD + TWO + "  - position: [0, true, 1]\n", ("waypoints[2].position[1]", "True")),
        (HEAD + TWO + "    euler: {beta: 5 m}\n", ("waypoints[1].euler.beta", "'5 m'")),
        (HEAD + TWO + "    quaternion: [0, 0, 0, 0]\n", ("the length of waypoints[1].quaternion", "0")),
        (HEAD + TWO + "    quaternion: [0, 0, 1]\n", ("waypoints[1].quaternion", "of shape (3,)")),
        (
            HEAD + TWO + "    quaternion: [0, 0, 0, 1]\n    euler: {alpha: 1}\n",
            ("waypoints[1]", "given with euler and quaternion"),
        ),
        ("durations: 0 s\nwaypoints:\n" + TWO, ("durations", "0 s", "> 0 s, finite")),
        ("durations: [1, 2]\nwaypoints:\n" + TWO, ("durations", "of shape (2,)")),
        ("durations: 5 mm\nwaypoints:\n" + TWO, ("durations", "'5 mm'")),
        ("durations: 1\nspeed: 1\nwaypoints:\n" + TWO, ("the timing of the path", "given by durations and speed")),
        ("waypoints:\n" + TWO, ("the timing of the path", "missing")),
        ("speed: 1 m\nwaypoints:\n" + TWO, ("speed", "'1 m'")),
        ("speed: -1 m/s\nwaypoints:\n" + TWO, ("speed", "-1 m/s", "> 0 m/s, finite")),
        ("speed: 1\nwaypoints:\n" + TWO + "  - position: [1, 0, 1]\n", ("waypoints[2]", "the same as waypoints[1]")),
        ("rate: 0\n" + HEAD + TWO, ("rate", "0 1/s", "> 0 1/s, finite")),
    ],
)
def test_an_invalid_waypoint_file_is_reported_with_file_and_key(
    tmp_path: FilePath, text: str, parts: tuple[str, ...]
) -> None:
    with refused(*parts, kind=FileError, file=tmp_path / "tour.yaml"):
        load_path(write(tmp_path, "tour.yaml", text))


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("time,x,y\n0,1,2\n", ("line 1", "missing column z; found: time, x, y")),
        ("time,x,y,z,aplha\n", ("line 1", "unknown column 'aplha' (did you mean alpha?)")),
        ("\ntime (s),x,y,z\n", ("line 2", "unknown column 'time (s)' (did you mean time?)")),
        ("0,1,2,3\n1,1,2,3\n", ("line 1", "unknown column '0'")),
        ("time,x,y,z,x\n", ("line 1", "column x is given twice")),
        ("time,x,y,z,alpha,beta\n", ("line 1", "missing column gamma; found: time, x, y, z, alpha, beta")),
        ("time,x,y,z,qx,qy,qz\n", ("line 1", "missing column qw; found: time, x, y, z, qx, qy, qz")),
        ("time,x,y,z,alpha,beta,gamma,qx\n", ("line 1", "columns qx beside alpha, beta, gamma")),
        ("time [mm],x,y,z\n", ("line 1", "the unit of time is [mm]", "a unit that converts to s")),
        ("time,x,y,z,qx [m],qy,qz,qw\n", ("line 1", "the unit of qx is [m]", "none")),
        ("time,x,y,z\n0,1,2,3\n\n0.1,1,2\n", ("line 4", "3 columns", "4, as in the header")),
        ("time,x,y,z\n0,1,2,3\n0.1,1,2,3,4\n", ("line 3", "5 columns", "4, as in the header")),
        ("time,x,y,z\n0,1,2,3\n0.1,1,two,3\n", ("line 3", "y is two", "a number")),
        ("time,x,y,z\n0,1,2,3\n0.1,1,,3\n", ("line 3", "y is empty", "a number")),
        ("time,x,y,z\n0,1,2,3\n\n0.1,1,nan,3\n", ("line 4", "y is nan m", "a finite number")),
        (
            "time,x,y,z\n0,1,2,3\n0.2,1,2,3\n\n0.1,1,2,3\n",
            ("line 5", "time is 0.1 s", "a time after the time of the previous row"),
        ),
        ("time,x,y,z\n0,1,2,3\n0,1,2,3\n", ("line 3", "time is 0 s")),
        ("time,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,0\n", ("line 3", "the length of qx, qy, qz, qw is 0")),
        ("time,x,y,z\n0,1,2,3\n", ("number of samples", "1", "at least two")),
        ('time,x,y,z\n0,1,2,"3\n', ("line 2", "it is not CSV (unexpected end of data)")),
        (",,,\n", ("columns",)),
        ("", ("columns",)),
    ],
)
def test_an_invalid_table_is_reported_with_file_and_line(tmp_path: FilePath, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError, file=tmp_path / "run.csv"):
        load_path(write(tmp_path, "run.csv", text))


@pytest.mark.parametrize("name", ["a.yaml", "a.csv"])
def test_paths_that_are_not_files(tmp_path: FilePath, name: str, snapshot: SnapshotAssertion) -> None:
    (tmp_path / f"bytes_{name}").write_bytes(bytes(range(256)) * 4)
    (tmp_path / f"folder_{name}").mkdir()
    for file in (name, f"bytes_{name}", f"folder_{name}"):
        with refused(kind=FileError, file=tmp_path / file) as caught:
            load_path(tmp_path / file)
        assert wording(caught.value, tmp_path) == snapshot


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", (None, "is empty")),
        ("durations: 1\nwaypoints:\n  - {position: [0, 0", ("line 3",)),
        ("durations: 1\ndurations: 2\nwaypoints: []\n", ("line 2", "line 2: key durations is given twice")),
        ("- 1\n- 2\n", (None, "has no keys at its top level")),
    ],
)
def test_text_other_than_a_waypoint_file(tmp_path: FilePath, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError):
        load_path(write(tmp_path, "a.yaml", text))


def test_another_suffix_is_refused(tmp_path: FilePath) -> None:
    with refused("the suffix", ".txt", ".yaml, .yml, .csv, .ngc, .nc, .tap, .gcode, .gco", kind=FileError):
        load_path(write(tmp_path, "run.txt", "time,x,y,z\n0,1,2,3\n1,1,2,3\n"))


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            "time,x,y,z\n0,0,1,5,2,5,3,5\n",
            ("line 2", "8 columns", "4, as in the header, and decimal points, or semicolons between the columns"),
        ),
        ('time,x,y,z\n0,"1,5",2,3\n', ("line 2", "x is 1,5", "a number with a point, not a comma")),
        ("time [],x,y,z\n", ("line 1", "the unit of time is []", "a unit that converts to s")),
        ("time [ ],x,y,z\n", ("line 1", "the unit of time is [ ]")),
        ("time,x [5],y,z\n", ("line 1", "the unit of x is [5]")),
        ("time,x,y,z\n0,1:30,2,3\n", ("line 2", "x is 1:30", "a number")),
        ("time,x,y,z\n0,1_0,2,3\n", ("line 2", "x is 1_0", "a number")),
        ("time,x,y,z\n0,٣,2,3\n", ("line 2", "x is ٣", "a number")),
        ("time,x,y,z\n0,0x10,2,3\n", ("line 2", "x is 0x10", "a number")),
        ("time,x,y,z\n0,1e308,2,3\n", ("line 2", "x is 1e+308 m", "numbers up to 1e+50 m")),
        ("time,x,y,z\n0,1e999,2,3\n", ("line 2", "x is inf m", "a finite number")),
        (
            "time,x,y,z\n0,1,2,3\n1e-15,1,2,3\n",
            ("line 3", "time is 1e-15 s", "a time after the time of the previous row"),
        ),
        (
            "position,x,y,z\n",
            ("line 1", "unknown column 'position'", "time, x, y, z, alpha, beta, gamma, qx, qy, qz, qw"),
        ),  # without "did you mean"
    ],
)
def test_tables_in_other_styles(tmp_path: FilePath, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError, file=tmp_path / "run.csv"):
        load_path(write(tmp_path, "run.csv", text))


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            "nothere: 1\nwaypoints: []\n",
            (
                "nothere",
                "an unknown key",
                (
                    "rate, durations, speed, acceleration, angular_speed, angular_acceleration, "
                    "profile, waypoints, calibration"
                ),
            ),
        ),
        (
            "durations: 1:30\nwaypoints:\n" + TWO,
            ("durations", "'1:30'", 'a number in s, or text with a unit that converts to it, such as "1.5 s"'),
        ),
        ("durations: 1_000\nwaypoints:\n" + TWO, ("durations", "'1_000'")),
        ("durations: 1e308\nwaypoints:\n" + TWO, ("durations", "1e+308", "numbers up to 1e+50 s")),
        ("durations: 1e-320\nwaypoints:\n" + TWO, ("durations", "9.99989e-321 s", "> 0 s, 1e-50 to 1e+50 s, finite")),
        (
            "rate: null\n" + HEAD + TWO,
            ("rate", "None", 'a number in 1/s, or text with a unit that converts to it, such as "1.5 1/s"'),
        ),
        (
            "rate: 100 rad/s\n" + HEAD + TWO,
            ("rate", "'100 rad/s'", 'a number in 1/s, or text with a unit that converts to it, such as "1.5 1/s"'),
        ),
        ("rate: 1e12\n" + HEAD + TWO, ("the number of samples", "1e+12 (1 s at 1e+12 1/s)")),
        (HEAD + TWO + "  - position: [0, yes, 1]\n", ("waypoints[2].position[1]", "'yes'")),
    ],
)
def test_waypoints_in_other_styles(tmp_path: FilePath, text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError, file=tmp_path / "tour.yaml") as caught:
        load_path(write(tmp_path, "tour.yaml", text))
    assert "mean" not in caught.value.next_step


def test_a_rate_too_small_for_a_sample_between_is_refused(tmp_path: FilePath) -> None:
    with refused(value="1 s, without a sample inside", kind=FileError):
        load_path(write(tmp_path, "tour.yaml", "rate: 1e-40\n" + HEAD + TWO))
