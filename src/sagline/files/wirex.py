"""Robots of WireX and WireCenter: an XML file `.wcrfx` with geometry, platform, cables and winches."""

from __future__ import annotations

import os
import re
from itertools import combinations_with_replacement, product
from typing import Final, cast, get_args
from xml.etree.ElementTree import Element

import numpy as np

from sagline.cables.cable import Cable
from sagline.core.arguments import file_path, optional
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.files import robot_xml as xml
from sagline.files.reading import value_errors
from sagline.files.robot_xml import Imported
from sagline.robot.checks import MOTION_PATTERNS, PLANAR, ROTATING, MotionPattern
from sagline.robot.robot import Robot, box_inertia
from sagline.robot.winch import Winch

_AXES: Final = ("x", "y", "z")
_FLATTEST: Final = 0.1  # smallest ratio of two edges of the assumed box, because all anchors may be in a plane
_VERSIONS: Final = ("0.31", "0.32")
_SAVE_AGAIN: Final = "Open it in WireCenter and save it again."
_INFINITE: Final = re.compile(r"\+?(inf|infinity|1\.#inf0*)", re.IGNORECASE)  # Windows programs write 1.#INF


def load_wirex(source: str | os.PathLike[str], cables: Cable | None = None) -> Imported:
    """Read a robot file of WireX (version 0.31 or 0.32 of its format).

    WireX does not require material, inertia or limits. Missing values are assumed and listed in the robot's `assumed`.
    A missing moment of inertia is set to the largest given moment, and a missing product of inertia to zero. If no
    inertia is given, the platform is a box around its anchors. Only pulleys with a vertical swivel axis are read. The
    data read from a winch are its largest force, its drum and the inertia of its motor.

    Args:
        source: The `.wcrfx` file.
        cables: The cables' material. None: the material of the file, or a 4 mm steel rope if the file has no material.

    Returns:
        Imported: the robot, and the lost data.

    Raises:
        FileError: If the file cannot be read or has another version. If the robot does not have one platform.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_wirex("robot.wcrfx").robot  # doctest: +SKIP
    """
    optional(cables, Cable, "cables")
    path = file_path(source, "source")
    with value_errors(path):
        root = xml.read_xml(path)
        _check_generation(root)
        return _robot(root, path.stem, cables)


def _check_generation(root: Element) -> None:
    if root.tag != "models":
        raise InvalidValueError("root element", f"<{root.tag}>", "<models>", "Check that this is a .wcrfx file.")
    if root.find("robot") is None and root.find("wireRobot") is not None:
        raise InvalidValueError("robot", "in the old form <wireRobot>", "<robot>", _SAVE_AGAIN)
    version = root.get("version")
    if version not in _VERSIONS:
        shown = "missing" if version is None else repr(version)
        raise InvalidValueError("version of the format", shown, " or ".join(_VERSIONS), _SAVE_AGAIN)


def _robot(root: Element, name: str, cables: Cable | None) -> Imported:
    robot = xml.only_child(root, "robot", "models")
    chains = robot.findall("geometry/chain")
    if not chains:
        raise InvalidValueError("number of <chain>", 0, ">= 1", "Check that the file is complete.")
    platforms = robot.findall("platform")
    if len(platforms) > 1:
        raise InvalidValueError("number of <platform>", len(platforms), "1", "sagline supports a single platform.")
    materials = [_material(root, chain, k) for k, chain in enumerate(chains)]
    platform = platforms[0] if platforms else Element("platform")
    assumed: dict[str, str] = {}
    pattern = _pattern(robot, assumed)
    low, high = _limits(root, materials, assumed)
    mass = _required(platform, "mass", "platform", "kg")
    anchors = [_point(chain, "platform", k) for k, chain in enumerate(chains)]
    winches, lost = _winches(root, chains)
    result = Robot(
        robot.get("name") or name,
        [_point(chain, "base", k) for k, chain in enumerate(chains)],
        anchors,
        _cables(materials, assumed) if cables is None else cables,
        mass,
        _inertia(platform, mass, np.ptp(anchors, axis=0), assumed) if pattern in ROTATING else None,
        winches=winches,
        center_of_mass=_center(platform, assumed),
        motion_pattern=pattern,
        plane_normal=(0.0, 0.0, 1.0) if pattern in PLANAR else None,
        tension_min=low,
        tension_max=high,
        source=f"WireX file {root.get('version', '')}".strip(),
        assumed=assumed,
    )
    return xml.with_losses(result, (*lost, *_lost(root)))


