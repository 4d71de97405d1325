"""Where what is shown came from, for whoever wants to come by it again."""

from __future__ import annotations

from os import PathLike, fspath
from typing import NamedTuple


class Source(NamedTuple):
    """How to come by what the page was opened with, in Python.

    Attributes:
        robot: An expression for the robot; "" where nobody said.
        mass: Of the platform with a payload [kg]; None for the robot's own.
        played: An expression for the plan, simulation or execution; "" for none.
    """

    robot: str = ""
    mass: float | None = None
    played: str = ""

    @classmethod
    def of_robot(cls, name_or_path: str | PathLike[str], mass: float | None = None) -> Source:
        """A robot by its name or its file, perhaps with another mass [kg]."""
        return cls(f"sl.load_robot({fspath(name_or_path)!r})", mass)

    @classmethod
    def of_plan(cls, file: PathLike[str]) -> Source:
        """A plan in a file."""
        played = f"sl.load_plan({fspath(file)!r})"
        return cls(f"{played}.state.one_robot", None, played)

    @classmethod
    def of_simulation(cls, file: PathLike[str]) -> Source:
        """A simulation in a file."""
        played = f"sl.load_simulation({fspath(file)!r})"
        return cls(f"{played}.robot", None, played)

    @classmethod
    def of_log(cls, file: PathLike[str]) -> Source:
        """A log of the controller."""
        played = f"sl.load_execution({fspath(file)!r})"
        return cls(f"{played}.robot", None, played)

    @classmethod
    def of_calibration(cls, file: PathLike[str]) -> Source:
        """A calibration in a file."""
        return cls(f"sl.load_calibration({fspath(file)!r}).robot")
