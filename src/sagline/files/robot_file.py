"""Robot files: reading of YAML with units, writing of YAML in SI, and the scene around the robot."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sagline.core.arguments import brief, file_path, instance
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError, did_you_mean
from sagline.files.reading import read_text, value_errors
from sagline.files.robot_schema import SWIVEL_AXES, RobotEntry
from sagline.files.yaml_text import YAML_LIMIT, dump_mapping, parse_mapping, validate
from sagline.robot.catalogue import preset_text, robot_names
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

if TYPE_CHECKING:
    from sagline.interference.pairs import Obstacle


def load_robot(name_or_path: str | os.PathLike[str]) -> Robot:
    """Load a preset by its name, or a robot file by its path.

    A robot file is YAML. The keys are the fields of `Robot`; a quantity is a number in SI or a text with its unit:

        name: my robot
        frame_anchors: [[0, 0, 3], [4000 mm, 0, 3], ...]      # one point per cable
        platform_anchors: [[-0.1, 0, 0.1], ...]
        cables: {linear_density: 67 g/m, youngs_modulus: 2 GPa, section_area: 22 mm^2}
            # or axial_stiffness; radius or diameter instead of section_area; a number, or a list with one per cable
            # also diameter, which drums need, and expansion [1/K]
        winches: {pulley_radius: 50 mm, swivel_axis: up, drum_radius: 60 mm, gear: 20, counts_per_turn: 131072}
            # its keys are the fields of `Winch`: one value for all cables, or a list with one per cable
        mass: 50 kg
        inertia: {box: [0.3, 0.3, 0.5]}
            # or cylinder_radius and cylinder_height (along z), Ixx ... Iyz, three numbers, or a 3 x 3 matrix
        tension_min: 20 N
        assumed: {tension_min: the winch's data sheet gives none}
        tolerances: {frame_anchors: 5 mm, axial_stiffness: 20 %, mass: 0.5 kg}
            # standard deviations of the values above, for `calibrate`: one number for all, [x, y, z], or a list
            # with one per cable; percent for drum_radius, linear_density, axial_stiffness, load_cell_gain, mass
        calibration: {log: winches.csv, date: 2026-03-01, standard_error: {frame_anchors: 1 mm, mass: 80 g}}
            # origin and standard errors of estimated values, written by `calibrate`
        scene: [{name: pole, capsule: [[1, 0, 0], [1, 0, 3]], radius: 5 cm}]      # obstacles: `load_scene`

    A file may be based on a preset. Such a file contains a line such as `base: cogiro`, its own name, and only the
    values that differ from the preset. Other values, and the notes on assumed values, come from the preset.

    Args:
        name_or_path: One of `robot_names()`, or the path of a file. A text is a path if it ends with .yaml or .yml,
            contains a folder, or is the name of an existing file.

    Returns:
        The robot. Its values are checked.

    Raises:
        FileError: If the file cannot be read, or a value is wrong; the message names the key and the value.
        InvalidValueError: If there is no such preset.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")  # or "my_robot.yaml"
        >>> robot.cable_count, robot.mass, robot.motion_pattern
        (8, 91.058, '3R3T')
    """
    path = file_path(name_or_path, "name_or_path")
    if isinstance(name_or_path, str) and _is_name(name_or_path, path):
        return parse_robot(preset_text(name_or_path), f"preset {name_or_path}")
    return parse_robot(read_text(path, YAML_LIMIT), path)


def parse_robot(text: str, origin: Path | str) -> Robot:
    """Read the robot from the text of a robot file."""
    entry = _robot_entry(text, origin)
    with value_errors(origin):
        return entry.robot()


def _robot_entry(text: str, origin: Path | str) -> RobotEntry:
    """Read the schema entry of a robot file. Keys and types are checked, but not values."""
    return validate(_on_base(parse_mapping(text, origin), origin), RobotEntry, origin)


def dump_robot(robot: Robot) -> str:
    """Write a robot as the text of a robot file, in SI.

    Args:
        robot: The robot.

    Returns:
        YAML text; `load_robot` restores exactly the same robot from a file with this text.

    Examples:
        >>> import sagline as sl
        >>> print(sl.dump_robot(sl.load_robot("cogiro")).splitlines()[0])
        name: cogiro
    """
    instance(robot, Robot, "robot")
    data: dict[str, Any] = {"name": robot.name, "source": robot.source, "notes": robot.notes}
    data["assumed"] = dict(robot.assumed)
    data["cables"] = {key: field.tolist() for key, field in robot.cables.known().items()}
    if robot.winches is not None:
        data["winches"] = _winches(robot.winches)
    for key in ("mass", "gravity", "motion_pattern", "tension_limits_of"):
        data[key] = getattr(robot, key)
    for key in ("inertia", "center_of_mass", "tension_min", "tension_max", "frame_anchors", "platform_anchors"):
        data[key] = getattr(robot, key).tolist()
    for key in ("plane_normal", "platform_size", "frame_size"):
        if (value := getattr(robot, key)) is not None:
            data[key] = value.tolist()
    if (box := robot.test_box) is not None:
        data["test_box"] = {"low": box.low.tolist(), "high": box.high.tolist(), "tilt": box.tilt}
    if robot.tolerances:
        data["tolerances"] = _deviations(robot.tolerances)
    if (known := robot.calibration) is not None:
        data["calibration"] = {"log": known.log, "date": known.date, "note": known.note}
        data["calibration"]["standard_error"] = _deviations(known.standard_error)
    return dump_mapping(data)


def _deviations(found: Mapping[str, Array]) -> dict[str, Any]:
    """Convert the standard deviations `found` for the file. A field with equal values becomes a single number."""
    return {name: (one.flat[0].item() if (one == one.flat[0]).all() else one.tolist()) for name, one in found.items()}


def _on_base(data: dict[Any, Any], origin: Path | str) -> dict[Any, Any]:
    """Keys and values of a robot file. If the file names a base preset, missing keys are added from this preset."""
    if "base" not in data:
        return data
    name = data.pop("base")
    if name not in robot_names():
        step = did_you_mean(name, robot_names(), "Name one of them, or leave base out.")
        raise FileError.of(origin, InvalidValueError("base", brief(name), ", ".join(robot_names()), step))
    base = _on_base(parse_mapping(preset_text(name), f"preset {name}"), origin)
    del base["name"]  # the robot needs its own name, because files of results have the name of the robot
    assumed = {field: why for field, why in base.get("assumed", {}).items() if field not in data}
    own = data.get("assumed", {})
    return {**base, **data, "assumed": {**assumed, **own} if isinstance(own, dict) else own}


def _winches(winches: Winch) -> dict[str, Any]:
    """Keys and values of the winches for a file. Default values of `Winch` are left out."""
    plain = Winch().per_cable(len(winches.pulley_radius)).known()
    data = {
        key: field.tolist()
        for key, field in winches.known().items()
        if key == "pulley_radius" or key not in plain or field.tobytes() != plain[key].tobytes()
    }
    if "guides" in data:  # the dead length follows from the guides
        data = {key: value for key, value in data.items() if key not in ("dead_cable", "dead_rise")}
    if "swivel_axis" in data:
        words = {tuple(axis): word for word, axis in SWIVEL_AXES.items()}
        data["swivel_axis"] = [words.get(tuple(axis), axis) for axis in data["swivel_axis"]]
    return data


def _is_name(text: str, path: Path) -> bool:
    if text in robot_names():
        return True
    return path.suffix not in {".yaml", ".yml"} and path.name == text and not os.path.exists(path)


def load_scene(file: str | os.PathLike[str]) -> tuple[Obstacle, ...]:
    """Load the obstacles around a robot from the `scene` of its file.

    A scene is a list. Positions are in the world. A quantity is a number in SI or a text with its unit:

        scene:
          - {name: table, box: [1.2, 0.8, 70 cm], center: [2, 0, 0.35], turned: 30 deg}
          - {name: pole, capsule: [[1, 0, 0], [1, 0, 3]], radius: 5 cm}
          - {name: lamp, sphere: [0, 0, 2.8], radius: 20 cm}
          - {name: hall, mesh: hall.stl, unit: mm, position: [0, 0, -1], turned: 90 deg}

    `turned` is a rotation about z; `mesh` is a file in the folder of the robot file, read by `load_mesh`. The scene
    exists only in the file. A `Robot` has no scene, and `dump_robot` does not write one.

    Args:
        file: The robot file.

    Returns:
        Boxes, capsules, spheres and meshes in the order of the file; empty if the file has no scene.

    Raises:
        FileError: If the file or a mesh cannot be read, or a value is wrong; the message names the key.

    Examples:
        >>> import sagline as sl
        >>> around = sl.load_scene("my_robot.yaml")  # doctest: +SKIP
        >>> sl.clearance(plan.state, around).distance  # doctest: +SKIP
    """
    path = file_path(file, "file")
    entry = _robot_entry(read_text(path, YAML_LIMIT), path)
    with value_errors(path):
        solids = [place.solid(f"scene[{k}]") for k, place in enumerate(entry.scene)]
    found: list[Obstacle] = []
    for k, (place, solid) in enumerate(zip(entry.scene, solids, strict=True)):
        if solid is None:
            from sagline.files.mesh_file import load_mesh

            mesh = load_mesh(path.parent / str(place.mesh), place.unit, place.name)
            found.append(mesh.placed(place.pose(f"scene[{k}]")))
        else:
            found.append(solid)
    return tuple(found)
