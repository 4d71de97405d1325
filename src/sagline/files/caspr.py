"""Robots of CASPR, the cable-robot platform for MATLAB: one XML file of bodies, one of cables."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from sagline.cables.cable import Cable
from sagline.core.arguments import file_path, optional, text
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.reading import exists
from sagline.files.robot_xml import (
    STEEL_ROPE_DENSITY,
    STEEL_ROPE_STIFFNESS,
    Imported,
    number,
    numbers,
    only_child,
    read_xml,
    with_losses,
)
from sagline.robot.pattern import MotionPattern
from sagline.robot.robot import Robot
from sagline.robot.winch import UPRIGHT, Winch

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_JOINTS: Final[dict[str, tuple[MotionPattern, tuple[float, float, float] | None]]] = {
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
    """Read a robot of CASPR that has one platform.

    CASPR's cables weigh nothing, and its ideal ones do not stretch: where the caller gives no `cables`, what the files
    leave out is that of a 4 mm steel rope, and the robot says so in `assumed`. Pulleys that swivel about a vertical
    axis are the robot's.

    Args:
        source: The robot's folder, or its file of bodies or of cables; the other file is looked for beside it.
        cables: The cables' material; None takes what the file gives and assumes the rest.
        cable_set: Name of the set of cables; None takes the file's default.

    Returns:
        Imported: the robot, and what was lost.

    Raises:
        FileError: If a file cannot be read, the two are not to be found, or they describe no robot with one platform
            and straight, unrouted cables.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_caspr("CoGiRo").robot  # doctest: +SKIP
    """
    optional(cables, Cable, "cables")
    if cable_set is not None:
        text(cable_set, "cable_set")
    bodies, cables_file = _files(file_path(source, "source", folder=True))
    at = bodies
    try:
        platform = _platform(read_xml(bodies))
        at = cables_file
        chosen, lost_sets = _select_set(read_xml(cables_file), cable_set)
        legs, lost_cables = _legs(chosen, platform.center_of_mass)
        lost = (*platform.lost, *lost_sets, *lost_cables)
        robot = _robot(bodies.stem.removesuffix("_bodies"), platform, legs, cables)
    except InvalidValueError as error:
        raise FileError.of(at, error) from None
    return with_losses(robot, lost)


class _Platform(NamedTuple):
    joint: str
    mass: float
    center_of_mass: Array
    inertia: Array
    lost: tuple[str, ...]


class _Pulley(NamedTuple):
    radius: float = 0.0
    swivel_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    unlike: str = ""  # what keeps it from being one of ours


class _Leg(NamedTuple):
    frame_anchor: Array
    platform_anchor: Array
    tension_min: float
    tension_max: float
    axial_stiffness: float  # NaN where the file gives none
    pulley: _Pulley


def _files(source: Path) -> tuple[Path, Path]:
    """The files of bodies and of cables; a file that is named wins over others of its kind in the folder."""
    if not exists(source):
        raise FileError(source, "does not exist", "Check its name.")
    folder = source if source.is_dir() else source.parent
    folder = folder.parent if folder.name == "cables" else folder
    beside = sorted((*folder.glob("*.xml"), *folder.glob("cables/*.xml")))
    if not source.is_dir() and _kind(read_xml(source)) is None:
        raise FileError(
            source, "holds neither <link_rigid> nor <cables>", "Check that this is the CASPR file you mean."
        )
    found: dict[str, list[Path]] = {"bodies": [], "cables": []}
    for file in beside if source.is_dir() else [source, *beside]:
        kind = _kind(read_xml(file))
        if kind is not None and not (found[kind] and source in found[kind]):
            found[kind].append(file)
    for kind, files in found.items():
        if len(files) != 1:
            names = ", ".join(file.name for file in files) or "none"
            reason = f"goes with {len(files)} CASPR files of {kind} ({names}); allowed: 1"
            raise FileError(source, reason, "Name the file itself.", item=f"CASPR files of {kind}")
    return found["bodies"][0], found["cables"][0]


def _kind(root: Element) -> str | None:
    if root.tag == "cables":
        return "cables"
    return "bodies" if root.find(".//link_rigid") is not None else None


def _platform(root: Element) -> _Platform:
    links = root.findall(".//link_rigid")
    if len(links) != 1:
        raise InvalidValueError("number of <link_rigid>", len(links), "1", "sagline moves a single platform.")
    link = links[0]
    joint = only_child(link, "joint", "link_rigid").get("type", "")
    if joint not in _JOINTS:
        raise InvalidValueError("joint type", repr(joint), ", ".join(_JOINTS), "sagline's platform moves freely.")
    physical = only_child(link, "physical", "link_rigid")
    mass = number(physical.findtext("mass"), "mass", "kg")
    center = numbers(physical.findtext("com_location"), 3, "com_location", "m")
    inertia = _inertia(only_child(physical, "inertia", "physical"), mass, center)
    return _Platform(joint, mass, center, inertia, _lost_of_link(root, link))


def _inertia(element: Element, mass: float, center: Array) -> Array:
    """Inertia about the center of mass; CASPR gives it about that or about the joint, the platform's origin."""
    xx, yy, zz, xy, xz, yz = (
        number(element.findtext(key), key, "kg m^2") for key in ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    )
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    reference = element.get("ref", "")
    if reference not in ("com", "joint"):
        raise InvalidValueError("inertia: ref", repr(reference), "'com' or 'joint'", "Correct inertia in the file.")
    if reference == "joint":
        matrix -= mass * (center @ center * np.eye(3) - np.outer(center, center))
    return matrix


