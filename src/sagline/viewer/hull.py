"""The hull of the workspace, in faces of one color each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.arrays import Array, Indices
from sagline.cables.model import CableModel
from sagline.numbers import n
from sagline.robot.robot import Robot
from sagline.tension.minimum_norm import MinimumNorm
from sagline.viewer.cable_colors import cable_color
from sagline.viewer.margin_scale import MarginScale
from sagline.viewer.space_stage import Patch
from sagline.workspaces.criteria.margin import LeastMargin
from sagline.workspaces.levels import Levels
from sagline.workspaces.orientations import Orientations
from sagline.workspaces.space import BY_BOX, Workspace, amount_of
from sagline.workspaces.workspace import workspace
from sagline.workspaces.wrench_sets import WrenchSet

CELLS: Final = 32  # of the grid, along the longest edge of the box
MOST: Final = 3  # limits that are told


class Asked(NamedTuple):
    """What a workspace is of.

    Attributes:
        robot: As the settings have changed it.
        quaternion: Of the platform, shape (4,).
        model: Cable model.
        wrenches: Loads to be borne.
    """

    robot: Robot
    quaternion: Array
    model: CableModel
    wrenches: WrenchSet

    @property
    def orientations(self) -> Orientations:
        """The one of the platform."""
        return Orientations(Rotation.from_quat(self.quaternion))

    def levels(self) -> Levels:
        """What says where it ends."""
        margin = (LeastMargin(),)
        return Levels(self.robot, self.wrenches, self.orientations, margin, self.model, MinimumNorm(), None, None)


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """A hull that has been worked out.

    Attributes:
        vertices: Corners [m], shape (V, 3).
        faces: Shape (F, 3).
        margin: At the vertices [N], shape (V,).
        cable: The limiting cable at the vertices, -1 where none does, shape (V,).
        told: What it is, in words, as HTML.
    """

    vertices: Array
    faces: Indices
    margin: Array
    cable: Indices
    told: str

    def patches(self, scale: MarginScale | None) -> list[Patch]:
        """The faces by their color: of margins on a scale, or None: by limiting cables, each with its name.

        Args:
            scale: Of margins; None for cables.

        Returns:
            A patch for each color that there is.
        """
        if scale is None:
            of_face = _most(self.cable[self.faces])
            return [
                Patch(self.vertices, self.faces[of_face == k], cable_color(k), f"cable {k}" if k >= 0 else "")
                for k in np.unique(of_face).tolist()
            ]
        margin = self.margin[self.faces].mean(axis=1)
        bands = scale.bands(margin)
        shades = scale.colors(margin)
        return [
            Patch(self.vertices, self.faces[bands == k], tuple(shades[bands == k][0].tolist()), "")
            for k in np.unique(bands).tolist()
        ]


def hull_of(asked: Asked, told: Callable[[int, int], None]) -> Hull:
    """The hull of a robot's workspace at one orientation.

    Args:
        asked: What it is of.
        told: Called with how much is done, of how much.

    Returns:
        The hull.
    """
    space = workspace(
        asked.robot, None, asked.wrenches, orientations=asked.orientations, model=asked.model, cells=CELLS,
        refine=False, progress=told,
    )  # fmt: skip
    cable = np.where(space.limiting == BY_BOX, -1, space.limiting_cable)
    return Hull(space.surface.vertices, space.surface.faces, space.margin, cable, _told(space))


def _told(space: Workspace) -> str:
    """HTML: how large it is, what limits it most, and where it goes on."""
    text = f"<b>Hull</b> {escape(amount_of(space))}, {escape(str(space.wrenches))}"
    if space.nearest is not None:
        return f"{text}<br>{escape(space.nearest.reason)}"
    most = [f"{n(100.0 * one.share, '.0f')} % by cable {one.cable}" for one in space.limits[:MOST]]
    if most:
        text += f"<br>Of its boundary {', '.join(most)}."
    if space.open_faces:
        text += f"<br>It goes on beyond the robot's box at {escape(', '.join(space.open_faces))}."
    return text


def _most(cables: Indices) -> Indices:
    """Of each face the cable that most of its corners have; of three different ones the first."""
    return np.where(cables[:, 1] == cables[:, 2], cables[:, 1], cables[:, 0])
