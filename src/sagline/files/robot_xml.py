"""Robot files of other programs in XML: safe reading, checked numbers, and a record of lost data."""

from __future__ import annotations

import codecs
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NoReturn, TypeAlias
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from sagline.cables.cable import Cable
from sagline.core.arrays import Array, locked
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.quantity import plain_number, within_reach
from sagline.files.reading import error_at_line, read_bytes
from sagline.robot.robot import Robot
from sagline.robot.winch import UPRIGHT

Column: TypeAlias = Sequence[float | None]  # one number per cable; None if the number is missing in the file
_LIMIT: Final = 4.0  # largest size of a file [MB]; the largest file of CASPR has 0.1 MB
_ENCODING = re.compile(r"utf-?8|utf-?16|us-ascii|ascii|latin-?1|iso-8859-1?[0-9]|(windows-|cp)125[0-8]", re.IGNORECASE)

_DECLARED = re.compile(rb"""\s*<\?xml[^>]*?encoding\s*=\s*["']([A-Za-z0-9._-]+)""")
_CUT_OFF: Final = (3, 4, 5, 6, 20)  # error codes of expat: no element; incomplete token, character or section
# Material for a file without material: a 4 mm steel rope, as in the preset cogiro.
_STEEL_ROPE: Final = {"linear density": 0.065, "axial stiffness": 700e3}  # [kg/m], [N]


def read_xml(path: Path) -> Element:
    """Read the root element of an XML file."""
    # Files that declare entities are refused, because an entity can grow without bound or refer to another file. The
    # file of a document type is never opened
    data = read_bytes(path, _LIMIT)
    builder, parser = TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = _refuse_entity
    parser.XmlDeclHandler = _check_encoding
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:  # a wrong encoding causes the last two errors
        raise error_at_line(path, *_cause(error, data)) from None
    except _RefusedError as error:
        raise FileError(path, *error.args) from None
    return builder.close()


def numbers_of_text(text: str | None, count: int, item: str, unit: str) -> Array:
    """Read `count` numbers separated by blanks. If one is wrong, InvalidValueError names `item` and `unit`."""
    found = [plain_number(word) for word in (text or "").split()[: count + 1]]
    values = [number for number in found if number is not None and within_reach(number)]
    if len(found) != count or len(values) != count:
        shown = "missing" if text is None or not text.strip() else repr(text.strip()[:60])
        wanted = "a number" if count == 1 else f"{count} numbers between blanks"
        raise InvalidValueError(item, shown, f"{wanted}{unit and f' in {unit}'}", f"Correct {item} in the file.")
    return locked(np.array(values))


def number_of_text(text: str | None, item: str, unit: str) -> float:
    """Read one finite number. If the text is not such a number, InvalidValueError names `item` and `unit`."""
    return float(numbers_of_text(text, 1, item, unit)[0])


def only_child(parent: Element, tag: str, item: str) -> Element:
    """Find the element with the tag `tag` inside the element `parent`."""
    found = parent.findall(tag)
    if len(found) != 1:
        step = f"Check that the file is complete, then correct {item}."
        raise InvalidValueError(f"{item}: number of <{tag}>", len(found), "1", step)
    return found[0]


def cables_of_file(
    density: Column, stiffness: Column, tool: str, assumed: dict[str, str], diameter: Sequence[float] | None = None
) -> Cable:
    """Cables of a file. The value of a 4 mm steel rope replaces a value None, and is noted in `assumed`."""
    given = dict(zip(_STEEL_ROPE, (density, stiffness), strict=True))
    if missing := [name for name, values in given.items() if None in values]:
        assumed["cables"] = f"{' and '.join(missing)} of a 4 mm steel rope; the {tool} file gives none"
    columns = ([_STEEL_ROPE[name] if value is None else value for value in values] for name, values in given.items())
    return Cable(*columns, diameter=diameter)


def vertical_axis(sideways: float, up: float) -> tuple[float, float, float] | None:
    """Swivel axis, up or down, from its horizontal part `sideways` and its vertical part `up`; None if inclined."""
    return None if not up or sideways > UPRIGHT * abs(up) else (0.0, 0.0, float(np.sign(up)))


def _cause(error: Exception, data: bytes) -> tuple[str, str]:
    """Reason why the XML parser expat refuses the bytes, and the next step."""
    if not data.strip():
        return "is empty", "Write it again; it may have been cut off."
    declared = _DECLARED.match(data)
    encoding = "utf-8" if declared is None else declared[1].decode()
    if data[:2] not in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        if not data.removeprefix(codecs.BOM_UTF8).lstrip().startswith(b"<"):
            return "is not an XML file", "Check that this is the file you mean."
        if not _decodes(data, encoding):
            said = "so" if declared else "nothing"
            return f"is not {encoding} text, as an XML file that says {said} must be", "Save it as UTF-8."
    if getattr(error, "code", None) in _CUT_OFF:
        return f"is not complete XML ({error})", "Check that this is the file you mean; it may have been cut off."
    return f"is not complete XML ({error})", "Check that this is the file you mean, and correct it there."


def _decodes(data: bytes, encoding: str) -> bool:
    """True if bytes are text in an encoding with one byte per ASCII letter."""
    try:
        return not encoding.lower().startswith(("utf-16", "utf16")) and bool(data.decode(encoding))
    except (LookupError, UnicodeError):
        return False


class _RefusedError(Exception):
    """Exception that stops the parser, with the reason and the next step as arguments."""


def _refuse_entity(name: str, *_: object) -> NoReturn:
    raise _RefusedError(f"declares the entity {name}", "Replace the entity by its text; entities are not read.")


def _check_encoding(version: str, encoding: str | None, standalone: int) -> None:
    if encoding is not None and not _ENCODING.fullmatch(encoding):
        raise _RefusedError(f"is in an unknown encoding, {encoding}", "Save it as UTF-8.")


@dataclass(frozen=True, slots=True, eq=False)
class Imported:
    """Robot from a file of another program, and data of this file that the robot cannot contain.

    Attributes:
        robot: The robot. `robot.assumed` lists each field that the file does not give, and the source of its value.
            `robot.notes` lists the lost data.
        lost: Data of the file that the robot does not contain, one sentence each.
    """

    robot: Robot
    lost: tuple[str, ...]


def with_losses(robot: Robot, lost: tuple[str, ...]) -> Imported:
    """Combine a robot and its lost data. The notes of the robot, and thus its file, then list the lost data."""
    return Imported(robot.replace(notes=" ".join(("Not taken over:", *lost))) if lost else robot, lost)