def _lost_of_link(root: Element, link: Element) -> tuple[str, ...]:
    lost = []
    location = link.findtext("parent/location", "0 0 0")
    if numbers(location, 3, "parent: location", "m").any():
        lost.append(
            f"The joint's place in the base ({location.strip()} m): add it to CASPR's joint position to get the "
            "position of sagline's platform."
        )
    end = link.findtext("physical/end_location", "0 0 0")
    if numbers(end, 3, "end_location", "m").any():
        lost.append(f"The end location ({end.strip()} m).")
    joint = only_child(link, "joint", "link_rigid")
    limits = [key for key in ("q_min", "q_max", "q_initial") if joint.get(key)]
    if limits:
        lost.append(f"The joint's {', '.join(limits)}.")
    if root.find(".//operational_set") is not None:
        lost.append("The operational spaces.")
    return tuple(lost)


def _select_set(root: Element, wanted: str | None) -> tuple[Element, tuple[str, ...]]:
    sets = {element.get("id", ""): element for element in root.findall("cable_set")}
    name = root.get("default_cable_set", "") if wanted is None else wanted
    if name not in sets:
        raise InvalidValueError("cable set", repr(name), ", ".join(map(repr, sets)) or "none", "Choose one of these.")
    others = [other for other in sets if other != name]
    return sets[name], (f"The other sets of cables: {', '.join(others)}.",) if others else ()


def _legs(chosen: Element, center: Array) -> tuple[list[_Leg], tuple[str, ...]]:
    legs, lost = [], []
    for k, element in enumerate(chosen):
        item = f"{element.tag} {element.get('name') or k}"
        if not element.tag.startswith("cable_") or "passive" in element.tag:
            lost.append(f"{item}: no cable on a winch, left out; the balance of forces changes with it.")
            continue
        if element.tag not in ("cable_ideal", "cable_linear_spring"):
            lost.append(f"{item}: its law of stiffness; only its ends and its limits are taken.")
        legs.append(_leg(element, item, center))
        if unlike := legs[-1].pulley.unlike:
            lost.append(f"{item}: its pulley, {unlike}; the cable starts at the pulley's fixed point.")
    return legs, tuple(lost)


def _leg(element: Element, item: str, center: Array) -> _Leg:
    ends = list(only_child(element, "attachments", item))
    if len(ends) != 2:
        raise InvalidValueError(f"{item}: number of attachments", len(ends), "2", "sagline's cables are not routed.")
    points: dict[str, Array] = {}
    pulley = _Pulley()
    for end in ends:
        link = (end.findtext("link") or "0").strip()
        place = end.findtext("location") or end.findtext("fixed_location")
        points[link] = numbers(place, 3, f"{item}: location on link {link}", "m")
        if end.tag != "attachment":
            pulley = _pulley(end, link, item)
    if set(points) != {"0", "1"}:
        raise InvalidValueError(f"{item}: links", ", ".join(points), "0, 1", "A cable joins base and platform.")
    if element.get("attachment_reference") == "com":
        points["1"] = points["1"] + center
    low, high = (
        number(element.findtext(f"properties/{key}"), f"{item}: {key}", "N") for key in ("force_min", "force_max")
    )
    # CASPR divides K by the cable's length: it is an axial stiffness in N
    stiffness = element.findtext("properties/K") if element.tag == "cable_linear_spring" else None
    known = float("nan") if stiffness is None else number(stiffness, f"{item}: K", "N")
    return _Leg(points["0"], points["1"], low, high, known, pulley)


def _pulley(end: Element, link: str, item: str) -> _Pulley:
    """The pulley at an end of a cable; CASPR's turns about the direction in which the cable enters it, as ours do."""
    if end.tag != "attachment_base_pulley" or link != "0":
        return _Pulley(unlike=f"of a kind unknown here, <{end.tag}>")
    if end.find("pulley_radius") is None or end.find("cable_entry_vector") is None:
        return _Pulley(unlike="without pulley_radius and cable_entry_vector")
    radius = number(end.findtext("pulley_radius"), f"{item}: pulley_radius", "m")
    entry = numbers(end.findtext("cable_entry_vector"), 3, f"{item}: cable_entry_vector", "")
    if not entry[2] or np.hypot(entry[0], entry[1]) > UPRIGHT * abs(entry[2]):
        return _Pulley(unlike="that is not entered vertically")
    return _Pulley(radius, (0.0, 0.0, float(np.sign(entry[2]))))


def _robot(name: str, platform: _Platform, legs: list[_Leg], cables: Cable | None) -> Robot:
    pattern, normal = _JOINTS[platform.joint]
    stiffness = np.array([leg.axial_stiffness for leg in legs])
    unknown = np.isnan(stiffness)
    assumed = {}
    if cables is None:
        cables = Cable(STEEL_ROPE_DENSITY, np.where(unknown, STEEL_ROPE_STIFFNESS, stiffness))
        what = "linear density and axial stiffness" if unknown.any() else "linear density"
        assumed["cables"] = f"{what} of a 4 mm steel rope; the CASPR file gives none"
    radii = [leg.pulley.radius for leg in legs]
    axes = [leg.pulley.swivel_axis for leg in legs]
    return Robot(
        name,
        [leg.frame_anchor for leg in legs],
        [leg.platform_anchor for leg in legs],
        cables,
        platform.mass,
        platform.inertia,
        winches=Winch(radii, swivel_axis=axes) if any(radii) else None,
        center_of_mass=platform.center_of_mass,
        motion_pattern=pattern,
        plane_normal=normal,
        tension_min=[leg.tension_min for leg in legs],
        tension_max=[leg.tension_max for leg in legs],
        source="CASPR files",
        assumed=assumed,
    )
