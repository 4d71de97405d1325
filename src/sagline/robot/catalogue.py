"""Robot presets, and an initial robot design from a few numbers."""

from __future__ import annotations

from dataclasses import dataclass, fields
from importlib.resources import files
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.rope import ROPES, SAFETY
from sagline.core.arguments import choice
from sagline.core.arrays import Array, checked
from sagline.core.errors import InvalidValueError, nearest
from sagline.robot.inertia import box_inertia
from sagline.robot.pose import PoseBox
from sagline.robot.robot import Robot

_PRESETS = files("sagline.robot") / "presets"


def robot_names() -> tuple[str, ...]:
    """Names of the presets.

    Returns:
        The names are in alphabetical order.

    Examples:
        >>> import sagline as sl
        >>> sl.robot_names()[:3]
        ('article-mixed', 'article-prototype', 'article-suspended')
    """
    return tuple(
        sorted(entry.name.removesuffix(".yaml") for entry in _PRESETS.iterdir() if entry.name.endswith(".yaml"))
    )


def preset_text(name: str) -> str:
    """Text of a preset's robot file."""
    names = robot_names()
    if name not in names:
        near = nearest(name, names)
        hint = f"Did you mean {near}? " if near else ""
        raise InvalidValueError(
            "robot", repr(name), ", ".join(names), f"{hint}To use a robot file, give its path, such as robot.yaml."
        )
    return (_PRESETS / f"{name}.yaml").read_text(encoding="utf-8")


