"""Closed surfaces of triangles: what a boundary is handed out as."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array
from sagline.core.numbers import counted, n
from sagline.core.results import Result, formats

Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Surface(Result):
    """A surface of triangles, the corners of each counterclockwise as seen from outside.

    Attributes:
        vertices: Positions [m], shape (V, 3).
        faces: The three vertices of each triangle, shape (F, 3).
    """

    vertices: Array
    faces: Indices

    @property
    def volume(self) -> float:
        """What it encloses [m^3], by the divergence theorem; cavities are subtracted."""
        return float(volumes_of(self.vertices, self.faces).sum())

    @property
    def area(self) -> float:
        """Its area [m^2]."""
        return float(np.linalg.norm(normals_of(self.vertices, self.faces), axis=1).sum())

    @property
    def closed(self) -> bool:
        """Whether each edge of a triangle is that of one other, which runs along it the other way."""
        edges = np.concatenate([self.faces[:, [i, (i + 1) % 3]] for i in range(3)])
        count = len(self.vertices)
        there, back = edges @ [count, 1], edges @ [1, count]
        return len(np.unique(there)) == len(there) and bool(np.array_equal(np.sort(there), np.sort(back)))

    def __str__(self) -> str:
        """How many corners and triangles, and how large."""
        counts = f"{counted(len(self.faces), 'triangle')} with {len(self.vertices):,} vertices"
        if not len(self.vertices):
            return counts
        sides = zip(self.vertices.min(axis=0), self.vertices.max(axis=0), strict=True)
        spans = ", ".join(f"{n(low)} to {n(high)}" for low, high in sides)
        return f"{counts}, {'closed' if self.closed else 'open'}, {spans} m"

    def export(self, file: Path | str) -> None:
        """Write it to a file, whole or not at all, in meters and z up (GLB: y up, as that format wants it).

        Args:
            file: The file: "hull.stl", ".glb", ".ply", or ".vtk" or ".vtu" where meshio or PyVista is installed; one
                that exists is replaced.

        Raises:
            FileError: If the ending is another, a package is missing, or the file cannot be written; what was there
                before is untouched.
        """
        formats().save(self, file)


def normals_of(vertices: Array, faces: Indices) -> Array:
    """Outward normals of triangles, each as long as its triangle's area [m^2].

    Args:
        vertices: Positions [m], shape (V, 3).
        faces: Vertices of each triangle, shape (F, 3).

    Returns:
        Normals, shape (F, 3).
    """
    first, second, third = (vertices[faces[:, k]] for k in range(3))
    normals: Array = np.cross(second - first, third - first) / 2.0
    return normals


def volumes_of(vertices: Array, faces: Indices) -> Array:
    """What each triangle adds to the volume that all of a closed surface enclose: that of a pyramid over it.

    Args:
        vertices: Positions [m], shape (V, 3).
        faces: Vertices of each triangle, shape (F, 3).

    Returns:
        Volumes [m^3], negative where the top of the pyramids lies outside, shape (F,).
    """
    if not len(faces):
        return np.zeros(0)
    top = vertices.mean(axis=0)  # near the surface, so that little cancels
    volumes: Array = np.einsum("fi,fi->f", vertices[faces[:, 0]] - top, normals_of(vertices, faces)) / 3.0
    return volumes
