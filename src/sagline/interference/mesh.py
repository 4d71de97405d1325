"""A solid of any form, given by the triangles of its surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sagline.arguments import label
from sagline.arrays import Array, Indices, checked, locked
from sagline.results import Result


@dataclass(frozen=True, slots=True, eq=False)
class Mesh(Result):
    """A closed surface of triangles, at rest in the world; as a platform, in the platform frame.

    Attributes:
        vertices: Corners [m], shape (V, 3).
        faces: Triangles as numbers of their corners, counter-clockwise seen from outside the solid, shape (F, 3).
        name: What it is called.
    """

    vertices: Array
    faces: Indices
    name: str

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, name: str = "mesh") -> None:
        """Check the fields."""
        values = {
            "vertices": checked(vertices, "vertices", "m", shape=(None, 3)),
            "faces": locked(np.array(faces, dtype=np.int64)),
            "name": label(name, "name"),
        }
        for field, value in values.items():
            object.__setattr__(self, field, value)

    @property
    def bounds(self) -> Array:
        """Lowest and highest corner along the axes [m], shape (2, 3)."""
        return np.stack((self.vertices.min(axis=0), self.vertices.max(axis=0)))
