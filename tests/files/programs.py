"""Random programs in G-code with their motions, computed by complex numbers; and a generator of a print of any size."""

from __future__ import annotations

from cmath import exp, pi
from collections.abc import Iterator
from math import cos, hypot, sin, sqrt, tau
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array

PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
OFFSETS = {"G54": (0.5, -0.25, 1.0), "G55": (-1.0, 0.0, 2.0), "G57": (0.0, 3.0, 0.125)}


class Motion(NamedTuple):
    """A motion from rest to rest: line, arc or helix, or a dwell of length 0."""

    line: int
    start: Array
    end: Array
    speed: float
    dwell: float = 0.0
    plane: int = 17
    center: complex = 0.0
    angle: float = 0.0

    def at(self, time: float, acceleration: float) -> Array:
        """Position, velocity and acceleration, (3, 3)."""
        length, peak = self.length, self.peak(acceleration)
        ramp, total = peak / acceleration, self.duration(acceleration)
        if self.dwell or not 0.0 <= time <= total:
            return np.array([self.end if time > 0.0 else self.start, np.zeros(3), np.zeros(3)])
        if time < ramp:
            s, v, slope = 0.5 * acceleration * time**2, acceleration * time, acceleration
        elif time < total - ramp:
            s, v, slope = peak * (time - 0.5 * ramp), peak, 0.0
        else:
            left = total - time
            s, v, slope = length - 0.5 * acceleration * left**2, acceleration * left, -acceleration
        along = (self.end - self.start) / length
        found = np.array([self.start + s * along, v * along, slope * along])
        if self.angle:
            a, b, _ = PLANES[self.plane]
            turn = 1j * self.angle / length
            arm = (complex(self.start[a], self.start[b]) - self.center) * exp(turn * s)
            for row, z in enumerate((self.center + arm, turn * v * arm, (turn**2 * v**2 + turn * slope) * arm)):
                found[row, a], found[row, b] = z.real, z.imag
        return found

    def is_steady(self, time: float, acceleration: float) -> bool:
        """True if the acceleration does not jump near the time [s] after the start."""
        ramp, total = self.peak(acceleration) / acceleration, self.duration(acceleration)
        return min(abs(time - each) for each in (0.0, ramp, total - ramp, total)) > 1e-6

    @property
    def radius(self) -> float:
        """Radius of the arc [m]."""
        a, b, _ = PLANES[self.plane]
        return abs(complex(self.start[a], self.start[b]) - self.center)

    @property
    def length(self) -> float:
        """Length [m]: angle times radius, and the rise of a helix."""
        if not self.angle:
            return float(np.linalg.norm(self.end - self.start))
        n = PLANES[self.plane][2]
        return hypot(abs(self.angle) * self.radius, self.end[n] - self.start[n])

    def peak(self, acceleration: float) -> float:
        """Largest speed [m/s]."""
        limits = [self.speed, sqrt(acceleration * self.length)]
        if self.angle:
            limits.append(sqrt(acceleration / self.radius) * self.length / abs(self.angle))
        return min(limits)

    def duration(self, acceleration: float) -> float:
        """Time [s]."""
        if self.dwell:
            return self.dwell
        peak = self.peak(acceleration)
        return self.length / peak + peak / acceleration


