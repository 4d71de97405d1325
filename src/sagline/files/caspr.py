"""Robots of CASPR, a MATLAB program for cable robots. A robot has an XML file of bodies and an XML file of cables."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final, TypeAlias
from xml.etree.ElementTree import Element

import numpy as np

from sagline.cables.cable import Cable
from sagline.core.arguments import file_path, optional, text
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files import robot_xml as xml
from sagline.files.reading import value_errors
from sagline.files.robot_xml import Imported
from sagline.robot.checks import MotionPattern
from sagline.robot.robot import Robot
from sagline.robot.winch import Winch

_Vector: TypeAlias = tuple[float, float, float]
_COLUMNS: Final = (
    *("frame_anchors", "platform_anchors", "tension_min", "tension_max"),
    *("axial_stiffness", "pulley_radius", "swivel_axis"),
)
_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_JOINTS: Final[dict[str, tuple[MotionPattern, _Vector | None]]] = {
    "SPATIAL": ("3R3T", None),
    "SPATIAL_EULER_XYZ": ("3R3T", None),
    "SPATIAL_QUATERNION": ("3R3T", None),
    "T_XYZ": ("3T", None),
    "PLANAR_XY": ("1R2T", _Z),
    "PLANAR_XZ": ("1R2T", _Y),
    "PLANAR_YZ": ("1R2T", _X),
    "P_XY": ("2T", _Z),
    "P_XZ": ("2T", _Y),
}


def load_caspr(source: str | os.PathLike[str], cables: Cable | None = None, cable_set: str | None = None) -> Imported:
    """Read a CASPR robot with one platform.

    Cables in CASPR have no weight, and ideal cables do not stretch. If `cables` is None, missing values are replaced by
    values of a 4 mm steel rope. The robot's `assumed` lists the replaced values. Only pulleys with a vertical swivel
    axis are read.

    Args:
        source: The robot's folder, or one of its two files (bodies or cables). If only one file is named, the other is
            searched in the same folder.
        cables: Material of the cables. None: the values of the file, with assumed values for missing values.
        cable_set: Name of the set of cables; None for the default of the file.

    Returns:
        Imported: the robot, and the lost data.

    Raises:
        FileError: If a file is missing or cannot be read. If the robot has several platforms, or cables that do not go
            straight from base to platform.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_caspr("CoGiRo").robot  # doctest: +SKIP
    """
    optional(cables, Cable, "cables")
    if cable_set is not None:
        text(cable_set, "cable_set")
    bodies, cables_file = _files(file_path(source, "source", folder=True))
    with value_errors(bodies):
        platform, lost = _platform(xml.read_xml(bodies))
    with value_errors(cables_file):
        chosen = _select_set(xml.read_xml(cables_file), cable_set, lost)
        columns = _columns(chosen, platform["center_of_mass"], lost)
        stiffness, radii, axes = (columns.pop(name) for name in ("axial_stiffness", "pulley_radius", "swivel_axis"))
        assumed: dict[str, str] = {}
        if cables is None:
            cables = xml.cables_of_file([None] * len(stiffness), stiffness, "CASPR", assumed)
        robot = Robot(
            bodies.stem.removesuffix("_bodies"),
            cables=cables,
            winches=Winch(radii, swivel_axis=axes) if any(radii) else None,
            source="CASPR files",
            assumed=assumed,
            **columns,
            **platform,
        )
    return xml.with_losses(robot, tuple(lost))


def _files(source: Path) -> tuple[Path, Path]:
    """Paths of the files of bodies and of cables. If `source` is a file, other files of its kind are ignored."""
    if not os.path.exists(source):  # False for a name that no file can have
        raise FileError(source, "does not exist", "Check its name.")
    folder = source if source.is_dir() else source.parent
    folder = folder.parent if folder.name == "cables" else folder
    beside = sorted((*folder.glob("*.xml"), *folder.glob("cables/*.xml")))
    if not source.is_dir() and _kind(xml.read_xml(source)) is None:
        step = "Check that this is the CASPR file you mean."
        raise FileError(source, "contains neither <link_rigid> nor <cables>", step)
    found: dict[str, list[Path]] = {"bodies": [], "cables": []}
    for file in beside if source.is_dir() else [source, *beside]:
        kind = _kind(xml.read_xml(file))
        if kind is not None and not (found[kind] and source in found[kind]):
            found[kind].append(file)
    for kind, files in found.items():
        if len(files) != 1:
            names = ", ".join(file.name for file in files) or "none"
            reason = f"goes with {len(files)} CASPR files of {kind} ({names}); allowed: 1"
            raise FileError(source, reason, "Give the file, not the folder.", item=f"CASPR files of {kind}")
    return found["bodies"][0], found["cables"][0]


def _kind(root: Element) -> str | None:
    if root.tag == "cables":
        return "cables"
    return "bodies" if root.find(".//link_rigid") is not None else None


def _platform(root: Element) -> tuple[dict[str, Any], list[str]]:
    """Fields of the robot from the file of bodies, and the data of this file that the robot cannot contain."""
    links = root.findall(".//link_rigid")
    if len(links) != 1:
        raise InvalidValueError("number of <link_rigid>", len(links), "1", "sagline supports a single platform.")
    link = links[0]
    joint = xml.only_child(link, "joint", "link_rigid").get("type", "")
    if joint not in _JOINTS:
        raise InvalidValueError("joint type", repr(joint), ", ".join(_JOINTS), "sagline supports only free platforms.")
    physical = xml.only_child(link, "physical", "link_rigid")
    mass = xml.number_of_text(physical.findtext("mass"), "mass", "kg")
    center = xml.numbers_of_text(physical.findtext("com_location"), 3, "com_location", "m")
    inertia = _inertia(xml.only_child(physical, "inertia", "physical"), mass, center)
    fields: dict[str, Any] = {"mass": mass, "inertia": inertia, "center_of_mass": center}
    fields["motion_pattern"], fields["plane_normal"] = _JOINTS[joint]
    return fields, _lost_of_link(root, link)


def _inertia(element: Element, mass: float, center: Array) -> Array:
    """Inertia about the center of mass. CASPR may give the inertia about the joint (platform origin)."""
    xx, yy, zz, xy, xz, yz = (
        xml.number_of_text(element.findtext(key), key, "kg m^2") for key in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    )
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    reference = element.get("ref", "")
    if reference not in ("com", "joint"):
        raise InvalidValueError("inertia: ref", repr(reference), "'com' or 'joint'", "Correct inertia in the file.")
    if reference == "joint":
        matrix -= mass * (center @ center * np.eye(3) - np.outer(center, center))
    return matrix


def _lost_of_link(root: Element, link: Element) -> list[str]:
    lost = []
    location = link.findtext("parent/location", "0 0 0")
    if xml.numbers_of_text(location, 3, "parent: location", "m").any():
        lost.append(
            f"The joint's position in the base ({location.strip()} m): add it to CASPR's joint position to get the "
            "position of sagline's platform."
        )
    end = link.findtext("physical/end_location", "0 0 0")
    if xml.numbers_of_text(end, 3, "end_location", "m").any():
        lost.append(f"The end location ({end.strip()} m).")
    joint = xml.only_child(link, "joint", "link_rigid")
    limits = [key for key in ("q_min", "q_max", "q_initial") if joint.get(key)]
    if limits:
        lost.append(f"The joint's {', '.join(limits)}.")
    if root.find(".//operational_set") is not None:
        lost.append("The operational spaces.")
    return lost


def _select_set(root: Element, wanted: str | None, lost: list[str]) -> Element:
    sets = {element.get("id", ""): element for element in root.findall("cable_set")}
    name = root.get("default_cable_set", "") if wanted is None else wanted
    if name not in sets:
        raise InvalidValueError("cable set", repr(name), ", ".join(map(repr, sets)) or "none", "Choose one of these.")
    if others := [other for other in sets if other != name]:
        lost.append(f"The other sets of cables: {', '.join(others)}.")
    return sets[name]


def _columns(chosen: Element, center: Array, lost: list[str]) -> dict[str, Any]:
    """Values of all cables of the set `chosen`: one list per quantity."""
    rows = []
    for k, element in enumerate(chosen):
        item = f"{element.tag} {element.get('name') or k}"
        if not element.tag.startswith("cable_") or "passive" in element.tag:
            lost.append(f"{item}: no cable on a winch, left out; the balance of forces changes with it.")
            continue
        if element.tag not in ("cable_ideal", "cable_linear_spring"):
            lost.append(f"{item}: its law of stiffness; only its ends and its limits are converted.")
        rows.append(_row(element, item, center, lost))
    return {name: [row[k] for row in rows] for k, name in enumerate(_COLUMNS)}


def _row(element: Element, item: str, center: Array, lost: list[str]) -> tuple[Any, ...]:
    """Values of a cable in the order of `_COLUMNS`; the axial stiffness is None if the file does not give it."""
    ends = list(xml.only_child(element, "attachments", item))
    if len(ends) != 2:
        raise InvalidValueError(f"{item}: number of attachments", len(ends), "2", "sagline has no routed cables.")
    points: dict[str, Array] = {}
    pulley = 0.0, _Z
    for end in ends:
        link = (end.findtext("link") or "0").strip()
        place = end.findtext("location") or end.findtext("fixed_location")
        points[link] = xml.numbers_of_text(place, 3, f"{item}: location on link {link}", "m")
        if end.tag != "attachment":
            pulley = _pulley(end, link, item, lost)
    if set(points) != {"0", "1"}:
        raise InvalidValueError(f"{item}: links", ", ".join(points), "0, 1", "A cable joins base and platform.")
    if element.get("attachment_reference") == "com":
        points["1"] = points["1"] + center
    low, high = (
        xml.number_of_text(element.findtext(f"properties/{key}"), f"{item}: {key}", "N")
        for key in ("force_min", "force_max")
    )
    # K is an axial stiffness in N, because CASPR divides it by the cable's length
    stiffness = element.findtext("properties/K") if element.tag == "cable_linear_spring" else None
    known = None if stiffness is None else xml.number_of_text(stiffness, f"{item}: K", "N")
    return points["0"], points["1"], low, high, known, *pulley


def _pulley(end: Element, link: str, item: str, lost: list[str]) -> tuple[float, _Vector]:
    """Pulley radius and swivel axis at a cable end. The cable enters the pulley along the swivel axis."""
    if end.tag != "attachment_base_pulley" or link != "0":
        unlike = f"of a kind unknown here, <{end.tag}>"
    elif end.find("pulley_radius") is None or end.find("cable_entry_vector") is None:
        unlike = "without pulley_radius and cable_entry_vector"
    else:
        radius = xml.number_of_text(end.findtext("pulley_radius"), f"{item}: pulley_radius", "m")
        entry = xml.numbers_of_text(end.findtext("cable_entry_vector"), 3, f"{item}: cable_entry_vector", "")
        axis = xml.vertical_axis(float(np.hypot(entry[0], entry[1])), float(entry[2]))
        if axis is not None:
            return radius, axis
        unlike = "that is not entered vertically"
    lost.append(f"{item}: its pulley, {unlike}; the cable starts at the pulley's fixed point.")
    return 0.0, _Z