def _optional(element: Element | None, key: str, item: str, unit: str) -> float | None:
    """Number in the attribute `key`. None if missing, empty or infinite (some programs write infinity for unknown)."""
    text = "" if element is None else element.get(key, "").strip()
    if not text or _INFINITE.fullmatch(text):
        return None
    return xml.number_of_text(text, f"{item}: {key}", unit)


def _required(element: Element, key: str, item: str, unit: str) -> float:
    return xml.number_of_text(element.get(key), f"{item}: {key}", unit)


def _point(chain: Element, tag: str, k: int) -> list[float]:
    item = f"chain {k + 1}"
    element = xml.only_child(chain, tag, item)
    return [_required(element, axis, f"{item}: {tag}", "m") for axis in _AXES]


def _material(root: Element, chain: Element, k: int) -> Element:
    """The <cable> with the number (from 1) in cable_id of `chain`, by default the first; empty if it does not exist."""
    known = root.findall("cable")
    text = chain.get("cable_id", "1")
    if not known:
        return Element("cable")
    if not text.isdecimal() or not 1 <= int(text) <= len(known):
        raise InvalidValueError(f"chain {k + 1}: cable_id", repr(text), f"1 to {len(known)}", "Correct it in the file.")
    return known[int(text) - 1]


def _cables(materials: list[Element], assumed: dict[str, str]) -> Cable:
    density: list[float | None] = []
    stiffness: list[float | None] = []
    diameter: list[float] = []
    for element in materials:
        item = f"cable {element.get('name', '')}".strip()
        modulus = _optional(element, "elasticity", item, "Pa")
        radius = _optional(element, "radius", item, "m")
        if radius is not None and radius < 0.0:
            raise InvalidValueError(f"{item}: radius", f"{radius:g} m", ">= 0 m", "Correct it in the file.")
        density.append(_optional(element, "weight", item, "kg/m") or None)  # zero in a file means unknown
        stiffness.append((modulus or 0.0) * np.pi * (radius or 0.0) ** 2 or None)
        diameter.append(2.0 * (radius or 0.0))
    return xml.cables_of_file(density, stiffness, "WireX", assumed, diameter if all(diameter) else None)


def _winches(root: Element, chains: list[Element]) -> tuple[Winch | None, tuple[str, ...]]:
    """Pulleys and drums of the file, and a list of the lost data."""
    lost, radii, axes = [], [], []
    for k, chain in enumerate(chains):
        item = f"chain {k + 1}: base"
        base = xml.only_child(chain, "base", f"chain {k + 1}")
        radius, axis = _optional(base, "radius", item, "m") or 0.0, _axis(base, item)
        if axis is None and radius:
            lost.append(
                f"The pulley of chain {k + 1} (radius {radius:g} m), whose axis is not vertical: its cable starts "
                "at the point of <base>."
            )
        radii.append(0.0 if axis is None else radius)
        axes.append((0.0, 0.0, 1.0) if axis is None else axis)
    found = root.findall("winch")
    drive = _drive(found[0]) if len(found) == 1 else {}
    if len(found) == 1:
        taken = "; its largest force, its drum and the inertia of its motor are used if they are given"
        lost.append(f"The gear, speeds, power and sensors of the winch{taken}.")
    elif found:
        lost.append("The winches, because the file does not assign them to cables; the force of the first one is used.")
    if not any(radii) and not drive:
        return None, tuple(lost)
    return Winch(radii, swivel_axis=axes, **drive), tuple(lost)


def _axis(base: Element, item: str) -> tuple[float, float, float] | None:
    """Direction in which a cable enters its pulley: z axis of the matrix a11 to a33 (default: up). None if inclined."""
    if base.get("a33") is None:
        return (0.0, 0.0, 1.0)
    upright = _required(base, "a33", item, "")
    # if the z axis is vertical, the last row and column are zero except on the diagonal
    sideways = max(abs(_optional(base, key, item, "") or 0.0) for key in ("a13", "a23", "a31", "a32"))
    return xml.vertical_axis(sideways, upright)


