"""What can be chosen on the command line, and what it stands for."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sagline.cables.model import CableModel
    from sagline.tension.method import TensionMethod


class Model(StrEnum):
    """Cable models."""

    CATENARY = "catenary"
    EMPIRICAL = "empirical"
    PARABOLIC = "parabolic"
    ELASTIC = "elastic"
    STRAIGHT = "straight"

    def build(self) -> CableModel:
        """The model, with its default constants."""
        import sagline as sl

        models: dict[Model, type[CableModel]] = {
            Model.CATENARY: sl.Catenary,
            Model.EMPIRICAL: sl.Empirical,
            Model.PARABOLIC: sl.Parabolic,
            Model.ELASTIC: sl.Elastic,
            Model.STRAIGHT: sl.Straight,
        }
        return models[self]()


class Variable(StrEnum):
    """Tensions in which the load can be shared."""

    CHORD = "chord"
    HORIZONTAL = "horizontal"


class Tension(StrEnum):
    """Ways of sharing the load."""

    CLOSEST = "closest"
    MINIMUM_NORM = "minimum-norm"

    def build(self, variable: Variable) -> TensionMethod:
        """The method, in that tension."""
        import sagline as sl

        return (sl.Closest if self is Tension.CLOSEST else sl.MinimumNorm)(variable.value)


class Format(StrEnum):
    """What a robot can be converted to."""

    ROBOT = "robot"
    MJCF = "mjcf"


def robot_completions(incomplete: str) -> list[str]:
    """Presets and robot files that begin so, for the shell."""
    from glob import escape, glob

    from sagline.robot.catalogue import robot_names

    files = sorted(glob(f"{escape(incomplete)}*.yaml") + glob(f"{escape(incomplete)}*.yml"))
    return [name for name in robot_names() if name.startswith(incomplete)] + files
