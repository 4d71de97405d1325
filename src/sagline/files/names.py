"""How files are named after robots: one way for all that is written, whatever a robot is called."""

from __future__ import annotations

import re
import unicodedata
from hashlib import sha256

LONGEST = 120  # bytes: with the words and the suffix that follow it stays below the 255 of common file systems
UNNAMED = "robot"
_DEVICES = re.compile(r"(con|prn|aux|nul|com[\d¹²³]|lpt[\d¹²³])(\..*)?", re.IGNORECASE)  # in every folder of Windows


def file_stem(name: str, *words: str) -> str:
    """A name for files of a robot, without a suffix: never a path, never empty, hidden, too long or a device.

    Letters and digits of all scripts, dots, hyphens and underscores stay, and spaces become hyphens. Where anything
    else was in the name, or it was too long, eight digits of its digest follow, so that two robots do not share files.

    Args:
        name: What the robot is called; any text.
        *words: What else the file is about, "catenary" or "poses": letters, digits and hyphens.

    Returns:
        The name, its parts joined by hyphens.

    Examples:
        >>> from sagline.files.names import file_stem
        >>> file_stem("hall camera", "catenary")
        'hall-camera-catenary'
        >>> file_stem("../../evil", "poses")
        'evil-0fbfd372-poses'
    """
    plain = unicodedata.normalize("NFC", name)
    spaced = "".join(c if _stays(c) else " " for c in plain)
    stem = _cut("-".join(spaced.split())).strip(".-")
    if _DEVICES.fullmatch(stem):
        stem = f"{UNNAMED}-{stem}"
    if not stem or stem != "-".join(plain.split(" ")):
        stem = f"{stem or UNNAMED}-{sha256(name.encode('utf-8', 'surrogatepass')).hexdigest()[:8]}"
    return "-".join((stem, *words))


def _stays(character: str) -> bool:
    return character in "._-" or unicodedata.category(character)[0] in "LMN"  # letters, their marks, numbers


def _cut(text: str) -> str:
    return text.encode()[:LONGEST].decode(errors="ignore")
