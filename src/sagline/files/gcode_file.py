"""Programs in G-code as paths of the platform: the whole path, or its parts one after another."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import Any, Final, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, check_memory, choice, file_path
from sagline.core.arrays import FARTHEST, Array, Indices, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.files.gcode_program import OFFSETS, Dialect, Settings, program_moves
from sagline.files.reading import read_text
from sagline.files.table import line_error
from sagline.motion.contour import Point, Samples, samples_along
from sagline.motion.path import Path
from sagline.motion.rest_to_rest import MOST_SAMPLES, SAMPLE_BYTES
from sagline.robot.pose import Pose

GCODE_LIMIT: Final = 256.0  # largest size [MB]
PRINTER_SUFFIXES: Final = (".gcode", ".gco")
SUFFIXES: Final = (".ngc", ".nc", ".tap", *PRINTER_SUFFIXES)
RAPID: Final = 0.5  # default speed of G0 [m/s]
ACCELERATION: Final = 1.0  # default acceleration [m/s^2]
RATE: Final = 100.0  # default samples per second [1/s]


class ProgramPart(NamedTuple):
    """A part of the path of a program.

    Attributes:
        path: The samples of the part, at most 65,536.
        line: Line of the program that moves the platform at each sample, from 1, shape (N,).
    """

    path: Path
    line: Indices


def load_gcode(
    file: str | os.PathLike[str],
    *,
    rapid: float = RAPID,
    acceleration: float = ACCELERATION,
    tolerance: float = 0.0,
    offsets: Mapping[str, ArrayLike] | None = None,
    start: ArrayLike | None = None,
    dialect: Dialect | None = None,
    rate: float = RATE,
) -> Path:
    """Read a program in G-code (RS-274) as a path of the platform's origin, without rotation.

    **Words.** Motions G0 to G3 with X, Y, Z; arcs and helices with I, J, K or R, with P turns; planes G17 to G19; units
    G20 and G21; G90 and G91, for arc centers G90.1 and G91.1; feeds F with G93 and G94; work coordinates G54 to G59,
    G53 and G92; dwells G4; corners G61, G61.1 and G64 P. Comments, line numbers, M, S, T and E words are ignored;
    lines that begin with / are executed; M2 and M30 end the program. Any other word is refused with its line: tool
    offsets, canned cycles, subroutines, parameters, rotary axes.

    **Speed.** The platform moves at the feed. It slows down where the acceleration requires this: the accelerations
    along the path and toward the center of an arc are at most `acceleration` each.

    **Corners.** A change of direction up to 0.01 rad is passed without a stop, as an arc over half of the shorter line
    would be. At any other corner the platform stops.
    With `tolerance` > 0, or after G64 P, a corner of two lines is rounded by an arc instead, at most this distance from
    the corner; the arc takes at most half of each line. G61 ends this, and G61.1 stops after every motion.

    **Start.** The path begins at `start`. Without it, a first G0 or G1 with G90 only names the start of the path; axes
    that it does not name begin at 0 of the work coordinates. Reference motions (G28, G29, G30) are ignored before
    the first motion and after the last one; between motions they are refused.

    Args:
        file: The file.
        rapid: Speed of G0 [m/s], > 0.
        acceleration: Largest acceleration [m/s^2], > 0.
        tolerance: Largest distance of a rounded corner from its arc [m], >= 0, before G61 and after G64 without P.
        offsets: Origins of the work coordinates in world axes [m], such as `{"G54": (0, 0, 1)}`, shape (3,) each; zero
            for a name that is left out.
        start: Position before the first line in world axes [m], shape (3,).
        dialect: "linuxcnc": P of G4 is in seconds, and G0 moves at `rapid`. "marlin", for 3D printers: P of G4 is in
            milliseconds, S in seconds, and G0 moves at the feed. None: "marlin" for .gcode and .gco.
        rate: Samples per second [1/s], > 0.

    Returns:
        Path that starts at time 0 and ends at rest. Its rests are the stops. Shorter moves than 1/rate can be between
        two samples.

    Raises:
        FileError: If the file cannot be read, or contains an unsupported word or a wrong number; the message names the
            line.
        InvalidValueError: If an argument is wrong, or if the path needs more memory than is free: see `gcode_parts`.

    Source:
        Kramer, Proctor and Messina, The NIST RS274NGC Interpreter, NISTIR 6556, 2000; the words of LinuxCNC and Marlin.

    Examples:
        >>> import sagline as sl
        >>> path = sl.load_gcode("part.ngc", offsets={"G54": (0, 0, 1)})  # doctest: +SKIP
    """
    count, found = 0, list[Samples]()
    for part in _samples(file, rapid, acceleration, tolerance, offsets, start, dialect, rate):
        count += len(part.time)
        check_memory(f"a path of {count:,} or more samples", SAMPLE_BYTES * count, "Use gcode_parts, or a lower rate.")
        found.append(part)
    return _path(Samples(*map(np.concatenate, zip(*found, strict=True))), whole=True)


def gcode_parts(
    file: str | os.PathLike[str],
    *,
    rapid: float = RAPID,
    acceleration: float = ACCELERATION,
    tolerance: float = 0.0,
    offsets: Mapping[str, ArrayLike] | None = None,
    start: ArrayLike | None = None,
    dialect: Dialect | None = None,
    rate: float = RATE,
) -> Iterator[ProgramPart]:
    """Parts of the path of `load_gcode` one after another, with the lines of the program, in bounded memory.

    The parts together have the same samples. Loads that change along the program, such as payload and hose, are one
    wrench per sample for `inverse`.

    Args:
        file: The file.
        rapid: See `load_gcode`.
        acceleration: See `load_gcode`.
        tolerance: See `load_gcode`.
        offsets: See `load_gcode`.
        start: See `load_gcode`.
        dialect: See `load_gcode`.
        rate: See `load_gcode`.

    Returns:
        Iterator of the parts. The arguments are checked at once, the lines when their part is due.

    Raises:
        FileError: In the cases listed for `load_gcode`.
        InvalidValueError: If an argument is wrong.

    Examples:
        >>> import sagline as sl
        >>> for part in sl.gcode_parts("house.gcode", tolerance=0.001):  # doctest: +SKIP
        ...     plan = sl.inverse(robot, part.path, wrench=hose_at(part.path.pose))
    """
    samples = _samples(file, rapid, acceleration, tolerance, offsets, start, dialect, rate)
    return (ProgramPart(_path(part), locked(part.line)) for part in samples)


def _samples(
    file: str | os.PathLike[str],
    rapid: float,
    acceleration: float,
    tolerance: float,
    offsets: Mapping[str, ArrayLike] | None,
    start: ArrayLike | None,
    dialect: Dialect | None,
    rate: float,
) -> Iterator[Samples]:
    """Samples of a program; the arguments are checked at once."""
    path = file_path(file)
    if dialect is None:
        dialect = "marlin" if path.suffix.lower() in PRINTER_SUFFIXES else "linuxcnc"
    else:
        dialect = choice(dialect, "dialect", ("linuxcnc", "marlin"))
    settings = Settings(
        number(rapid, "rapid", "m/s", above=0.0),
        number(tolerance, "tolerance", "m", low=0.0),
        {} if offsets is None else _offsets(offsets),
        None if start is None else _point(start, "start"),
        dialect,
    )
    acceleration = number(acceleration, "acceleration", "m/s^2", above=0.0)
    return _read(path, settings, acceleration, number(rate, "rate", "1/s", above=0.0))


def _offsets(offsets: Any) -> dict[str, Point]:
    if not isinstance(offsets, Mapping):
        raise InvalidValueError("offsets", brief(offsets), "a dictionary", 'Give {"G54": (x, y, z)} in m, or None.')
    return {choice(name, "offsets", OFFSETS): _point(point, f"offsets[{name!r}]") for name, point in offsets.items()}


def _point(value: ArrayLike, item: str) -> Point:
    point: Array = exactly(value, item, "m", (3,))
    if (far := np.abs(point) > FARTHEST).any():
        text = f"{point[int(np.argmax(far))]:g} m"
        raise InvalidValueError(item, text, f"up to {FARTHEST:g} m", "Check its unit.")
    return cast(Point, tuple(point.tolist()))


def _read(path: FilePath, settings: Settings, acceleration: float, rate: float) -> Iterator[Samples]:
    text = read_text(path, GCODE_LIMIT)
    try:
        yield from samples_along(program_moves(path, text, settings), acceleration, rate, MOST_SAMPLES / rate)
    except OverflowError as error:
        allowed = f"up to {MOST_SAMPLES:g} at {rate:g} 1/s; check F and the units"
        raise line_error(path, error.args[0], f"the motion needs too many samples; allowed: {allowed}") from None


def _path(samples: Samples, whole: bool = False) -> Path:
    """Path of samples without rotation; with its rests if it is the whole path."""
    pose = Pose(samples.position)
    turning = np.zeros_like(samples.velocity)
    twist, twist_rate = (locked(np.hstack((each, turning))) for each in (samples.velocity, samples.acceleration))
    return Path(locked(samples.time), pose, twist, twist_rate, rests=samples.rests if whole else None)
