"""The boundary as one looks at it: the same net as of `boundary`, without its error bar, in a tenth of a second.

Every node of the grid is evaluated, none is guessed from its neighbors: what the grid can tell, the outline tells. It
misses what `boundary` misses, parts and gaps that lie between nodes, and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.results import Result
from sagline.workspaces.boundary import FACES, faces_on_box, placed
from sagline.workspaces.grid import Grid, sampled
from sagline.workspaces.levels import Levels
from sagline.workspaces.marching import net_of
from sagline.workspaces.region import Region
from sagline.workspaces.surface import Surface, normals_of, volumes_of

PRECISE: Final = 1e-4  # of the level at the nearer node, and of an edge of the grid at jumps: less than is seen


@dataclass(frozen=True, slots=True, eq=False)
class Outline(Result):
    """Where a robot can work, to be looked at.

    Attributes:
        surface: The boundary, closed along the faces of the box.
        margin: At its vertices [N], shape (V,).
        cable: The cable that limits at each vertex, -1 where none does, shape (V,).
        on_box: Which triangles lie on a face of the box, shape (F,).
        open_faces: Faces of the robot's box that it reaches, "x low" for instance.
        volume: What it holds [m^3], or of a plane [m^2]; what bulges between the vertices is not counted.
        parts: In how many pieces it is.
        grid: The level at the nodes.
    """

    surface: Surface
    margin: Array
    cable: Indices
    on_box: Flags
    open_faces: tuple[str, ...]
    volume: float
    parts: int
    grid: Grid

    @property
    def shares(self) -> dict[int, float]:
        """Which share of the boundary within the box each cable limits, the largest first; a third at each corner."""
        faces = self.surface.faces[~self.on_box]
        area = np.linalg.norm(normals_of(self.surface.vertices, faces), axis=1)
        whole = max(float(area.sum()), np.finfo(np.float64).tiny)
        owners, index = np.unique(self.cable[faces], return_inverse=True)
        sums = np.bincount(index.ravel(), np.repeat(area / 3.0, 3), minlength=len(owners)) / whole
        return {int(owners[k]): float(sums[k]) for k in np.argsort(-sums, kind="stable")}


def outline(levels: Levels, region: Region) -> Outline:
    """The boundary of where levels are not negative, as the nodes of a grid see it.

    Args:
        levels: Tells where.
        region: The box, and how many cells the grid has along each of its axes.

    Returns:
        The outline, without triangles where no node is inside.

    Raises:
        FileError: If scikit-image is not installed.
    """
    from scipy.ndimage import label  # a third of a second to load

    grid = sampled(levels, region.low, region.high, region.cells)
    net, vertices, _ = placed(net_of(grid.inside), grid, levels, precision=PRECISE, narrow=PRECISE)
    surface = Surface(locked(vertices), locked(net.faces))
    decided = levels.details(vertices)
    on_box = faces_on_box(surface, grid)
    ends = np.stack((region.low == region.box.low, region.high == region.box.high), axis=1).ravel()
    return Outline(
        surface=surface,
        margin=decided.margin,
        cable=decided.cable,
        on_box=locked(np.logical_or.reduce(on_box)),
        open_faces=tuple(name for name, own, is_box in zip(FACES, on_box, ends, strict=True) if own.any() and is_box),
        volume=float(volumes_of(surface.vertices, surface.faces).sum()) / region.thickness,
        parts=int(label(grid.inside)[1]),
        grid=grid,
    )