def _drive(winch: Element) -> dict[str, float]:
    """Data of drum and motor; a zero in the file means unknown."""
    drum, motor = winch.find("drum"), winch.find("motor")
    width, grooves = (_optional(drum, key, "winch: drum", unit) for key, unit in (("l_drum", "m"), ("nr_groove", "")))
    fields = {
        "drum_radius": _optional(drum, "r_drum", "winch: drum", "m"),
        "drum_width": width,
        "groove_pitch": width / grooves if width and grooves else None,
        "inertia": _optional(motor, "inertia", "winch: motor", "kg m^2"),
    }
    return {name: value for name, value in fields.items() if value}


def _pattern(robot: Element, assumed: dict[str, str]) -> MotionPattern:
    given = robot.get("motionpattern") or "3R3T"
    if given not in get_args(MotionPattern):
        step = "sagline has no other pattern; correct it in the file."
        raise InvalidValueError("motionpattern", repr(given), ", ".join(MOTION_PATTERNS), step)
    if given in PLANAR:
        assumed["plane_normal"] = "z: the file names no plane; the x-y plane is assumed"
    return cast(MotionPattern, given)


def _limits(root: Element, materials: list[Element], assumed: dict[str, str]) -> tuple[list[float], list[float]]:
    """Tension limits: the lower from the cable, the upper from the winch or else the cable's breaking load."""
    low = [_optional(element, "minimum_load", "cable", "N") for element in materials]
    break_at = [_optional(element, "breaking_load", "cable", "N") or None for element in materials]
    winch = _optional(root.find("winch/cable"), "f_max", "winch: cable", "N") or None
    if None in low:
        assumed["tension_min"] = "0 N; the WireX file gives none"
    if winch is None and None in break_at:
        assumed["tension_max"] = "none; the WireX file gives neither winch nor breaking load"
    elif winch is None:
        assumed["tension_max"] = "the breaking load; the WireX file gives no winch"
    return [value or 0.0 for value in low], [winch or load or np.inf for load in break_at]


def _center(platform: Element, assumed: dict[str, str]) -> list[float]:
    center = platform.find("centerofgravity")
    if center is None:
        assumed["center_of_mass"] = "the platform's origin; the WireX file gives none"
        return [0.0, 0.0, 0.0]
    return [_required(center, axis, "centerofgravity", "m") for axis in _AXES]


def _inertia(platform: Element, mass: float, size: Array, assumed: dict[str, str]) -> Array:
    """Inertia matrix. One of two symmetric elements may be missing; if both are missing, a value is assumed."""
    matrix = np.full((3, 3), np.nan)
    tensor = platform.find("inertiatensor")
    for (i, row), (j, column) in product(enumerate(_AXES), repeat=2):
        value = _optional(tensor, f"I{row}{column}", "inertiatensor", "kg m^2")
        matrix[i, j] = np.nan if value is None else value
    matrix = np.where(np.isnan(matrix), matrix.T, matrix)
    if not np.nan_to_num(matrix).any():
        assumed["inertia"] = "that of a solid box around the platform's anchors; the WireX file gives none"
        return box_inertia(mass, *np.maximum(size, _FLATTEST * size.max()))
    why = ["taken about the center of mass; the WireX format does not say about which point"]
    missing = [(i, j) for i, j in combinations_with_replacement(range(3), 2) if np.isnan(matrix[i, j])]
    products = [pair for pair in missing if pair[0] != pair[1]]
    if len(products) not in (0, 3):  # if one or two products of inertia are given, a missing product is an error
        key = "I" + "".join(_AXES[k] for k in products[0])
        raise InvalidValueError(f"inertiatensor: {key}", "missing", "a number in kg m^2", f"Add {key} to the file.")
    if missing:
        names = ", ".join(f"I{_AXES[i]}{_AXES[j]}" for i, j in missing)
        largest = float(np.nanmax(np.diag(matrix)))
        why.append(f"{names} missing: moments taken as the largest given, {largest:g} kg m^2, products as 0")
        matrix = np.where(np.isnan(matrix), largest * np.eye(3), matrix)
    assumed["inertia"] = "; ".join(why)
    return matrix


def _lost(root: Element) -> tuple[str, ...]:
    lost = {
        "The cables' damping, cost and largest length.": any(cable.get("damping") for cable in root.findall("cable")),
        "The controller.": root.find("robot/controller") is not None,
        "The application: its load and its limits of the cables' forces.": root.find("robot/application") is not None,
    }
    return tuple(text for text, there in lost.items() if there)
