"""XML files of other tools: read without trusting them, their numbers checked one by one."""

from __future__ import annotations

from pathlib import Path
from typing import NoReturn
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from sagline.arrays import Array, locked
from sagline.errors import FileError, InvalidValueError


def read_xml(path: Path) -> Element:
    """The root element of an XML file.

    A file that declares entities is refused, so that none can grow without bound or name another file; a document
    type is skipped, and what it points to is never opened.

    Args:
        path: The file.

    Returns:
        The root element.

    Raises:
        FileError: If the file is missing, unreadable, no complete XML, or declares entities.
    """
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise FileError(path, f"cannot be read ({reason})", "Check its name and its permissions.") from None
    builder, parser = TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = _refuse_entity
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError) as error:  # LookupError: an encoding nobody knows
        raise FileError(
            path, f"is no complete XML ({error})", "Check that this is the file you mean; it may have been cut off."
        ) from None
    except _EntityDeclaredError as error:
        raise FileError(path, f"declares the entity {error}", "Write its text out; entities are not read.") from None
    return builder.close()


def numbers(text: str | None, count: int, item: str, unit: str) -> Array:
    """As many finite numbers as wanted, between blanks.

    Args:
        text: The text; None where the file has none.
        count: How many numbers there must be.
        item: The name a message uses.
        unit: Their unit, for the message; "" for none.

    Returns:
        The numbers, shape (count,).

    Raises:
        InvalidValueError: If the text is missing or says anything else; the message names the item.
    """
    try:
        values = np.array((text or "").split(), dtype=np.float64)
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not np.isfinite(values).all():
        shown = "missing" if text is None or not text.strip() else repr(text.strip()[:60])
        wanted = "a number" if count == 1 else f"{count} numbers between blanks"
        raise InvalidValueError(item, shown, f"{wanted}{unit and f' in {unit}'}", f"Correct {item} in the file.")
    return locked(values)


def number(text: str | None, item: str, unit: str) -> float:
    """One finite number.

    Args:
        text: The text; None where the file has none.
        item: The name a message uses.
        unit: Its unit, for the message; "" for none.

    Returns:
        The number.

    Raises:
        InvalidValueError: If the text is missing or says anything else; the message names the item.
    """
    return float(numbers(text, 1, item, unit)[0])


def only_child(parent: Element, tag: str, item: str) -> Element:
    """The element of this tag inside another.

    Args:
        parent: The element to look in.
        tag: The tag to look for.
        item: What the parent is called in a message.

    Returns:
        The element.

    Raises:
        InvalidValueError: If there is none, or more than one.
    """
    found = parent.findall(tag)
    if len(found) != 1:
        raise InvalidValueError(
            f"{item}: number of <{tag}>", len(found), "1", f"Check that the file is whole, then correct {item}."
        )
    return found[0]


class _EntityDeclaredError(Exception):
    """Stops the parser at an entity's declaration."""


def _refuse_entity(name: str, *_: object) -> NoReturn:
    raise _EntityDeclaredError(name)
