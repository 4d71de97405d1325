"""Interpreter of G-code: the words of each line, the modal state, and the moves of a program in SI units."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from math import atan2, dist, hypot, tau
from pathlib import Path
from typing import Final, Literal, NamedTuple, NoReturn, cast

from sagline.core.arrays import FARTHEST
from sagline.core.errors import FileError, printable
from sagline.files.table import line_error
from sagline.motion.contour import EXACT_STOP, LEAST, MoveRow, Moves, Point

Dialect = Literal["linuxcnc", "marlin"]

BATCH: Final = 8192  # number of moves per block
_DWELL: Final = MoveRow._fields.index("dwell")
OFFSETS: Final = ("G54", "G55", "G56", "G57", "G58", "G59")
_LINE: Final = re.compile(r"[^\n]*\n?")
_COMMENT: Final = re.compile(r"\([^()]*\)|;.*")
_WORD: Final = re.compile(r"([A-Z])[ \t]*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))[ \t]*")
_WORDS: Final = re.compile(f"(?:{_WORD.pattern})*")
_CHECKSUM: Final = re.compile(r"\*[0-9]+$")
_GROUPS: Final = {  # modal group of each supported G word; "none": words without effect
    "motion": "0 1 2 3 80",
    "plane": "17 18 19",
    "units": "20 21",
    "distance": "90 91",
    "arc distance": "90.1 91.1",
    "feed": "93 94",
    "offset": "54 55 56 57 58 59",
    "corner": "61 61.1 64",
    "action": "4 28 29 30 53 92 92.1 92.2 92.3",
    "none": "40 49 97 98 99",
}
GROUP: Final = {float(word): group for group, words in _GROUPS.items() for word in words.split()}
SUPPORTED: Final = "G0-G4, G17-G21, G28, G40, G49, G53-G59, G61, G64, G80, G90-G94, G97"
_USED: Final = "XYZIJKRFPSTN"  # letters of words in addition to G and M, and E with "marlin"
_PLANES: Final = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}  # axes of the plane, right-handed, then its normal
_OTHER_MOTION: Final = (97, 98, 99)  # M words that run other parts of a program
_ALLOWED_RADII: Final = (5e-6, 1e-3)  # largest difference of the radii at both ends of an arc: [m], or relative
_FEEDS: Final = (1e-9, 1e9)  # smallest and largest F
_FULL: Final = 1e-9  # [rad], an arc with a smaller angle is a full circle
_MOST_TURNS: Final = 1e6


class Settings(NamedTuple):
    """Properties of the machine that a program does not state."""

    rapid: float  # speed of G0 [m/s]
    tolerance: float  # tolerance of corners with G64 and by default [m]
    offsets: dict[str, Point]  # origins of work coordinates [m], by G word
    start: Point | None  # position before the first line [m]
    dialect: Dialect


def program_moves(path: Path, text: str, settings: Settings) -> Iterator[Moves]:
    """Moves of a program in blocks; `path`: the file, for messages."""
    program = _Program(path, settings)
    for number, found in enumerate(_LINE.finditer(text), 1):
        program.line = number
        if not program.read(found[0]):
            break
        if len(program.rows) >= BATCH * len(MoveRow._fields):
            yield program.moves()
    if not program.moved:
        step = "Check that this is the file you mean."
        raise FileError(path, "has no motion; a program needs a G0, G1, G2 or G3 that moves", step)
    yield program.moves()


class _Program:
    """State of the interpreter, and the moves since the last block."""

    def __init__(self, path: Path, settings: Settings) -> None:
        """Start with G17, G21, G90, G91.1, G94, G54, and with the tolerance of the settings."""
        self.path, self.settings = path, settings
        self.line = 0
        self.position = settings.start
        self.block_start = settings.start or (0.0, 0.0, 0.0)
        self.motion: float | None = None
        self.plane, self.unit, self.absolute, self.absolute_arcs, self.inverse_time = 17, 1e-3, True, False, False
        self.feed: float | None = None  # [m/s], or [1/s] with G93
        self.offset = settings.offsets.get("G54", (0.0, 0.0, 0.0))
        self.shift, self.kept_shift = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]  # of G92 [m]
        self.tolerance = settings.tolerance
        self.homed = 0  # line of the last G28, G29 or G30
        self.begun = self.moved = False
        self.waiting = 0.0  # dwells before the position is known [s]
        self.rows = array("d")

    def refuse(self, reason: str) -> NoReturn:
        """Raise the error of the current line."""
        raise line_error(self.path, self.line, reason)

    # words

    def read(self, raw: str) -> bool:
        """Execute a line. False at the end of the program."""
        text = raw.strip().upper()
        if ";" in text or "(" in text:
            text = _COMMENT.sub("", text)
        if text == "%":
            begun, self.begun = self.begun, True
            return not begun
        text = text.removeprefix("/").strip()
        if self.settings.dialect == "marlin":
            text = _CHECKSUM.sub("", text)
            if command := re.fullmatch(r"(?:N *[0-9]+ *)?(M *[0-9].*)", text):
                return self._command_of_printer(command[1])
        if not text:
            return True
        self.begun = True
        if not _WORDS.fullmatch(text):
            self._refuse_text(text)
        return self._execute(_WORD.findall(text))

    def _refuse_text(self, text: str) -> NoReturn:
        match = _WORDS.match(text)
        rest = printable(text[match.end() if match else 0 :][:20])
        if rest[0] in "()":
            self.refuse("a comment without its other parenthesis; allowed: (comment), or ; comment")
        if rest[0] in "#[" or rest[1:2] in ("#", "["):
            self.refuse(f"{rest} is a parameter or an expression; allowed: numbers")
        if found := re.match(r"(?:N *[0-9]+ *)?(O.*)", text):
            self.refuse(
                f"{printable(found[1][:20])} is a subroutine; allowed: the lines of the subroutine in its place"
            )
        self.refuse(f"{rest!r} is not a word of G-code; allowed: a letter and a number, such as X12.5")

    def _command_of_printer(self, text: str) -> bool:
        """Ignore an M word of a 3D printer with its arguments, which may be text; refuse a change of the feed."""
        code = int(re.match(r"M *([0-9]{1,9})", text)[1])  # type: ignore[index]
        if code == 220 and not re.search(r"S100(\.0*)?(?![0-9])", text):
            self.refuse(f"{printable(text[:20])} changes the feed; allowed: M220 S100")
        return self._command(code)

    def _command(self, code: float) -> bool:
        """Ignore an M word. False for the end of the program."""
        if code in _OTHER_MOTION:
            self.refuse(f"M{code:g} is a call of a subprogram; allowed: the lines of the subprogram in its place")
        return code not in (2, 30)

    def _execute(self, found: list[tuple[str, str]]) -> bool:
        words: dict[str, float] = {}
        modes: dict[str, float] = {}
        ends = False
        for letter, text in found:
            value = float(text)
            if letter == "G":
                group = GROUP.get(value)
                if group is None:
                    if self.settings.dialect == "marlin" and value in (10, 11):  # retraction by firmware
                        continue
                    self.refuse(f"G{value:g} is not supported; allowed: {SUPPORTED}")
                if modes.setdefault(group, value) != value and group != "none":
                    self.refuse(f"G{modes[group]:g} and G{value:g} exclude each other; allowed: one of them")
            elif letter == "M":
                ends |= not self._command(value)
            elif letter == "E" and self.settings.dialect == "marlin":
                words[letter] = value
            elif letter not in _USED:
                printer = ", and E for printers" * (letter == "E")
                self.refuse(f"the word {letter}{text} is not supported; allowed: G, M, {', '.join(_USED)}{printer}")
            elif letter in words:
                self.refuse(f"{letter} is given twice; allowed: once")
            else:
                words[letter] = value
        self._set_modes(modes, words)
        action = modes.get("action")
        if action is not None and action != 53:
            if "motion" in modes:
                self.refuse(f"G{action:g} beside G{modes['motion']:g}; allowed: one of them on a line")
            self._act(action, words)
        else:
            self._move(modes.get("motion", self.motion), words, action == 53)
        self.motion = modes.get("motion", self.motion)
        return not ends

    def _set_modes(self, modes: dict[str, float], words: dict[str, float]) -> None:
        if "units" in modes:
            self.unit = 25.4e-3 if modes["units"] == 20 else 1e-3
        if "feed" in modes and self.inverse_time != (modes["feed"] == 93):
            self.inverse_time, self.feed = not self.inverse_time, None
        if self.inverse_time:
            self.feed = None  # each move needs its own
        if "F" in words:
            value = words["F"]
            if not _FEEDS[0] <= value <= _FEEDS[1]:
                self.refuse(f"F is {value:g}; allowed: {_FEEDS[0]:g} to {_FEEDS[1]:g}")
            self.feed = value / 60.0 if self.inverse_time else value * self.unit / 60.0
        self.plane = int(modes.get("plane", self.plane))
        if "offset" in modes:
            self.offset = self.settings.offsets.get(f"G{modes['offset']:g}", (0.0, 0.0, 0.0))
        if "distance" in modes:
            self.absolute = modes["distance"] == 90
        if "arc distance" in modes:
            self.absolute_arcs = modes["arc distance"] == 90.1
        if "corner" in modes:
            self.tolerance = {61.0: 0.0, 61.1: EXACT_STOP, 64.0: self.settings.tolerance}[modes["corner"]]
            if modes["corner"] == 64 and "P" in words:
                self.tolerance = self._length("P", words["P"])
                if self.tolerance < 0.0:
                    self.refuse(f"P of G64 is {words['P']:g}; allowed: >= 0")

    def _length(self, letter: str, value: float) -> float:
        """Length of a word [m]."""
        length = value * self.unit
        if not abs(length) <= FARTHEST:
            self.refuse(f"{letter} is {length:g} m; allowed: up to {FARTHEST:g} m")
        return length

    # actions and motions

    def _act(self, action: float, words: dict[str, float]) -> None:
        """Dwell, change of the coordinates by G92, or reference motion."""
        if action == 4:
            self._dwell(words)
        elif action in (28, 29, 30):
            self.homed = self.line if self.moved else 0
            if not self.moved:  # the rows contain dwells only
                self.waiting += sum(self.rows[_DWELL :: len(MoveRow._fields)])
                self.position, self.rows = self.settings.start, array("d")
        elif action == 92:
            given = [axis for axis, letter in enumerate("XYZ") if letter in words]
            if not given and "E" not in words:
                self.refuse("G92 without X, Y or Z; allowed: at least one of them")
            position = self._known() if given else (0.0, 0.0, 0.0)
            for axis in given:
                self.shift[axis] = position[axis] - self.offset[axis] - self._length("XYZ"[axis], words["XYZ"[axis]])
        elif action == 92.3:
            self.shift = list(self.kept_shift)
        else:
            self.kept_shift = list(self.shift) if action == 92.2 else [0.0, 0.0, 0.0]
            self.shift = [0.0, 0.0, 0.0]

    def _dwell(self, words: dict[str, float]) -> None:
        printer = self.settings.dialect == "marlin"
        if axes := [letter for letter in "XYZ" if letter in words]:
            self.refuse(f"{axes[0]} beside G4; allowed: P" + " or S" * printer)
        given = "S" if printer and "S" in words else "P"
        if given not in words:
            self.refuse(f"G4 without its time; allowed: P in {'ms, or S in s' if printer else 's'}")
        time = words[given] * (1e-3 if printer and given == "P" else 1.0)
        if not 0.0 <= time <= FARTHEST:
            self.refuse(f"the time of G4 is {time:g} s; allowed: 0 to {FARTHEST:g} s")
        self.waiting += time
        if self.position is not None:
            self._wait()

    def _wait(self) -> None:
        """Append the dwells that wait for a known position."""
        if self.waiting > 0.0:
            row = MoveRow(*self._known(), 0.0, 0.0, 0.0, 0, 0.0, 0.0, EXACT_STOP, self.waiting, self.line)
            self.waiting = 0.0
            self._append(row)

    def _known(self) -> Point:
        """The current position [m]; the origin of the work coordinates before the first motion."""
        if self.position is None:
            origin = (offset + shift for offset, shift in zip(self.offset, self.shift, strict=True))
            self.position = self.block_start = cast(Point, tuple(origin))
        return self.position

    def _target(self, words: dict[str, float], of_machine: bool) -> tuple[Point, bool]:
        """End of a move [m]; and True if it is the start of the path, because no position is known before."""
        begins = self.position is None and self.absolute and not of_machine
        target = list(self._known())
        for axis, letter in enumerate("XYZ"):
            if letter in words:
                length = self._length(letter, words[letter])
                if of_machine:
                    target[axis] = length
                elif self.absolute:
                    target[axis] = length + self.offset[axis] + self.shift[axis]
                else:
                    target[axis] += length
                if not abs(target[axis]) <= FARTHEST:
                    self.refuse(f"{letter} leads to {target[axis]:g} m; allowed: up to {FARTHEST:g} m")
        return cast(Point, tuple(target)), begins

    def _move(self, motion: float | None, words: dict[str, float], of_machine: bool) -> None:
        """Line or arc, if the line of the program has words for one."""
        arc = motion in (2, 3)
        asked = [letter for letter in ("XYZIJKR" if arc else "XYZ") if letter in words]
        if not asked:
            if of_machine:
                self.refuse("G53 without X, Y or Z; allowed: a G0 or G1 with at least one of them")
            return
        if motion is None or motion == 80:
            self.refuse(f"{asked[0]} without a motion; allowed: after G0, G1, G2 or G3")
        if of_machine and arc:
            self.refuse(f"G53 with G{motion:g}; allowed: G0 or G1")
        if surplus := [letter for letter in "IJKR" if letter in words and not arc]:
            self.refuse(f"{surplus[0]} beside G{motion:g}; allowed: X, Y and Z")
        if self.homed:
            self.refuse(
                f"the position after the reference motion of line {self.homed} is not known; allowed: no motion"
            )
        if arc:
            self._arc(motion == 2, words)
            return
        target, begins = self._target(words, of_machine)
        if begins:
            self.position = self.block_start = target
            self._wait()
            return
        self._wait()
        length = dist(self._known(), target)
        speed = self._speed(motion, length)
        self._append(MoveRow(*target, 0.0, 0.0, 0.0, 0, 0.0, speed, self.tolerance, 0.0, self.line), length)

    def _speed(self, motion: float, length: float) -> float:
        """Speed of a move [m/s]."""
        if motion == 0 and (self.settings.dialect == "linuxcnc" or self.feed is None or self.inverse_time):
            return self.settings.rapid
        if self.feed is None:
            where = "on each line with G93" if self.inverse_time else "on this line or before"
            self.refuse(f"G{motion:g} without a feed; allowed: F {where}")
        return self.feed * length if self.inverse_time else self.feed

    def _append(self, row: MoveRow, length: float = 0.0) -> None:
        if length > LEAST or row.dwell:
            self.rows.extend(row)
            self.moved = self.moved or not row.dwell
        self.position = row.x, row.y, row.z

    def _arc(self, clockwise: bool, words: dict[str, float]) -> None:
        name = f"G{2 if clockwise else 3}"
        a, b, n = _PLANES[self.plane]
        if "IJK"[n] in words:
            self.refuse(f"{'IJK'[n]} beside {name} with G{self.plane}; allowed: {'IJK'[a]} and {'IJK'[b]}, or R")
        start = self._known()
        self._wait()
        target, _ = self._target(words, False)
        by_radius = "R" in words
        if by_radius == any("IJK"[axis] in words for axis in (a, b)):
            self.refuse(f"{name} with {'both' if by_radius else 'neither'}; allowed: {'IJK'[a]} and {'IJK'[b]}, or R")
        if by_radius:
            center = self._center_by_radius(name, clockwise, self._length("R", words["R"]), start, target)
        else:
            center = self._center_by_offsets(name, words, start)
        first, last = (hypot(end[a] - center[a], end[b] - center[b]) for end in (start, target))
        difference = abs(first - last)
        if difference > max(_ALLOWED_RADII[0], _ALLOWED_RADII[1] * min(first, last)) or first <= LEAST:
            allowed = f"a difference of {_ALLOWED_RADII[0]:g} m, or of {100 * _ALLOWED_RADII[1]:g} %"
            self.refuse(f"the radii at the ends of {name} are {first:.6g} m and {last:.6g} m; allowed: {allowed}")
        begin, end = (atan2(point[b] - center[b], point[a] - center[a]) for point in (start, target))
        angle = ((begin - end) if clockwise else (end - begin)) % tau
        angle += (tau if angle <= _FULL else 0.0) + tau * (self._turns(words) - 1)
        length = hypot(0.5 * (first + last) * angle, target[n] - start[n])
        speed, signed = self._speed(2 if clockwise else 3, length), -angle if clockwise else angle
        self._append(MoveRow(*target, *center, n, signed, speed, self.tolerance, 0.0, self.line), length)

    def _turns(self, words: dict[str, float]) -> float:
        """Number of turns of an arc, also begun ones."""
        turns = words.get("P", 1.0)
        if not (1.0 <= turns <= _MOST_TURNS and turns == int(turns)):
            self.refuse(f"P of an arc is {turns:g}; allowed: a whole number from 1 to {_MOST_TURNS:g}, the turns")
        return turns

    def _center_by_offsets(self, name: str, words: dict[str, float], start: Point) -> Point:
        """Center of an arc from I, J and K [m]."""
        center = list(start)
        for axis in _PLANES[self.plane][:2]:
            letter = "IJK"[axis]
            if letter in words:
                length = self._length(letter, words[letter])
                center[axis] = length + (self.offset[axis] + self.shift[axis] if self.absolute_arcs else start[axis])
            elif self.absolute_arcs:
                self.refuse(f"{name} without {letter} with G90.1; allowed: both coordinates of the center")
        return cast(Point, tuple(center))

    def _center_by_radius(self, name: str, clockwise: bool, radius: float, start: Point, target: Point) -> Point:
        """Center of an arc with the radius R [m]; R < 0 means the arc of more than 180 degrees."""
        a, b, _ = _PLANES[self.plane]
        across, up = target[a] - start[a], target[b] - start[b]
        chord = hypot(across, up)
        if chord <= LEAST:
            self.refuse(f"{name} with R ends where it starts; allowed: another end, or a full circle by I, J and K")
        rest = radius * radius - 0.25 * chord * chord
        if rest < 0.0 and 0.5 * chord - abs(radius) > max(_ALLOWED_RADII[0], _ALLOWED_RADII[1] * abs(radius)):
            self.refuse(f"R of {name} is {radius:g} m; allowed: at least {0.5 * chord:.6g} m, half the chord")
        height = max(rest, 0.0) ** 0.5 / chord
        if clockwise == (radius > 0.0):
            height = -height
        center = list(start)
        center[a] += 0.5 * across - height * up
        center[b] += 0.5 * up + height * across
        return cast(Point, tuple(center))

    def moves(self) -> Moves:
        """The moves since the last block; the next block begins."""
        found = Moves.of_rows(self.rows, self.block_start)
        self.rows, self.block_start = array("d"), self.position or self.block_start
        return found
