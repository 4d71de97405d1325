"""Faces of one color each in the scene, which change in place: nothing flickers while a body follows a slider."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import viser

from sagline.core.arrays import Array, Indices

OPACITY: Final = 0.35  # the robot inside is seen


class Patch(NamedTuple):
    """Faces of one color.

    Attributes:
        vertices: Corners, each in a face [m], shape (V, 3).
        faces: Shape (F, 3).
        color: Red, green and blue, 0 to 255.
        opacity: 0 to 1.
    """

    vertices: Array
    faces: Indices
    color: tuple[int, int, int]
    opacity: float = OPACITY

    @classmethod
    def of(cls, vertices: Array, faces: Indices, color: tuple[int, int, int]) -> Patch:
        """A patch of some faces of a larger net, with no more of its corners than they have."""
        used, index = np.unique(faces, return_inverse=True)
        return cls(vertices[used], index.reshape(-1, 3), color)


class Patches:
    """Patches that are drawn, in place of those before."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        """Begin with none, under a name in the scene."""
        self._scene, self._name = scene, name
        self.meshes: list[Any] = []

    def show(self, patches: list[Patch], side: Any = "double") -> None:
        """Draw these and no others, while the server is `atomic`, so that corners and faces change together.

        Args:
            patches: What is drawn.
            side: Which side of faces: "front", "back" or "double".
        """
        while len(self.meshes) > len(patches):
            self.meshes.pop().remove()
        for k, patch in enumerate(patches):
            corners, faces = patch.vertices.astype(np.float32), patch.faces.astype(np.uint32)
            if k < len(self.meshes):
                mesh = self.meshes[k]
                mesh.vertices, mesh.faces, mesh.side = corners, faces, side
                mesh.color, mesh.opacity = patch.color, patch.opacity
                continue
            self.meshes.append(
                self._scene.add_mesh_simple(
                    f"{self._name}/{k}", corners, faces, color=patch.color, opacity=patch.opacity, side=side,
                    cast_shadow=False, receive_shadow=False,
                )
            )  # fmt: skip
