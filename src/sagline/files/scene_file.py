"""The scene of a robot file: what stands around the robot."""

from __future__ import annotations

import os
from pathlib import Path

from sagline.core.arguments import file_path
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.mesh_file import load_mesh, meters
from sagline.files.robot_file import robot_entry
from sagline.files.scene_schema import Place
from sagline.files.text import read_text
from sagline.files.yaml_text import YAML_LIMIT
from sagline.interference.pairs import Obstacle


def load_scene(file: str | os.PathLike[str]) -> tuple[Obstacle, ...]:
    """What stands around a robot, from the `scene` of its file.

    A scene is a list; positions are in the world, a quantity is a number in SI or a text with its unit:

        scene:
          - {name: table, box: [1.2, 0.8, 70 cm], center: [2, 0, 0.35], turned: 30 deg}
          - {name: pole, capsule: [[1, 0, 0], [1, 0, 3]], radius: 5 cm}
          - {name: lamp, sphere: [0, 0, 2.8], radius: 20 cm}
          - {name: hall, mesh: hall.stl, unit: mm, position: [0, 0, -1], turned: 90 deg}

    `turned` is about z, `mesh` a file beside the robot's, as by `load_mesh`. The scene is the file's: a `Robot` has
    none, and `dump_robot` writes none.

    Args:
        file: The robot file.

    Returns:
        Boxes, capsules, spheres and meshes in the order of the file; none if it has no scene.

    Raises:
        FileError: If the file or a mesh cannot be read, or says something wrong; the message names the key.

    Examples:
        >>> import sagline as sl
        >>> around = sl.load_scene("my_robot.yaml")  # doctest: +SKIP
        >>> sl.clearance(plan.state, around).distance  # doctest: +SKIP
    """
    path = file_path(file, "file")
    entry = robot_entry(read_text(path, YAML_LIMIT), path)
    return tuple(_obstacle(place, f"scene[{k}]", path) for k, place in enumerate(entry.scene))


def _obstacle(place: Place, item: str, path: Path) -> Obstacle:
    try:
        kind = place.kind(item)
        if kind != "mesh":
            return place.solid(item, kind)
        pose = place.pose(item)
        meters(place.unit, f"{item}.unit")
    except InvalidValueError as error:
        raise FileError.of(path, error) from None
    return load_mesh(place.mesh_file(path), place.unit, place.name).placed(pose)
