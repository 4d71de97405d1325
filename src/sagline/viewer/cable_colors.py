"""Colors of cables by number where regions or faces have them: in the viewer and in figures the same."""

from __future__ import annotations

from typing import Final

Color = tuple[int, int, int]  # red, green and blue, 0 to 255

# Hues far apart first, each seen on white and on dark: robots have eight cables, seldom more than twelve.
CABLES: Final[tuple[Color, ...]] = (
    (14, 147, 132), (232, 160, 32), (122, 92, 196), (94, 156, 60), (206, 84, 128), (24, 135, 196),
    (158, 104, 66), (150, 146, 20), (70, 96, 210), (210, 100, 56), (44, 170, 110), (176, 80, 176),
    (80, 140, 150), (196, 146, 96), (124, 164, 30), (160, 60, 80),
)  # fmt: skip
NONE: Final[Color] = (150, 155, 162)  # where no cable decides


def cable_color(cable: int) -> Color:
    """The color of a cable.

    Args:
        cable: Its number; negative for none.
    """
    return NONE if cable < 0 else CABLES[cable % len(CABLES)]