LAYOUTS: Final = ("top", "mixed", "bottom")
COUNTS: Final = {"top": (8, 6), "mixed": (8, 7)}
THINNEST, THICKEST = 0.0003, 0.08  # allowed diameters of ropes for cable robots [m]
SLACK_LIMIT = 0.05  # lower tension limit of a cable, relative to the weight of the platform
# in counter-clockwise order, relative to the edges of the frame
_CORNERS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
_POSTS = np.array([[0.5, -0.5], [-0.5, -0.5], [0.0, 0.5]])  # posts at the corners of a triangle in the same rectangle


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Data of an initial robot design.

    Attributes:
        name: Name of the robot.
        frame: Edges of the frame [m], shape (3,); it is on the floor, centered at the origin.
        platform: Edges of the platform [m], shape (3,).
        mass: Mass of the platform with its payload [kg].
        rope: Name in the catalogue of ropes.
        diameter: Diameter of the rope [m].
        cables: Number of cables, 6 to 8.
        layout: "top" (all cables from above) or "mixed" (from above and from below).
    """

    name: str
    frame: Array
    platform: Array
    mass: float
    rope: str
    diameter: float
    cables: int
    layout: str

    def __init__(
        self,
        name: str,
        frame: ArrayLike,
        platform: ArrayLike,
        mass: float,
        rope: str = "dyneema-sk78",
        diameter: float = 0.006,
        cables: int = 8,
        layout: str = "top",
    ) -> None:
        """Check the data that `Robot` does not check, or that the messages of `Robot` describe in other terms.

        Args:
            name: Name of the robot.
            frame: Edges of the frame [m], shape (3,).
            platform: Edges of the platform [m], shape (3,), smaller than the edges of the frame.
            mass: Mass of the platform with its payload [kg].
            rope: Name in the catalogue of ropes.
            diameter: Diameter of the rope [m], 0.3 mm to 80 mm.
            cables: Number of cables, 6 to 8.
            layout: "top" or "mixed".

        Raises:
            InvalidValueError: If a size is not positive, the platform does not fit, the layout cannot support a load,
                or the rope is unknown.
        """
        outer = checked(frame, "frame", "m", shape=(3,), above=0.0)
        inner = checked(platform, "platform", "m", shape=(3,), above=0.0)
        if (inner >= outer).any():
            axis = int(np.argmax(inner >= outer))
            raise InvalidValueError(
                f"platform[{axis}]",
                f"{inner[axis]:g} m",
                f"< frame[{axis}], {outer[axis]:g} m",
                "Take a smaller platform.",
            )
        if choice(layout, "layout", LAYOUTS) == "bottom":
            raise InvalidValueError(
                "layout", "'bottom'", "top, mixed", "Cables from below only pull down; add cables from above."
            )
        if cables not in COUNTS[layout]:
            allowed = " or ".join(map(str, COUNTS[layout]))
            raise InvalidValueError(f"cables of layout {layout}", cables, allowed, "Choose another number or layout.")
        choice(rope, "rope", tuple(ROPES))
        if not THINNEST <= diameter <= THICKEST:
            raise InvalidValueError(
                "diameter",
                f"{diameter:g} m",
                f"{1e3 * THINNEST:g} mm to {1e3 * THICKEST:g} mm",
                "Give it with its unit.",
            )
        values = (name, outer, inner, float(mass), rope, float(diameter), int(cables), layout)
        for field, value in zip(fields(self), values, strict=True):
            object.__setattr__(self, field.name, value)

    def robot(self) -> Robot:
        """Robot of this design. Its tension limits follow from platform weight and rope strength.

        Returns:
            Robot; assumed values are marked in its field `assumed`.

        Raises:
            InvalidValueError: If the ropes are too weak for the load, or a value is wrong.
        """
        rope = ROPES[self.rope]
        cable = rope.cable(self.diameter)
        weakest = SLACK_LIMIT * self.mass * 9.81
        strongest = rope.breaking_force(self.diameter) / SAFETY
        if strongest <= weakest:
            raise InvalidValueError(
                "diameter", f"{1e3 * self.diameter:g} mm", "a rope that can carry the load", "Take a thicker rope."
            )
        frame, platform = self._anchors()
        return Robot(
            name=self.name,
            frame_anchors=frame,
            platform_anchors=platform,
            cables=cable,
            mass=self.mass,
            inertia=box_inertia(self.mass, *self.platform),
            tension_min=weakest,
            tension_max=strongest,
            platform_size=self.platform,
            frame_size=self.frame,
            source=f"sagline new: {self.cables} cables, {self.layout}, {rope.description}, {1e3 * self.diameter:g} mm",
            assumed={
                "cables": f"{rope.source}; {rope.assumed}",
                "inertia": "a solid box of the platform's size",
                "tension_min": f"{100 * SLACK_LIMIT:g} % of the platform's weight, so that no cable is slack",
                "tension_max": f"breaking force {SAFETY * strongest:,.0f} N divided by a safety factor of {SAFETY:g}",
            },
        )

    def placed(self, share: float) -> PoseBox:
        """Box of platform positions around the center of the frame.

        share: edges of the box, divided by the difference of frame edges and platform edges, 0 to 1.
        """
        middle = np.array([0.0, 0.0, 0.5 * self.frame[2]])
        half = 0.5 * share * (self.frame - self.platform)
        return PoseBox(middle - half, middle + half)

    def _anchors(self) -> tuple[Array, Array]:
        """Frame and platform anchors, shape (m, 3) each."""
        top = self.frame[2]
        if self.layout == "top" and self.cables == 8:
            frame, platform = _crossed()
        elif self.layout == "top":
            frame, platform = _octahedron()
        else:
            frame, platform = _mixed(_CORNERS if self.cables == 8 else _POSTS)
        return frame * self.frame + np.array([0.0, 0.0, 0.5 * top]), platform * self.platform


def _at(plane: Array, height: float) -> Array:
    """Points at a given height, from their horizontal coordinates."""
    return np.column_stack((plane, np.full(len(plane), height)))


def _crossed() -> tuple[Array, Array]:
    """Two cables from each top corner of the frame: to the next upper and the previous lower corner of the platform."""
    frame = np.repeat(_at(_CORNERS, 0.5), 2, axis=0)
    upper, lower = _at(np.roll(_CORNERS, -1, axis=0), 0.5), _at(np.roll(_CORNERS, 1, axis=0), -0.5)
    return frame, np.stack((upper, lower), axis=1).reshape(-1, 3)


def _octahedron() -> tuple[Array, Array]:
    """Two cables from each of three posts: to the two nearest corners of a platform triangle, turned by 180 degrees."""
    frame = np.repeat(_at(_POSTS, 0.5), 2, axis=0)
    triangle = _at(-_POSTS, 0.5)  # corner k lies opposite post k
    return frame, triangle[[1, 2, 2, 0, 0, 1]]


def _mixed(below: Array) -> tuple[Array, Array]:
    """Cables from the top corners to adjacent lower platform corners, and from the floor to upper platform corners."""
    frame = np.concatenate((_at(_CORNERS, 0.5), _at(below, -0.5)))
    return frame, np.concatenate((_at(_CORNERS, -0.5), _at(below, 0.5)))