class Writer:
    """Writer of random motions in random words of G-code."""

    def __init__(self, seed: int) -> None:
        """Start at the origin of G54."""
        self.rng = np.random.default_rng(seed)
        self.text, self.motions = ["%", "(random) ; program"], list[Motion]()
        self.unit, self.plane, self.offset = 1e-3, 17, np.array(OFFSETS["G54"])
        self.absolute, self.absolute_arcs, self.inverse_time = True, False, False
        self.shift, self.place = np.zeros(3), np.array(OFFSETS["G54"])

    def write(self, motions: int) -> str:
        """Text of a program."""
        self.text.append("G0 X0 Y0 Z0 (the start)")
        while len(self.motions) < motions:
            self._modes()
            (self._straight, self._arc, self._arc, self._dwell)[int(self.rng.integers(4))]()
        return "\n".join([*self.text, "M30", "this line is not read"])

    def _modes(self) -> None:
        rng, words = self.rng, list[str]()
        if rng.random() < 0.2:
            self.unit = rng.choice([1e-3, 25.4e-3])
            words.append("G21" if self.unit == 1e-3 else "G20")
        if rng.random() < 0.3:
            self.plane = int(rng.choice([17, 18, 19]))
            words.append(f"G{self.plane}")
        if rng.random() < 0.2:
            self.absolute = bool(rng.integers(2))
            words.append("G90" if self.absolute else "G91")
        if rng.random() < 0.2:
            self.absolute_arcs = bool(rng.integers(2))
            words.append("g90.1" if self.absolute_arcs else "G91.1")
        if rng.random() < 0.2:
            name = str(rng.choice(["G54", "G55", "G56", "G57"]))
            self.offset = np.array(OFFSETS.get(name, (0.0, 0.0, 0.0)))
            words.append(name)
        if rng.random() < 0.3:
            self.inverse_time = not self.inverse_time
            words.append("G93" if self.inverse_time else "G94")
        if words:
            self.text.append(f"N{rng.integers(10**4)} " + " ".join(words))
        if rng.random() < 0.2:
            axis = int(rng.integers(3))
            value = rng.normal()
            self.shift[axis] = self.place[axis] - self.offset[axis] - value
            self.text.append(f"G92 {'XYZ'[axis]}{self._number(value)}")

    def _number(self, meters: float) -> str:
        return f"{meters / self.unit:.13f}"

    def _end(self, end: Array) -> str:
        value = end - (self.offset + self.shift if self.absolute else self.place)
        moved = np.abs(end - self.place) > 1e-13
        return " ".join(f"{'XYZ'[k]}{self._number(value[k])}" for k in range(3) if moved[k] or self.rng.random() < 0.5)

    def _feed(self, motion: Motion) -> tuple[str, Motion]:
        speed = float(self.rng.uniform(0.05, 2.0))
        value = 60.0 * speed / (motion.length if self.inverse_time else self.unit)
        return f"F{value:.12f}", motion._replace(speed=speed)

    def _add(self, words: str, motion: Motion) -> None:
        feed, motion = self._feed(motion)
        self.text.append(f"{words} {feed}")
        self.motions.append(motion._replace(line=len(self.text)))
        self.place = motion.end

    def _straight(self) -> None:
        end = self.place + self.rng.normal(size=3)
        if self.rng.random() < 0.2:
            words = f"G53 G1 X{self._number(end[0])} Y{self._number(end[1])} Z{self._number(end[2])}"
            if self.absolute:
                self._add(words, Motion(0, self.place, end, 0.0))
            return
        self._add(f"G1 {self._end(end)}", Motion(0, self.place, end, 0.0))

    def _arc(self) -> None:
        rng, (a, b, n) = self.rng, PLANES[self.plane]
        start = complex(self.place[a], self.place[b])
        angle = float(rng.choice([-1, 1]) * rng.choice([rng.uniform(0.1, 2.8), rng.uniform(3.5, 6.0), 2 * pi]))
        arm = rng.uniform(0.1, 1.0) * exp(1j * rng.uniform(0, tau))
        center, by_radius = start - arm, bool(rng.random() < 0.4) and abs(angle) < 6.1
        finish = center + arm * exp(1j * angle)
        turns = int(rng.choice([1, 1, 3]))
        end = self.place.copy()
        end[a], end[b], end[n] = finish.real, finish.imag, end[n] + rng.choice([0.0, rng.normal()])
        if by_radius:
            words = f"R{self._number(abs(arm) if abs(angle) < pi else -abs(arm))}"
        else:
            base = self.offset + self.shift if self.absolute_arcs else self.place
            offsets = (center.real - base[a], center.imag - base[b])
            words = " ".join(f"{'IJK'[k]}{self._number(v)}" for k, v in zip((a, b), offsets, strict=True))
        words += f" P{turns}" * (turns > 1)
        whole = angle + (turns - 1) * (tau if angle > 0 else -tau)
        motion = Motion(0, self.place, end, 0.0, 0.0, self.plane, center, whole)
        self._add(f"G{3 if angle > 0 else 2} {self._end(end)} {words}", motion)

    def _dwell(self) -> None:
        time = float(self.rng.uniform(0.1, 1.0))
        self.text.append(f"G4 P{time:.15f}")
        self.motions.append(Motion(len(self.text), self.place, self.place, 0.0, time))


def printed_house(size: float) -> Iterator[str]:
    """Lines of a print of at least `size` bytes: layers of two walls around a wavy floor plan, at 0.1 m/s, in mm."""
    written = 0
    for number, line in enumerate(_printed_lines()):
        written += len(line)
        yield line
        if number % 1441 == 4 and written > size:
            return


def _printed_lines() -> Iterator[str]:
    yield from ("G21\n", "G90\n", "M83\n", "G28\n")
    layer = 0
    while True:
        yield f"G1 Z{layer} F6000\n"
        for k in range(1440):
            angle = tau * k / 720
            radius = (2000.0 if k < 720 else 1900.0) + 200.0 * cos(5.0 * angle)
            yield f"G1 X{radius * cos(angle):.3f} Y{radius * sin(angle):.3f} E0.51234\n"
        layer += 1


def written(folder: Path, text: str, name: str = "part.ngc") -> Path:
    """A file with this text."""
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file
